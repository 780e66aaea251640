"""A central controller that sees the whole warehouse, for comparison with swarms.

One robot at a time works on the oldest request: the best one fetches the item and takes it home,
on the cheapest way around free items and other robots. All others wait right under free items,
spread out, so that somebody is always near, and nobody is where a laden robot could drive. It does
not know which robots fail. If a robot makes no progress, another one is sent, and the first is not
chosen again for a while.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.crowd import approach, commands_of, drift, share_items
from swarm_logistics_env.policies.planned_ground import ground_of
from swarm_logistics_env.policies.policy import Scripted
from swarm_logistics_env.policies.routes import (
    CELL,
    cell_at,
    cost_to_go,
    discs_among,
    lookahead,
)
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.state import NOBODY, STORED, WarehouseState

REPLAN = 0.3  # [s]
NEAR = 0.3  # [m] from here on the worker drives straight to its item
PATIENCE = 2.0  # [s] without getting nearer, beside its handling time, until another one is sent
STUCK = 0.6  # [s] without getting nearer, until a laden worker steps over an item
STEP = 0.2  # [s] without its item
DISTRUST = 30.0  # [s]


class Central(Scripted):
    """One controller that sees the whole warehouse, for comparison with swarms; needs the state.

    Example:
        >>> from swarm_logistics_env import run_episode
        >>> run_episode(Scenario(n_robots=5, duration=20.0), Central(), seed=0).delivered > 0
        True
    """

    needs_state = True
    laden_wait = True  # whether robots that carry an item wait as well

    def configure(self, scenario: Scenario) -> None:
        """Take the sizes of the warehouse and of the robots, and the floor plan."""
        self._scenario = scenario
        # Of the kind that gets farthest: others come to a stand in time, too.
        self._stride = scenario.highest_speed * scenario.control_period  # [m] in a control step
        speed = np.array(scenario.of_kinds("max_speed"))
        braking_distances = speed**2 / (2.0 * np.array(scenario.of_kinds("max_acceleration")))
        self._braking_distance = float(braking_distances.max())
        self._full_turn = np.array(scenario.of_kinds("max_turn_rate")) * scenario.control_period
        self._lifts = np.array(scenario.of_kinds("lifts"))
        self._ground = ground_of(scenario)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode; nothing here is random."""
        self._ground = ground_of(self._scenario)  # obstacles stand elsewhere
        self._trusted_from = np.full(n_robots, -np.inf)  # [s]
        self._waits_under = np.full(n_robots, NOBODY)  # the item of each robot
        self._resting_places = self._ground.resting_places(n_robots)
        self._worker = NOBODY
        self._task: tuple[int, bool] = (NOBODY, False)
        self._least_distance = np.inf  # [m] to the goal of the worker's task
        self._least_distance_at = 0.0  # [s]
        self._planned_at = -np.inf
        self._stepping = NOBODY  # who last stepped over an item
        self._stepped_from = np.zeros(2)  # [m]
        self._stepped_at = -np.inf  # [s]
        self._step_velocity = np.zeros(2)  # in top speeds

    def act(
        self, observations: NDArray[np.float32], state: WarehouseState | None = None
    ) -> NDArray[np.float64]:
        """Return commands (N, 4) from the state alone.

        Raises:
            PolicyError: there is no state, or it has another number of robots than `reset` got.
        """
        if state is None:
            raise PolicyError("state = None: should be the WarehouseState, as needs_state says")
        if state.n_robots != len(self._trusted_from):
            raise PolicyError(
                f"a state of {state.n_robots} robots: reset was told {len(self._trusted_from)}"
            )
        worker = self._assign(state)
        is_idle = state.robot_present.copy()
        if worker != NOBODY:
            is_idle[worker] = False
        goals = self._waiting_places(state, is_idle)
        if self._scenario.floor is not None:
            for robot in np.flatnonzero(is_idle).tolist():
                goals[robot] = self._ground.point_to(state, robot, goals[robot])
        gripper = np.where(state.robot_item == NOBODY, 0.0, -1.0)  # nobody hoards
        self._stock(state, is_idle, goals, gripper)
        velocity = self._drift(state, goals, worker)
        if worker != NOBODY:
            velocity[worker] = self._worker_velocity(state, worker, is_idle)
            # Of several items in reach the requested one comes first, so no other gets lifted.
            may_hold = self._task[1] or self._to_item(state) <= self._scenario.pickup_range
            gripper[worker] = 1.0 if may_hold else 0.0
            if self._scenario.floor is not None:
                self._step_over(state, worker, velocity, gripper)
        return self._steer(state, velocity, gripper)

    def _stock(
        self,
        state: WarehouseState,
        is_idle: NDArray[np.bool_],
        goals: NDArray[np.float64],
        gripper: NDArray[np.float64],
    ) -> None:
        """Change what robots without a request do: where they go [m] and what they hold."""

    def _waiting_places(
        self, state: WarehouseState, is_idle: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return where each robot should wait (N, 2) [m], and note under which item.

        They are spread out. Unladen robots drive under items, which laden ones have to go around
        anyway. Who has no item waits far from the docks.

        Args:
            is_idle: which robots have no request to work on (N,).
        """
        waits = is_idle if self.laden_wait else is_idle & (state.robot_item == NOBODY)
        goals = self._resting_places.copy()
        share_items(
            state.robot_position, state.item_position, state.item_status, state.requested, waits,
            self._waits_under, goals,
        )  # fmt: skip
        return goals

    # -- who -----------------------------------------------------------------------------------

    def _assign(self, state: WarehouseState) -> int:
        item = state.requested
        if item == NOBODY:
            return NOBODY
        carrier = int(state.item_carrier[item])
        task = (item, carrier != NOBODY)
        if self._worker != NOBODY and self._task == task:
            self._judge(state)
        is_trusted = self._trusted_from <= state.time
        if carrier != NOBODY:
            worker = carrier if is_trusted[carrier] else NOBODY
        else:
            worker = self._nearest(state, item, is_trusted)
        if worker != self._worker or task != self._task:
            self._worker = worker
            self._task = task
            self._least_distance = np.inf
            self._least_distance_at = state.time
            self._planned_at = -np.inf
        return worker

    def _nearest(self, state: WarehouseState, item: int, is_trusted: NDArray[np.bool_]) -> int:
        free = state.robot_present & (state.robot_item == NOBODY) & self._lifts[state.robot_kind]
        if not free.any():
            return NOBODY
        is_candidate = free & is_trusted if (free & is_trusted).any() else free
        distance = self._ground.ways_to(state, state.item_position[item])
        if self._worker != NOBODY and is_candidate[self._worker]:
            distance[self._worker] -= 0.5  # no dithering between two that are as near
        return int(np.where(is_candidate, distance, np.inf).argmin())

    def _judge(self, state: WarehouseState) -> None:
        """Stop trusting a worker that gets no nearer to its goal."""
        distance = self._distance_to_goal(state)
        if distance < self._least_distance - 0.05:
            self._least_distance = distance
            self._least_distance_at = state.time
        elif state.time > self._least_distance_at + PATIENCE + self._scenario.handling_time:
            self._trusted_from[self._worker] = state.time + DISTRUST

    def _distance_to_goal(self, state: WarehouseState) -> float:
        if not self._task[1]:
            return self._way_to_item(state)
        if self._planned_at < 0:
            return np.inf
        x, y = state.robot_position[self._worker].tolist()
        return float(self._cost_to_go[cell_at(self._cost_to_go, x, y)]) * CELL

    def _to_item(self, state: WarehouseState) -> float:
        """Return how far the worker is from the item of its task [m]."""
        return math.dist(state.robot_position[self._worker], state.item_position[self._task[0]])

    def _way_to_item(self, state: WarehouseState) -> float:
        """Return how long the worker's way to the item of its task is [m]."""
        item_position = state.item_position[self._task[0]]
        return float(self._ground.ways_to(state, item_position)[self._worker])

    # -- where to ------------------------------------------------------------------------------

    def _worker_velocity(
        self, state: WarehouseState, worker: int, is_idle: NDArray[np.bool_]
    ) -> NDArray[np.float64] | tuple[float, float]:
        item, carries = self._task
        x, y = state.robot_position[worker].tolist()
        dock = int(state.requested_docks[0])
        inwards = self._ground.velocity_inside(x, y, dock) if carries else None
        if inwards is not None:
            return inwards
        if not carries and self._way_to_item(state) < NEAR:
            return self._towards(x, y, state.item_position[item].tolist())
        if state.time >= self._planned_at + REPLAN - 1e-6:
            self._cost = self._costs_among(state, is_idle, carries)
            goal = self._ground.dock_cells(dock)
            if not carries:
                goal = np.zeros_like(goal)
                goal[cell_at(self._cost, *state.item_position[item].tolist())] = True
            self._cost_to_go = cost_to_go(self._cost, goal)
            self._planned_at = state.time
        find_point = self._ground.point_home if carries else lookahead
        return self._towards(x, y, find_point(self._cost, self._cost_to_go, x, y))

    def _costs_among(
        self, state: WarehouseState, robots: NDArray[np.bool_], carries: bool
    ) -> NDArray[np.float64]:
        """Return the cost of each cell among `robots`, for one that carries an item or not."""
        scenario = self._scenario
        is_stored = state.item_status == STORED
        discs = discs_among(
            state.robot_position, robots, scenario.robot_radius,
            state.obstacle_position, scenario.obstacle_radius,
            state.item_position, is_stored & carries, scenario.item_radius,
        )  # fmt: skip
        return self._ground.costs(discs)

    def _step_over(
        self,
        state: WarehouseState,
        worker: int,
        velocity: NDArray[np.float64],
        gripper: NDArray[np.float64],
    ) -> None:
        """Change what the worker does, where racks and items close the way for its load.

        It puts its item down, drives on above what is in the way, and lifts its item again. What it
        stands above then is no obstacle to it. It does not try twice from the same place.
        """
        position = state.robot_position[worker]
        is_stuck = self._task[1] and state.time > self._least_distance_at + STUCK
        has_tried = worker == self._stepping and math.dist(position, self._stepped_from) < 0.1
        if is_stuck and not has_tried:
            self._stepping = worker
            self._stepped_from = position.copy()
            self._stepped_at = state.time
            self._step_velocity = velocity[worker].copy()
            gripper[worker] = -1.0
        elif worker == self._stepping and state.time < self._stepped_at + STEP - 1e-6:
            velocity[worker] = self._step_velocity
            gripper[worker] = 0.0

    # -- how -----------------------------------------------------------------------------------

    def _drift(
        self,
        state: WarehouseState,
        goals: NDArray[np.float64],
        worker: int,
    ) -> NDArray[np.float64]:
        """Return velocities (N, 2), in top speeds, of robots on their way to where they wait."""
        return drift(
            state.robot_position, state.robot_present, goals, self._waits_under, worker,
            self._stride, self._braking_distance,
        )  # fmt: skip

    def _towards(self, x: float, y: float, goal: tuple[float, float]) -> tuple[float, float]:
        """Return the velocity, in top speeds, to come to a stand at the goal."""
        return approach(goal[0] - x, goal[1] - y, self._stride, self._braking_distance)

    def _steer(
        self,
        state: WarehouseState,
        velocity: NDArray[np.float64],
        gripper: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        heading = state.robot_heading
        commands = commands_of(velocity, np.cos(heading), np.sin(heading), gripper)
        turns = ~state.is_holonomic
        if turns.any():
            forward = commands[turns, 0]
            # Numpy's last bit depends on the processor.
            angle = np.array([math.atan2(y, x) for x, y in commands[turns, :2].tolist()])
            full_turn = self._full_turn[state.robot_kind[turns]]
            commands[turns, 2] = np.clip(angle / full_turn, -1.0, 1.0)
            commands[turns, 0] = np.maximum(forward, 0.0)
            commands[turns, 1] = 0.0
        return commands
