"""The world: commands in, observations out. It knows no reward, no policy and no drawing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.errors import CommandError, SetupError
from swarm_logistics_env.observations import N_COLUMNS
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import layout, logistics
from swarm_logistics_env.warehouse.driving import drive
from swarm_logistics_env.warehouse.faults import FAILURE_MODES, Fault, failed_robots
from swarm_logistics_env.warehouse.grid import Grid, fill
from swarm_logistics_env.warehouse.physics import Physics
from swarm_logistics_env.warehouse.sensing import sense
from swarm_logistics_env.warehouse.state import NOBODY, STORED, WarehouseState, empty_state

COMMAND_COLUMNS = ("forward", "left", "turn", "gripper")


class Warehouse:
    """One warehouse with its robots, items and faults; arrays in, arrays out.

    Example:
        >>> world = Warehouse(Scenario(n_robots=3))
        >>> observations = world.reset(seed=0)
        >>> observations = world.step(np.zeros((3, 4)))
        >>> world.state.robot_position.shape
        (3, 2)
    """

    state: WarehouseState

    def __init__(self, scenario: Scenario | None = None) -> None:
        self.scenario = scenario or Scenario()
        self.state = empty_state(self.scenario)

    def reset(
        self,
        seed: int = 0,
        faults: Sequence[Fault] = (),
        scenario: Scenario | None = None,
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first observations (N, N_COLUMNS).

        Args:
            seed: alone decides layout, requests, start poses and which robots fail.
            faults: what will befall whom and when; several may befall one robot.
            scenario: from now on, instead of the one before.

        Raises:
            FaultError: a fault names robots that are not there.
            ScenarioError: items or robots found no room.
        """
        scenario = scenario or self.scenario
        struck = [failed_robots(fault, seed, scenario.n_robots) for fault in faults]
        state = empty_state(scenario)
        state.obstacle_position = layout.place_obstacles(scenario, seed)
        state.item_position = layout.place_items(scenario, seed, state.obstacle_position)
        state.robot_position, state.robot_heading = layout.place_robots(
            scenario, seed, state.obstacle_position
        )
        self.scenario, self.state, self._seed = scenario, state, seed
        self.faults, self._struck = tuple(faults), struck
        self._fault_times = sorted({time for fault in faults for time in fault.changes()})
        self._order = layout.request_order(scenario, seed)
        state.requested = int(self._order[0])
        self._physics = Physics(
            scenario, state.robot_position, state.item_position, state.obstacle_position
        )
        self._make_room_to_work(scenario)
        self._apply_faults()
        self._run_timers()
        self._sense()
        return self.observe()

    def step(self, commands: ArrayLike) -> NDArray[np.float32]:
        """Move the world by one control period and return what is sensed after it.

        Args:
            commands: (N, 4), columns `COMMAND_COLUMNS`, each in [-1, 1] (beyond is cut): forward
                and left in fractions of the top speed, turn in fractions of the top turn rate,
                gripper > 0.5 hold, < -0.5 open, between as it is. Absent robots' rows are ignored.

        Returns:
            Observations (N, N_COLUMNS) float32, a fresh array.

        Raises:
            CommandError: wrong shape, not numbers, or not finite; the world is as it was.
        """
        if not hasattr(self, "_physics"):
            raise SetupError("step before reset: call reset(seed) first")
        given = self._checked(commands)
        state, scenario = self.state, self.scenario
        np.logical_and(state.robot_present, state.obeys, out=self._able)
        if not drive(
            given, self._able, state.max_speed, state.max_turn_rate,
            scenario.control_period, state.robot_heading, self._physics.wanted_velocity,
        ):  # fmt: skip
            bad = np.argwhere(~np.isfinite(given))[0]
            raise CommandError(
                f"commands[{bad[0]}, {bad[1]}] = {given[bad[0], bad[1]]}: should be finite"
            )
        self._physics.advance()
        self._read_physics()
        state.step += 1
        state.time = state.step * scenario.control_period
        self._handle_items(given[:, 3])
        if self._fault_times and self._fault_times[0] <= state.time + 5e-7:
            self._apply_faults()
        self._run_timers()
        self._sense()
        return self.observe()

    def observe(self) -> NDArray[np.float32]:
        """Return what every robot senses now: (N, N_COLUMNS) float32, absent robots zeros."""
        return self._rows.copy()

    @property
    def struck_robots(self) -> tuple[int, ...]:
        """The robots that any fault of this episode names, ascending."""
        return tuple(sorted({int(robot) for robots in self._struck for robot in robots}))

    @property
    def all_delivered(self) -> bool:
        """Whether nothing is left to ask for; never with `restock`."""
        return self.state.requested == NOBODY

    @property
    def is_over_time(self) -> bool:
        """Whether the scenario's duration has passed."""
        return self.state.step >= self.scenario.n_steps

    def _checked(self, commands: ArrayLike) -> NDArray[np.float64]:
        try:
            given = np.ascontiguousarray(commands, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise CommandError(f"commands should be an array of numbers: {error}") from None
        expected = (self.state.n_robots, len(COMMAND_COLUMNS))
        if given.shape != expected:
            raise CommandError(f"commands of shape {given.shape}: should be {expected}")
        return given

    def _make_room_to_work(self, scenario: Scenario) -> None:
        n, items = scenario.n_robots, scenario.n_items
        width, height = scenario.warehouse_width, scenario.warehouse_height
        cell = (scenario.ranger_range + scenario.robot_radius) / 2
        self._robot_grid = Grid(width, height, cell, n)
        self._item_grid = Grid(width, height, cell, items)
        self._able = np.zeros(n, np.bool_)
        self._free = np.zeros(items, np.bool_)
        self._claim = np.full(items, NOBODY)
        self._claim_square = np.zeros(items)
        self._events = np.zeros((2 * n, 3), np.int64)
        self._last_in_delivery = np.full(n, NOBODY)
        self._heard = np.full(n, np.nan)
        self._rows = np.zeros((n, N_COLUMNS), np.float32)

    def _read_physics(self) -> None:
        state = self.state
        present = state.robot_present[:, None]
        np.multiply(self._physics.position, present, out=state.robot_position)
        np.multiply(self._physics.velocity, present, out=state.robot_velocity)

    def _handle_items(self, gripper: NDArray[np.float64]) -> None:
        state, grid = self.state, self._item_grid
        logistics.carry_along(
            state.robot_position, state.robot_present,
            self.scenario.storage_width, state.robot_item, state.item_position,
            state.robot_in_delivery,
        )  # fmt: skip
        n_events = logistics.open_grippers(
            gripper, self._able, state.robot_in_delivery, state.requested, state.robot_item,
            state.robot_memory, state.item_status, state.item_carrier, self._events,
        )  # fmt: skip
        np.logical_and(self._able, state.lifts, out=self._able)
        n_events = logistics.close_grippers(
            gripper, self._able, state.robot_position, state.requested,
            self.scenario.pickup_range, state.robot_item, state.robot_memory,
            state.item_position, state.item_status, state.item_carrier,
            self._claim, self._claim_square,
            grid.cell, grid.size, grid.start, grid.members, self._events, n_events,
        )  # fmt: skip
        for kind, robot, item in self._events[:n_events].tolist():
            if kind == logistics.LIFTED:
                self._physics.lift(robot, item)
            else:
                self._physics.put_down(robot, item, *state.item_position[item].tolist())
        self._deliver()

    def _deliver(self) -> None:
        state = self.state
        while True:
            item = state.requested
            robot = logistics.deliver(
                item, state.robot_in_delivery, state.delivers, state.robot_item,
                state.robot_memory, state.item_status, state.item_carrier,
            )  # fmt: skip
            if robot == NOBODY:
                return
            self._physics.take_away(robot)
            state.delivery_times.append(state.time)
            state.delivered_by.append(robot)
            if self.scenario.restock:
                self._restock(item)
            state.requested = self._next_request()

    def _next_request(self) -> int:
        cycle, place = divmod(self.state.delivered, self.scenario.n_items)
        if place == 0:
            if not self.scenario.restock:
                return NOBODY
            self._order = layout.request_order(self.scenario, self._seed, cycle)
        return int(self._order[place])

    def _restock(self, item: int) -> None:
        state = self.state
        taken = np.vstack(
            [
                state.item_position[state.item_status == STORED],
                state.robot_position[state.robot_present],
            ]
        )
        place = layout.place_restocked(
            self.scenario, self._seed, state.delivered, taken, state.obstacle_position
        )
        state.item_status[item] = STORED
        state.item_position[item] = place
        self._physics.place(item, float(place[0]), float(place[1]))

    def _apply_faults(self) -> None:
        """Give every robot what the faults of this moment leave it."""
        state, scenario = self.state, self.scenario
        self._fault_times = [time for time in self._fault_times if time > state.time + 5e-7]
        state.max_speed[:] = scenario.max_speed
        state.max_turn_rate[:] = scenario.max_turn_rate
        state.ranger_range[:] = scenario.ranger_range
        state.view_range[:] = scenario.view_range
        for able in (
            state.lifts, state.delivers, state.sends, state.hears, state.honest, state.obeys
        ):  # fmt: skip
            able[:] = True
        modes: list[tuple[str, ...]] = [()] * state.n_robots
        for fault, robots in zip(self.faults, self._struck, strict=True):
            if not fault.is_active(state.time):
                continue
            mode = FAILURE_MODES[fault.mode]
            left = {"speed": mode.speed, "view": mode.view}
            if mode.factor is not None and fault.factor is not None:
                left[mode.factor] = fault.factor
            state.max_speed[robots] *= left["speed"]
            state.max_turn_rate[robots] *= left["speed"]
            state.view_range[robots] *= left["view"]
            state.ranger_range[robots] *= mode.rangers
            state.lifts[robots] &= mode.lifts
            state.delivers[robots] &= mode.delivers
            state.sends[robots] &= mode.sends
            state.hears[robots] &= mode.hears
            state.honest[robots] &= mode.honest
            state.obeys[robots] &= mode.obeys
            for robot in robots.tolist():
                modes[robot] = (*modes[robot], fault.mode)
                if not mode.present:
                    self._remove(robot)
        state.failure_modes = tuple(modes)
        state.failed = np.array([bool(names) for names in modes])

    def _remove(self, robot: int) -> None:
        state = self.state
        if not state.robot_present[robot]:
            return
        item = int(state.robot_item[robot])
        if item != NOBODY:
            state.item_status[item] = STORED
            state.item_carrier[item] = NOBODY
            self._physics.put_down(robot, item, *state.item_position[item].tolist())
        self._physics.remove(robot)
        state.robot_present[robot] = False
        state.robot_item[robot] = NOBODY
        state.robot_memory[robot] = NOBODY
        state.robot_in_delivery[robot] = False
        for zeroed in (state.robot_position, state.robot_velocity, state.robot_heading):
            zeroed[robot] = 0.0

    def _run_timers(self) -> None:
        state, scenario = self.state, self.scenario
        logistics.run_timers(
            state.step, scenario.control_period, scenario.timer_limit,
            scenario.relay == "gossip", state.robot_in_delivery, state.robot_present,
            state.honest, self._heard, self._last_in_delivery, state.robot_timer,
            state.robot_told,
        )  # fmt: skip

    def _sense(self) -> None:
        state, scenario = self.state, self.scenario
        robots, items = self._robot_grid, self._item_grid
        np.equal(state.item_status, STORED, out=self._free)
        fill(
            state.robot_position, state.robot_present,
            robots.cell, robots.size, robots.start, robots.members,
        )  # fmt: skip
        fill(state.item_position, self._free, items.cell, items.size, items.start, items.members)
        anchored = sense(
            scenario.warehouse_width, scenario.warehouse_height, scenario.robot_radius,
            scenario.item_radius, scenario.obstacle_radius, scenario.radio_range,
            scenario.max_speed, scenario.timer_limit, state.requested,
            state.robot_present, state.robot_position, state.robot_velocity,
            state.robot_heading, state.robot_item, state.robot_memory, state.robot_timer,
            state.robot_told, state.robot_in_delivery, state.item_position,
            state.obstacle_position, state.ranger_range, state.view_range, state.sends,
            state.hears, state.failed,
            robots.cell, robots.size, robots.start, robots.members,
            items.cell, items.size, items.start, items.members,
            scenario.ranger_range, state.robot_contact, self._heard, self._rows,
        )  # fmt: skip
        if state.step > 0:
            state.anchoring_seconds += anchored * scenario.control_period
