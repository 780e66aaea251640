"""A world whose bodies something else moves: orders out, poses in, for each control step."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from swarm_logistics_env.core.errors import BodiesError
from swarm_logistics_env.world.bodies import Bodies, Orders, Placement
from swarm_logistics_env.world.bodies.bodies import checked_poses
from swarm_logistics_env.world.scenario import CHIPMUNK, Scenario

from . import stepping
from .absence import remove
from .failure_modes import failure_mode
from .faults import Fault
from .physics import N_CORNERS
from .state import WarehouseState
from .structs import NOBODY, Numbers, Sensed, World


def check_returns(faults: Sequence[Fault], scenario: Scenario) -> Sequence[Fault]:
    """Return the faults, by which robots come back only where the package's engine moves them.

    Raises:
        BodiesError: robots come back elsewhere, where nobody can put them.
    """
    for fault in faults:
        if failure_mode(fault.mode).returns and scenario.bodies != CHIPMUNK:
            raise BodiesError(
                f"fault {fault.mode}: bodies = {scenario.bodies} cannot put a robot back into the "
                f'arena; should be "dead", with which it stays there, or bodies = {CHIPMUNK}'
            )
    return faults


class MovedElsewhere:
    """The bodies of one episode, from its start on.

    Args:
        bodies: what moves the robots.
        scenario, seed: of the episode.
        world: of the episode, at its start.
    """

    def __init__(self, bodies: Bodies, scenario: Scenario, seed: int, world: World) -> None:
        robots = world.robots
        corners = world.floor.corners.reshape(-1, N_CORNERS, 2)
        boxes = np.column_stack([corners.min(axis=1), corners.max(axis=1)])
        bodies.place(
            Placement(
                scenario=scenario,
                seed=seed,
                position=robots.position.copy(),
                heading=robots.heading.copy(),
                obstacles=world.obstacles.copy(),
                boxes=boxes,
            )
        )
        self._bodies = bodies
        self._size = np.array([scenario.warehouse_width, scenario.warehouse_height])
        self._period = scenario.control_period
        self._motions = np.zeros((scenario.n_robots, 3))

    def step(self, address: int, world: World, state: WarehouseState, rows: Sensed) -> bool:
        """Take a control step and fill the observation rows; returns what `stepping.step` does.

        Robots that are lost are taken out of the arena where they were last.

        Raises:
            BodiesError: the poses cannot be.
        """
        if stepping.command_bodies(address, self._motions):
            return True
        orders = Orders(
            self._motions.copy(), state.robot_item != NOBODY, state.robot_present.copy()
        )
        poses = checked_poses(self._bodies.move(orders), len(self._motions))
        for robot in np.flatnonzero(poses.lost & state.robot_present).tolist():
            remove(address, robot)
        is_seen = state.robot_present
        moved = world.engine.bodies
        # Walls are the world's: nobody is outside, whatever a camera says.
        moved[is_seen, :2] = np.clip(poses.position[is_seen], 0.0, self._size)
        moved[is_seen, 2:] = poses.velocity[is_seen]
        heading = within_half_a_turn(poses.heading[is_seen])
        turned = within_half_a_turn(heading - state.robot_heading[is_seen])
        drift = state.robot_heading_drift[is_seen]
        state.robot_turn_rate[is_seen] = turned / self._period - drift
        state.robot_heading[is_seen] = heading
        return stepping.follow_bodies(address, rows)


def within_half_a_turn(angle: Numbers) -> Numbers:
    """Return angles [rad] less whole turns, within +-pi."""
    return np.remainder(angle + math.pi, 2.0 * math.pi) - math.pi
