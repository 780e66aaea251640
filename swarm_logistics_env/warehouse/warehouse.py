"""The world: commands in, observations out. It knows no reward, no policy and no drawing."""

from __future__ import annotations

import math
import pickle
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.errors import CommandError, ScenarioError, SetupError
from swarm_logistics_env.observations import n_columns
from swarm_logistics_env.scenario import CHANGES_DURING_RUN, Scenario
from swarm_logistics_env.streams import row_keys
from swarm_logistics_env.warehouse import layout, stepping
from swarm_logistics_env.warehouse.faults import Fault, apply_faults, failed_robots
from swarm_logistics_env.warehouse.grid import Grid
from swarm_logistics_env.warehouse.physics import Physics
from swarm_logistics_env.warehouse.state import DELIVERED, NOBODY, STORED, WarehouseState
from swarm_logistics_env.warehouse.tables import Tables

COMMAND_COLUMNS = ("forward", "left", "turn", "gripper")
# How many steps of commands are kept for a pickle to replay, and how many numbers at most.
_LONGEST_LOG, _SHORTEST_LOG, _LOGGED_NUMBERS = 500, 20, 4_000_000
_NOT_KEPT = ("_physics", "_tables", "_memory", "_log")


class Warehouse:
    """One warehouse with its robots, items and faults; arrays in, arrays out.

    It can be pickled and copied at any moment; the copy goes on exactly as the original does.

    Attributes:
        scenario: the conditions of this episode.
        state: what is true now, see `WarehouseState`.
        faults: what befalls whom in this episode.
        n_removed: how many robots were taken out of the arena so far.

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
        self._struck: list[NDArray[np.int64]] = []
        self.n_removed = 0
        self._n_steps = self.scenario.n_steps
        self._seed: int | None = None
        self._log: list[NDArray[np.float64]] = []

    def reset(
        self,
        seed: int = 0,
        faults: Sequence[Fault] = (),
        scenario: Scenario | None = None,
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first observations (N, D).

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
        self.faults, self._struck, self.n_removed = tuple(faults), struck, 0
        self._order = layout.request_order(scenario, seed)
        state.requested, self._asked = int(self._order[0]), 0
        self._sensor_keys = row_keys(seed, "sensors", scenario.n_robots)
        self._make_room_to_work(scenario)
        self._take_constants(scenario)
        self._build_physics()
        self._apply_faults()
        self._rows = self._blank_rows()
        self._perceive()
        self._log = []
        self._remember()
        return self.observe()

    def step(self, commands: ArrayLike) -> NDArray[np.float32]:
        """Move the world by one control period and return what is sensed after it.

        Args:
            commands: (N, 4), columns `COMMAND_COLUMNS`, each in [-1, 1] (beyond is cut): forward
                and left in fractions of the top speed, turn in fractions of the top turn rate,
                gripper > 0.5 hold, < -0.5 open, between as it is. Absent robots' rows are ignored.
                With `message_size` M, (N, 4 + M): the message to broadcast, zeros if left out.

        Returns:
            Observations (N, D) float32, an array of the caller's own.

        Raises:
            CommandError: wrong shape, not numbers, or not finite; the world is as it was.
            SetupError: the world was never reset.
        """
        given, rows = self._checked(commands), self._blank_rows()
        state = self.state
        outcome = stepping.step(
            self._tables.addresses, given, state.step + 1, state.requested,
            self._is_fault_due(self._next_time()), rows,
        )  # fmt: skip
        return self.arrive(given, rows, outcome)

    def order(self) -> tuple[int, int, int, int, int, bool]:
        """Return what `stepping.step` has to know of the next step, for `Crew`.

        The address and length of the tables, N, the step's number, the requested item, and
        whether to pause before perceiving.

        Raises:
            SetupError: the world was never reset.
        """
        if self._seed is None:
            raise _not_begun("step")
        state, tables = self.state, self._tables
        return (
            tables.where, len(tables.addresses), len(state.robot_position), state.step + 1,
            state.requested, self._is_fault_due(self._next_time()),
        )  # fmt: skip

    def arrive(
        self, commands: NDArray[np.float64], rows: NDArray[np.float32], outcome: int
    ) -> NDArray[np.float32]:
        """Take over what `stepping.step` made of `commands` and returned; returns `rows`.

        Raises:
            CommandError: a robot's command is not finite; the world is as it was.
        """
        state, scenario = self.state, self.scenario
        if outcome == stepping.NOT_FINITE:
            obeying = state.robot_present & state.obeys
            bad = np.argwhere(~np.isfinite(commands) & obeying[:, None])[0]
            raise CommandError(
                f"commands[{bad[0]}, {bad[1]}] = {commands[bad[0], bad[1]]}: should be finite"
            )
        self._log.append(commands)
        self._rows, state.step, state.time = rows, state.step + 1, self._next_time()
        anchored = outcome
        if outcome == stepping.TO_BE_PERCEIVED:
            self._deliver()
            if self._is_fault_due(state.time):
                self._apply_faults()
            anchored = self._perceive()
        state.anchoring_seconds += anchored * scenario.control_period
        if len(self._log) >= self._longest_log:
            self._remember()
        return rows

    def change(self, **fields: Any) -> None:
        """Change conditions while the robots are at work, from the next step on.

        Args:
            **fields: fields of the scenario, of those in `CHANGES_DURING_RUN`.

        Raises:
            ScenarioError: a field is unknown, cannot change during a run, or its value cannot be.
            SetupError: the world was never reset.
        """
        if self._seed is None:
            raise _not_begun("change")
        for name in fields:
            if name not in CHANGES_DURING_RUN and name in Scenario.model_fields:
                raise ScenarioError(
                    f"Scenario.{name} cannot change during a run: should be set at a reset; "
                    f"these can change: {', '.join(sorted(CHANGES_DURING_RUN))}"
                )
        self.scenario = self.scenario.replace(**fields)
        self._take_constants(self.scenario)
        self._apply_faults()
        self._remember()

    def set_faults(self, faults: Sequence[Fault]) -> None:
        """Let these faults, instead of those before, hold from now on; none of them repairs all.

        Raises:
            FaultError: a fault names robots that are not there.
            SetupError: the world was never reset.
        """
        if self._seed is None:
            raise _not_begun("set_faults")
        struck = [failed_robots(fault, self._seed, self.state.n_robots) for fault in faults]
        self.faults, self._struck = tuple(faults), struck
        self._apply_faults()
        self._remember()

    def observe(self) -> NDArray[np.float32]:
        """Return what every robot senses now: (N, D) float32, absent robots zeros.

        Raises:
            SetupError: the world was never reset.
        """
        if self._seed is None:
            raise _not_begun("observe")
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
            raise _not_begun("step")
        if isinstance(commands, np.ndarray) and commands.dtype == np.float64:
            plain_numbers: NDArray[np.float64] = commands.copy()
            if plain_numbers.shape == self._command_shape:
                return plain_numbers
        try:
            if np.iscomplexobj(commands):
                raise CommandError("commands should be numbers: real ones, not complex")
            given = np.array(commands, dtype=np.float64, order="C")
        except CommandError:
            raise
        except (TypeError, ValueError) as error:
            raise CommandError(f"commands should be an array of numbers: {error}") from None
        if given.shape == self._command_shape:
            return given
        plain = (self.state.n_robots, len(COMMAND_COLUMNS))
        full = (plain[0], plain[1] + self.scenario.message_size)
        if given.shape not in (plain, full):
            raise CommandError(f"commands of shape {given.shape}: should be {full}")
        return given

    def _make_room_to_work(self, scenario: Scenario) -> None:
        n, items = scenario.n_robots, scenario.n_items
        width, height = scenario.warehouse_width, scenario.warehouse_height
        cell = (scenario.ranger_range + scenario.robot_radius) / 2
        self._robot_grid = Grid(width, height, cell, n)
        self._item_grid = Grid(width, height, cell, items)
        self._claim = np.full(items, NOBODY)
        self._claim_square = np.zeros(items)
        self._events = np.zeros((2 * n, 3), np.int64)
        self._constants = np.zeros(stepping.N_CONSTANTS)
        self._command_shape = (n, len(COMMAND_COLUMNS) + scenario.message_size)
        size = math.prod(self._command_shape)
        self._longest_log = max(min(_LOGGED_NUMBERS // size, _LONGEST_LOG), _SHORTEST_LOG)

    def _take_constants(self, scenario: Scenario) -> None:
        self._n_steps = scenario.n_steps
        self._n_columns = n_columns(scenario)
        self._constants[:] = stepping.constants_of(
            scenario, self._robot_grid.cell, self._item_grid.cell
        )

    def _remember(self) -> None:
        """Note everything a pickle needs, and rebuild the bodies from it as unpickling will.

        What the engine remembers of contacts cannot be saved, so a pickle holds the world at the
        last such moment and the commands since, which unpickling replays.
        """
        if self.state.step > 0:
            self._build_physics()
        self._log = []
        kept = {name: value for name, value in self.__dict__.items() if name not in _NOT_KEPT}
        self._memory = pickle.dumps(kept)

    def __getstate__(self) -> dict[str, Any]:
        if self._seed is None:
            return self.__dict__
        return {"_memory": self._memory, "_log": self._log}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        if "_memory" not in saved:
            self.__dict__.update(saved)
            return
        self.__dict__.update(pickle.loads(saved["_memory"]))
        self._memory, self._log = saved["_memory"], []
        self._build_physics()
        for commands in saved["_log"]:
            self.step(commands)

    def _deliver(self) -> None:
        state = self.state
        while (item := state.requested) != NOBODY:
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
        status = self.state.item_status
        if (status == DELIVERED).all():
            return NOBODY
        # Past what left for good before `restock` was switched on.
        while True:
            self._asked += 1
            cycle, place = divmod(self._asked, self.scenario.n_items)
            if place == 0:
                self._order = layout.request_order(self.scenario, self._seed or 0, cycle)
            item = int(self._order[place])
            if status[item] != DELIVERED:
                return item

    def _restock(self, item: int) -> None:
        state = self.state
        free = state.item_position[state.item_status == STORED]
        taken = np.vstack([free, state.robot_position[state.robot_present]])
        place = layout.place_restocked(
            self.scenario, self._seed or 0, state.delivered, taken, state.obstacle_position
        )
        state.item_status[item], state.item_covered[item] = STORED, 1
        state.item_position[item] = place
        self._physics.place(item, float(place[0]), float(place[1]))

    def _apply_faults(self) -> None:
        state = self.state
        times = {time for fault in self.faults for time in fault.changes()}
        self._fault_times = sorted(time for time in times if time > state.time + 5e-7)
        gone = apply_faults(state, self.scenario, self.faults, self._struck)
        for robot in np.flatnonzero(gone & state.robot_present).tolist():
            self._remove(robot)

    def _remove(self, robot: int) -> None:
        state = self.state
        item = int(state.robot_item[robot])
        if item != NOBODY:
            state.item_status[item], state.item_covered[item] = STORED, 1
            state.item_carrier[item] = NOBODY
            self._physics.put_down(robot, item, *state.item_position[item].tolist())
        self._physics.remove(robot)
        self.n_removed += 1
        state.robot_present[robot] = False
        state.robot_in_delivery[robot] = False
        state.robot_item[robot] = NOBODY
        state.robot_memory[robot] = NOBODY
        for zeroed in (state.robot_position, state.robot_velocity, state.robot_heading):
            zeroed[robot] = 0.0

    def _next_time(self) -> float:
        return (self.state.step + 1) * self.scenario.control_period

    def _is_fault_due(self, time: float) -> bool:
        """Return whether a fault begins or ends until then [s]."""
        return bool(self._fault_times) and self._fault_times[0] <= time + 5e-7

    def _perceive(self) -> int:
        state = self.state
        return stepping.perceive(self._tables.addresses, state.step, state.requested, self._rows)

    def _blank_rows(self) -> NDArray[np.float32]:
        # New memory every time: what was handed out stays as it was.
        return np.empty((len(self.state.robot_position), self._n_columns), np.float32)

    def _build_physics(self) -> None:
        self._physics = Physics(self.scenario, self.state)
        state, physics = self.state, self._physics
        robots, items = self._robot_grid, self._item_grid
        # In the order of their places in `stepping`.
        self._tables = Tables([
            physics.engine, physics.bodies, physics.velocities, self._claim, self._claim_square,
            self._events, self._constants, state.robot_position, state.robot_velocity,
            state.numbers, state.flags, state.links, state.robot_memory, state.item_position,
            state.item_links, state.obstacle_position, robots.size, robots.start, robots.members,
            robots.places, items.size, items.start, items.members, items.places,
            self._sensor_keys, state.robot_message,
        ])  # fmt: skip


def _not_begun(asked: str) -> SetupError:
    return SetupError(f"{asked} before reset: call reset(seed) first")
