"""A controller that drives ahead, turns before what is near, and lifts what is asked for."""

import numpy as np

from swarm_logistics_env import Scenario
from swarm_logistics_env.world.observations import unflatten


class Wanderer:
    def reset(self, n_robots, seed):
        self.n_robots = n_robots

    def act(self, observations):
        row = unflatten(observations, Scenario())
        carries = row["carrying"][:, 0] > 0
        clearance = np.minimum(row["range_walls"][:, 0], row["range_robots"][:, 0])
        # An unladen robot drives under items, a laden one bumps into them.
        clearance = np.where(carries, np.minimum(clearance, row["range_items"][:, 0]), clearance)
        commands = np.zeros((self.n_robots, 4))
        commands[:, 0] = np.clip(clearance - 0.2, 0.1, 1.0)  # forward
        commands[:, 2] = np.where(clearance < 0.6, 0.5, 0.0)  # turn left
        holds = row["item_requested"].any(axis=1) | (row["carrying_requested"][:, 0] > 0)
        commands[:, 3] = np.where(holds, 1.0, -1.0)  # gripper: hold, open
        return commands
