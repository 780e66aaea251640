"""Several policies in one swarm: change PARTS, and play it.

    swarm-logistics run --policy examples/mixed_swarm.py:Mixed

A robot does what it would do upon the same observations in a swarm of its policy alone.
"""

from typing import Any

import numpy as np

from swarm_logistics_env import policies

# How many robots play which policy; a swarm of another size is shared out in this proportion. All
# decide for each robot from its own row: `central` commands the whole swarm and cannot be a part.
PARTS = {"swarm-dt": 20, "ppo-delivery": 5}


class Mixed:
    def __init__(self):
        self.parts: list[Any] = [policies.load(name) for name in PARTS]

    def configure(self, scenario):
        for part in self.parts:
            part.configure(scenario)

    def reset(self, n_robots, seed):
        # Each part has all rows, so that a robot's random numbers are those of its row.
        for part in self.parts:
            part.reset(n_robots, seed)
        shares = np.cumsum(list(PARTS.values())) / sum(PARTS.values())
        self.robots = np.arange(n_robots)
        self.part_of_robot = np.searchsorted(np.rint(shares * n_robots), self.robots, side="right")

    def act(self, observations):
        commands = np.array([part.act(observations) for part in self.parts])
        return commands[self.part_of_robot, self.robots]
