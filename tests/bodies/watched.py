"""Bodies whose orders and poses a test can read; a module of its own, as a world imports it."""

from __future__ import annotations

import math
import random

from swarm_logistics_env.bodies import Orders, Placement, Poses
from tests.bodies.test_bodies import Exact


class Watched(Exact):
    """Robots that do what they want, and now and then lose one; keeps what it was told."""

    def place(self, placement: Placement) -> None:
        """Begin at rest, with a stream of its own."""
        super().place(placement)
        self.rng = random.Random(placement.seed)
        self.orders: list[Orders] = []

    def move(self, orders: Orders) -> Poses:
        """Move as wanted, but for robots that are lost from now on."""
        self.orders.append(orders)
        poses = self.poses = super().move(orders)
        if self.rng.random() < 0.05:
            robot = self.rng.randrange(len(orders.laden))
            poses.lost[robot] = True
            poses.position[robot] = math.nan
            self.position[robot] = 0.0
        return poses
