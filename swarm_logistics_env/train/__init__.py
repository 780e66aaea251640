"""Training of policies: PPO from presets, and the search for a scripted policy's parameters.

Nothing here is imported by the rest of the package; `trainer` and what it uses load torch.
"""

from swarm_logistics_env.train.training import Training, load_training, preset_names

__all__ = ["Training", "load_training", "preset_names"]
