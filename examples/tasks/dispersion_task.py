"""VMAS's dispersion, by its Gymnasium door, as a task: P is the number of pieces of food eaten.

Bettini et al., VMAS: A Vectorized Multi-Agent Simulator for Collective Robot Learning, DARS 2022.
`pip install vmas shimmy` brings it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import vmas
from numpy.typing import NDArray
from tuple_env import TupleEnv

from swarm_logistics_env.study.tasks import ParallelTask, SumOfRewards

STILL = np.zeros(2, dtype=np.float32)
GAIN = 3.0  # of the push by the distance, so that robots slow down near the food
BRAKE = 1.0  # of the push by the speed
PREFERENCE = 0.7  # for food in the robot's own direction


def make_env(n_robots: int, n_food: int, absent: Sequence[int] = ()) -> TupleEnv:
    """Return the environment. All robots start in the middle, so absent ones are just fewer."""
    return TupleEnv(
        vmas.make_env(
            "dispersion",
            num_envs=1,
            wrapper="gymnasium",
            terminated_truncated=True,
            n_agents=n_robots - len(absent),
            n_food=n_food,
            share_reward=True,
        )
    )


class OwnSector:
    """Sends each robot to food that is near, rather in the direction that is its own.

    A robot decides from its own observation, which tells where all the food is.
    """

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode; nothing here is random."""
        angles = 2 * np.pi * np.arange(n_robots) / n_robots
        self._directions = np.column_stack([np.cos(angles), np.sin(angles)])

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return an action, a push (x, y), for each row."""
        pushes = [self._push(robot, row) for robot, row in enumerate(observations)]
        return np.array(pushes, dtype=np.float32)

    def _push(self, robot: int, row: NDArray[np.float32]) -> Any:
        food = row[4:].reshape(-1, 3)  # x, y, whether it was eaten
        uneaten = food[food[:, 2] == 0, :2]
        if not row.any() or not len(uneaten):  # absent, blind, or done
            return STILL
        cost = np.linalg.norm(uneaten, axis=1) - PREFERENCE * uneaten @ self._directions[robot]
        push = GAIN * uneaten[np.argmin(cost)] - BRAKE * row[2:4]
        return np.clip(push, -1.0, 1.0)


DISPERSION = ParallelTask(
    make_env,
    name="dispersion",
    n_robots=4,
    steps=40,
    parameters={"n_food": 24},
    performance=SumOfRewards(shared=True),
    failures={"silent": STILL, "frozen": None, "blind": None, "noisy": 0.2, "removed": "absent"},
    policies={"own-sector": OwnSector},
)
