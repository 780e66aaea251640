"""A controller that drives ahead, turns before what is near, and lifts what is asked for."""

import numpy as np

from swarm_logistics_env import Scenario
from swarm_logistics_env.observations import unflatten


class Wanderer:
    def reset(self, n_robots, seed): ...

    def act(self, observations):
        row = unflatten(observations, Scenario())
        ahead = np.minimum(row["range_walls"][:, 0], row["range_robots"][:, 0])
        wanted = row["item_requested"].any(axis=1) | (row["carrying_requested"][:, 0] > 0)
        forward, turn = np.clip(ahead - 0.2, 0.1, 1.0), np.where(ahead < 0.6, 0.5, 0.0)
        return np.column_stack([forward, 0 * turn, turn, np.where(wanted, 1.0, -1.0)])
