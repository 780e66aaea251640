"""Training of policies: PPO, from a preset or a file of one's own.

Nothing here is imported by the rest of the package; `trainer` and what it uses load torch.
"""

from swarm_logistics_env.train.training import Training, load_training, preset_names

__all__ = ["Training", "load_training", "preset_names"]
