"""The world: commands in, observations out. It knows no reward, no policy and no drawing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.errors import CommandError, SetupError
from swarm_logistics_env.observations import N_COLUMNS
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import layout, stepping
from swarm_logistics_env.warehouse.faults import Fault, apply_faults, failed_robots
from swarm_logistics_env.warehouse.grid import Grid
from swarm_logistics_env.warehouse.logistics import LIFTED
from swarm_logistics_env.warehouse.physics import Physics
from swarm_logistics_env.warehouse.state import NOBODY, STORED, WarehouseState

COMMAND_COLUMNS = ("forward", "left", "turn", "gripper")


class Warehouse:
    """One warehouse with its robots, items and faults; arrays in, arrays out.

    Attributes:
        scenario: the conditions of this episode.
        state: what is true now, see `WarehouseState`.
        faults: what befalls whom in this episode.

    Example:
        >>> world = Warehouse(Scenario(n_robots=3))
        >>> observations = world.reset(seed=0)
        >>> observations = world.step(np.zeros((3, 4)))
        >>> world.state.robot_position.shape
        (3, 2)
    """

    def __init__(self, scenario: Scenario | None = None) -> None:
        self.scenario = scenario or Scenario()
        self.state = WarehouseState(self.scenario)
        self.faults: tuple[Fault, ...] = ()
        self._seed: int | None = None

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
        state = WarehouseState(scenario)
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
        self._perceive()
        return self.observe()

    def step(self, commands: ArrayLike) -> NDArray[np.float32]:
        """Move the world by one control period and return what is sensed after it.

        Args:
            commands: (N, 4), columns `COMMAND_COLUMNS`, each in [-1, 1] (beyond is cut): forward
                and left in fractions of the top speed, turn in fractions of the top turn rate,
                gripper > 0.5 hold, < -0.5 open, between as it is. Absent robots' rows are ignored.

        Returns:
            Observations (N, N_COLUMNS) float32, an array of the caller's own.

        Raises:
            CommandError: wrong shape, not numbers, or not finite; the world is as it was.
            SetupError: the world was never reset.
        """
        given = self._checked(commands)
        state, physics = self.state, self._physics
        if not stepping.set_out(
            given, self._constants, state.numbers, state.flags, physics.bodies, physics.velocities
        ):
            able = state.robot_present & state.obeys
            bad = np.argwhere(~np.isfinite(given) & able[:, None])[0]
            raise CommandError(
                f"commands[{bad[0]}, {bad[1]}] = {given[bad[0], bad[1]]}: should be finite"
            )
        physics.advance()
        state.step += 1
        state.time = state.step * self.scenario.control_period
        self._handle_items(given)
        self._deliver()
        if self._fault_times and self._fault_times[0] <= state.time + 5e-7:
            self._apply_faults()
        anchored = self._perceive()
        state.anchoring_seconds += anchored * self.scenario.control_period
        return self.observe()

    def observe(self) -> NDArray[np.float32]:
        """Return what every robot senses now: (N, N_COLUMNS) float32, absent robots zeros."""
        return self._rows

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
        return self.state.step >= self._n_steps

    def _checked(self, commands: ArrayLike) -> NDArray[np.float64]:
        if self._seed is None:
            raise SetupError("step before reset: call reset(seed) first")
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
        self._n_steps = scenario.n_steps
        self._robot_grid = Grid(width, height, cell, n)
        self._item_grid = Grid(width, height, cell, items)
        self._claim = np.full(items, NOBODY)
        self._claim_square = np.zeros(items)
        self._events = np.zeros((2 * n, 3), np.int64)
        self._constants = np.zeros(stepping.N_CONSTANTS)
        self._constants[:] = (
            width,
            height,
            scenario.robot_radius,
            scenario.item_radius,
            scenario.obstacle_radius,
            scenario.ranger_range,
            scenario.radio_range,
            scenario.pickup_range,
            scenario.max_speed,
            scenario.timer_limit,
            scenario.control_period,
            scenario.storage_width,
            scenario.relay == "gossip",
            self._robot_grid.cell,
            self._item_grid.cell,
        )

    def _handle_items(self, commands: NDArray[np.float64]) -> None:
        state, grid, physics = self.state, self._item_grid, self._physics
        n_events = stepping.handle_items(
            commands, state.requested, self._constants, physics.bodies, state.robot_position,
            state.robot_velocity, state.flags, state.links, state.robot_memory,
            state.item_position, state.item_links, self._claim, self._claim_square,
            grid.size, grid.start, grid.members, self._events,
        )  # fmt: skip
        if n_events:
            for kind, robot, item in self._events[:n_events].tolist():
                if kind == LIFTED:
                    physics.lift(robot, item)
                else:
                    physics.put_down(robot, item, *state.item_position[item].tolist())

    def _deliver(self) -> None:
        state = self.state
        while (item := state.requested) != NOBODY and state.item_carrier[item] != NOBODY:
            robot = stepping.deliver_requested(
                item, state.flags, state.links, state.robot_memory, state.item_links
            )
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
            self._order = layout.request_order(self.scenario, self._seed or 0, cycle)
        return int(self._order[place])

    def _restock(self, item: int) -> None:
        state = self.state
        free = state.item_position[state.item_status == STORED]
        taken = np.vstack([free, state.robot_position[state.robot_present]])
        place = layout.place_restocked(
            self.scenario, self._seed or 0, state.delivered, taken, state.obstacle_position
        )
        state.item_status[item] = STORED
        state.item_position[item] = place
        self._physics.place(item, float(place[0]), float(place[1]))

    def _apply_faults(self) -> None:
        state = self.state
        self._fault_times = [time for time in self._fault_times if time > state.time + 5e-7]
        gone = apply_faults(state, self.scenario, self.faults, self._struck)
        for robot in np.flatnonzero(gone & state.robot_present).tolist():
            self._remove(robot)

    def _remove(self, robot: int) -> None:
        state = self.state
        item = int(state.robot_item[robot])
        if item != NOBODY:
            state.item_status[item] = STORED
            state.item_carrier[item] = NOBODY
            self._physics.put_down(robot, item, *state.item_position[item].tolist())
        self._physics.remove(robot)
        state.robot_present[robot] = False
        state.robot_in_delivery[robot] = False
        state.robot_item[robot] = NOBODY
        state.robot_memory[robot] = NOBODY
        for zeroed in (state.robot_position, state.robot_velocity, state.robot_heading):
            zeroed[robot] = 0.0

    def _perceive(self) -> int:
        state, robots, items = self.state, self._robot_grid, self._item_grid
        # New memory every time: what was handed out stays as it was.
        self._rows = np.empty((len(state.robot_position), N_COLUMNS), np.float32)
        return stepping.perceive(
            state.step, state.requested, self._constants, state.robot_position,
            state.robot_velocity, state.numbers, state.flags, state.links, state.robot_memory,
            state.item_position, state.item_links, state.obstacle_position,
            robots.size, robots.start, robots.members, items.size, items.start, items.members,
            self._rows,
        )  # fmt: skip
