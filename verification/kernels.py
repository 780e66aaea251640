"""Compiles kernels that tests share: `python -m verification.kernels`, before two workers begin.

Each of them would compile what the other compiles at the same time. Golden trajectories, which are
played before, compile those of a world and of most scripts.
"""

import numpy as np

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.policies.learned import Network
from swarm_logistics_env.train import Training
from swarm_logistics_env.train.training_worlds import NetworkView

POLICIES = ("ppo-robust", "biased-walk", "site-fidelity")


def main() -> None:
    """Play policies and bodies for a moment, and step the worlds of a training."""
    for name in POLICIES:
        run_episode(Scenario(duration=2.0), policies.load(name), seed=0)
    run_episode(Scenario(duration=2.0, bodies="mujoco"), policies.load("homing"), seed=0)
    training = Training(
        network=Network(decides_every=2), rewards={"delivery": 1.0, "approach": 0.1}
    )
    view = NetworkView(training)
    view.reset()
    view.step(np.zeros((view.num_envs, 3), np.float32))
    view.close()


if __name__ == "__main__":
    main()
