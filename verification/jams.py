"""Swarms driven to one point, to a wall and into a corner for 15 s: how deep bodies overlap."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse
from verification.invariants import JAM, SUSTAINED

SIZES = (25, 150)
SECONDS = 15.0
# The point that all robots drive to [m]; along an axis that is None each stays where it is.
TARGETS: dict[str, tuple[float, float | None]] = {
    "point": (5.0, 5.0),
    "wall": (10.0, None),
    "corner": (0.0, 0.0),
}
MEDIAN = 0.002  # [m], the most that the deepest overlap of a step may be, half of the time


@dataclass(frozen=True)
class Overlaps:
    """Overlaps of a jam [m].

    Attributes:
        median: the median over all steps of the deepest overlap.
        lasting: the deepest overlap that lasted longer than `JAM` seconds without a break.
        robots, walls: the deepest overlap of two robots, and of a robot with a wall.
    """

    median: float
    lasting: float
    robots: float
    walls: float

    def problem(self, scenario: Scenario) -> str | None:
        """Return what is beyond its bound, or None.

        The peak may be what is closed in one substep at top speed.
        """
        closing = scenario.max_speed * scenario.physics_period
        bounds = {"median": MEDIAN, "lasting": SUSTAINED, "robots": 2 * closing, "walls": closing}
        for name, bound in bounds.items():
            value = getattr(self, name)
            if not value <= bound + 1e-6:
                return f"{name} overlap {1000 * value:.1f} mm: should be {1000 * bound:g} at most"
        return None


def overlaps(n_robots: int, target: str, seed: int) -> Overlaps:
    """Drive `n_robots` to a target of `TARGETS` at top speed and measure."""
    world = Warehouse(Scenario(n_robots=n_robots, n_items=1))
    world.reset(seed)
    depths: list[float] = []
    robots = walls = lasting = 0.0
    since = np.zeros((n_robots, n_robots + 4))
    for _ in range(math.ceil(SECONDS / world.scenario.control_period)):
        world.step(_towards(world, *TARGETS[target]))
        depth = _depths(world)
        depths.append(float(depth.max()))
        robots = max(robots, float(depth[:, :n_robots].max()))
        walls = max(walls, float(depth[:, n_robots:].max()))
        since = np.where(depth > SUSTAINED, since + world.scenario.control_period, 0.0)
        lasting = max(lasting, float(depth[since > JAM].max(initial=0.0)))
    return Overlaps(float(np.median(depths)), lasting, robots, walls)


def _towards(world: Warehouse, x: float, y: float | None) -> NDArray[np.float64]:
    at = world.state.robot_position
    angle = np.arctan2((at[:, 1] if y is None else y) - at[:, 1], x - at[:, 0])
    angle -= world.state.robot_heading
    zeros = np.zeros_like(angle)
    return np.column_stack([np.cos(angle), np.sin(angle), zeros, zeros])


def _depths(world: Warehouse) -> NDArray[np.float64]:
    """Return how far every robot (row) overlaps every other and the four walls [m], (N, N + 4)."""
    at, scenario = world.state.robot_position, world.scenario
    gaps = np.linalg.norm(at[:, None] - at[None], axis=2) - 2.0 * scenario.robot_radius
    np.fill_diagonal(gaps, np.inf)
    far = np.array([scenario.warehouse_width, scenario.warehouse_height])
    return -np.hstack([gaps, np.hstack([at, far - at]) - scenario.robot_radius])
