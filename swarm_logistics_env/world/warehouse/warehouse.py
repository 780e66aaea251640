"""The world: commands in, observations out. It knows no reward, no policy and no drawing."""

from __future__ import annotations

import math
import pickle
import threading
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.compiler.packing import blank, packed
from swarm_logistics_env.core.errors import ScenarioError, SetupError
from swarm_logistics_env.world.bodies import load_bodies
from swarm_logistics_env.world.floor.ways import FloorMap
from swarm_logistics_env.world.observations import n_columns
from swarm_logistics_env.world.scenario import CHANGES_DURING_RUN, Scenario

from . import stepping
from .abilities import apply_faults
from .absence import change_presence
from .commands import MESSAGE, as_array, not_finite
from .faults import Fault, FaultLike, Occurrence, checked_faults, step_of_change
from .floor_cells import floor_map, floor_of
from .grid import blank_grid
from .layout import lay_out
from .moved_elsewhere import MovedElsewhere, check_returns
from .one_thread import in_one_thread, used_elsewhere
from .physics import N_CORNERS, Physics
from .state import NOBODY, WarehouseState
from .structs import Claims, Commands, Nearby, Parameters, Sensed, StepResult, World, lengths_of

# How many steps of commands are kept for a pickle to replay, and how many numbers at most.
_LONGEST_LOG = 500
_SHORTEST_LOG = 20
_LOGGED_NUMBERS = 4_000_000
_NOT_PICKLED = ("_physics", "_world", "_words", "_address", "_memory", "_elsewhere", "lock")


class Warehouse:
    """One warehouse with its robots, items and faults; arrays in, arrays out.

    It can be pickled and copied at any moment; the copy goes on exactly as the original does.
    Worlds may step in threads of their own. While one thread uses a world, another that does gets
    a SetupError.

    Attributes:
        scenario: the conditions of this episode.
        state: what is true now, see `WarehouseState`.
        is_eventful: whether something happened that observations do not tell (`stepping.step`).
        lock: held by the thread that uses the world.

    Example:
        >>> world = Warehouse(Scenario(n_robots=3))
        >>> observations = world.reset(seed=0)
        >>> observations = world.step(np.zeros((3, 4)))
        >>> world.state.robot_position.shape
        (3, 2)
    """

    def __init__(self, scenario: Scenario | None = None) -> None:
        self.lock = threading.RLock()
        self.scenario = _scenario(scenario, Scenario.preset("paper"))
        self.state = WarehouseState(self.scenario)
        self._occurrences: list[Occurrence] = []
        self.is_eventful = False
        self._seed: int | None = None
        self._elsewhere: MovedElsewhere | None = None  # the package's own engine moves robots

    @in_one_thread
    def reset(
        self, seed: int = 0, faults: Sequence[FaultLike] = (), scenario: Scenario | None = None
    ) -> Sensed:
        """Begin an episode and return the first observations (N, D).

        Args:
            seed: alone decides layout, requests, start poses and which robots fail.
            faults: what will affect whom and when, each a `Fault`, a text, as "FM1:2@200", or a
                dict of its arguments; several may affect one robot.
            scenario: from now on, instead of the one before.

        Raises:
            FaultError: `faults` are none, or a fault names robots that are not there.
            ScenarioError: it is none, or items or robots found no room.
            BodiesError: there are no bodies as the scenario's, or they cannot be so.
        """
        scenario = _scenario(scenario, self.scenario)
        bodies = load_bodies(scenario.bodies)
        occurrences = _occurrences(faults, seed, scenario)
        state = WarehouseState(scenario)
        lay_out(state, scenario, seed)
        self.scenario = scenario
        self.state = state
        self._seed = seed
        self._occurrences = occurrences
        self._make_room_to_work()
        self._robot_places = state.robot_position.copy()
        self._build()
        self._elsewhere = None
        if bodies is not None:
            self._elsewhere = MovedElsewhere(bodies, scenario, seed, self._world)
        stepping.begin(self._address)
        self._apply_faults()
        self._rows = np.empty((state.n_robots, n_columns(scenario)), np.float32)
        stepping.perceive(self._address, self._rows)
        state.progress.anchoring_seconds[0] = 0.0
        self._save()
        return self._rows

    def step(self, commands: ArrayLike) -> Sensed:
        """Move the world by one control period and return what is sensed after it.

        Args:
            commands: (N, 4), each in [-1, 1] (beyond is cut): forward and left in fractions of the
                top speed, turn in fractions of the top turn rate, gripper > 0.5 hold, < -0.5 open,
                between as it is. Absent robots' rows are ignored. With `message_size` M,
                (N, 4 + M): the message to broadcast, zeros if left out.

        Returns:
            Observations (N, D) float32, a new array, which `observe` returns too: change a copy.

        Raises:
            CommandError: wrong shape, not numbers, or not finite; the world is as it was.
            SetupError: the world was never reset, or another thread is using it.
            BodiesError: the bodies' poses cannot be.
        """
        lock = self.lock
        if not lock.acquire(False):  # as `in_one_thread`, within a tenth of a microsecond
            raise used_elsewhere()
        try:
            self._seed_of_episode("step")
            self._world.commands.now[...] = as_array(commands, self._command_shape)
            rows = np.empty_like(self._rows)  # what was handed out stays as it was
            if self._elsewhere is None:
                is_eventful = stepping.step(self._address, rows)
            else:
                is_eventful = self._elsewhere.step(self._address, self._world, self.state, rows)
            self.take(rows, is_eventful)
            return rows
        finally:
            lock.release()

    def take(self, rows: Sensed, is_eventful: bool) -> None:
        """Take over a step that compiled code took.

        Args:
            rows: (N, D) what was sensed.
            is_eventful: whether there is more to tell, as `stepping.step` returned.

        Raises:
            CommandError: a robot's command is not finite; the world is as it was.
            ScenarioError: an item that came back to the storage found no room.
        """
        self.is_eventful = is_eventful
        if not is_eventful:
            self._rows = rows
            return
        outcome = self._world.outcome
        state = self.state
        if outcome.refused[0] != NOBODY:
            raise not_finite(self._world.commands.now, outcome.refused.item())
        self._rows = rows
        state.note_deliveries(self._world.claims, outcome.n_delivered.item())
        if outcome.is_paused[0]:
            self._apply_faults()
            stepping.perceive(self._address, rows)
        is_room = outcome.is_room.item()
        if len(self._logged()) == self._longest_log or not is_room:  # a replay would raise, too
            self._remember()
        if not is_room:
            raise ScenarioError(
                f"no room for items that come back (delivery {state.delivered}): should be fewer "
                "items or robots, or a larger warehouse"
            )

    @in_one_thread
    def change(self, **fields: Any) -> None:
        """Change conditions while the robots are at work, from the next step on.

        Args:
            **fields: fields of the scenario, of those in `CHANGES_DURING_RUN`.

        Raises:
            ScenarioError: a field is unknown, cannot change during a run, or its value cannot be.
            SetupError: the world was never reset.
        """
        self._seed_of_episode("change")
        for name in (fields.keys() & Scenario.model_fields) - CHANGES_DURING_RUN:
            raise ScenarioError(
                f"Scenario.{name} cannot change during a run: should be set at a reset; these can "
                f"change: {', '.join(sorted(CHANGES_DURING_RUN))}"
            )
        self.scenario = self.scenario.replace(**fields)
        self._apply_faults()
        self._robot_places = self.state.robot_position.copy()
        self._build()
        self._save()

    @in_one_thread
    def set_faults(self, faults: Sequence[FaultLike]) -> None:
        """Let these faults, instead of those before, hold from now on; none of them repairs all.

        Raises:
            FaultError: a fault names robots that are not there.
            BodiesError: a robot that is away cannot come back to the bodies.
            SetupError: the world was never reset.
        """
        seed = self._seed_of_episode("set_faults")
        self._occurrences = _occurrences(faults, seed, self.scenario)
        self._apply_faults()
        self._remember()

    @in_one_thread
    def observe(self) -> Sensed:
        """Return what every robot senses now: (N, D) float32, absent robots zeros.

        Raises:
            SetupError: the world was never reset.
        """
        self._seed_of_episode("observe")
        return self._rows

    @property
    def floor(self) -> FloorMap:
        """What is where on the floor: `is_free(points)`, and the way home."""
        return floor_map(self.scenario)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What affects whom in this episode."""
        return tuple(occurrence.fault for occurrence in self._occurrences)

    @property
    def numbered_faults(self) -> tuple[Fault, ...]:
        """`faults`, each with the numbers of its robots: one by role stays as it is until it holds.

        Given to `set_faults`, they change nothing.
        """
        return tuple(occurrence.numbered for occurrence in self._occurrences)

    @property
    def n_removed(self) -> int:
        """How many robots were taken out of the arena for good so far."""
        return int(np.count_nonzero(~self.state.in_episode))

    @property
    def struck_robots(self) -> tuple[int, ...]:
        """The robots that any fault of this episode names, ascending."""
        named = (occurrence.robots.tolist() for occurrence in self._occurrences)
        return tuple(sorted(set[int]().union(*named)))

    @property
    def address(self) -> int:
        """The address at which compiled code finds the world, until a step or a change moves it.

        Raises:
            SetupError: the world was never reset.
        """
        self._seed_of_episode("step")
        return self._address

    @property
    def all_delivered(self) -> bool:
        """Whether nothing is asked for, and nothing will be."""
        return bool(self.state.orders.is_served[0])

    @property
    def is_over_time(self) -> bool:
        """Whether the scenario's duration has passed."""
        return self.state.step >= self.scenario.n_steps

    def _seed_of_episode(self, caller: str) -> int:
        """Return the seed of the episode; raise SetupError if there is none."""
        if self._seed is None:
            raise SetupError(f"{caller} before reset: call reset(seed) first")
        return self._seed

    def _make_room_to_work(self) -> None:
        scenario = self.scenario
        n, width, height = scenario.n_robots, scenario.warehouse_width, scenario.warehouse_height
        sees = max(scenario.ranger_reach + scenario.robot_radius, scenario.view_reach)
        hears = max(sees, scenario.radio_range)
        # Cells have half the side of the square that robots search: few rows, few of them in vain.
        self._robot_grid = blank_grid(width, height, hears / 2, n)
        self._item_grid = blank_grid(width, height, sees / 2, scenario.n_items)
        self._command_shape = (n, MESSAGE + scenario.message_size)
        most_steps = _LOGGED_NUMBERS // math.prod(self._command_shape)
        self._longest_log = max(min(most_steps, _LONGEST_LOG), _SHORTEST_LOG)

    def _build(self) -> None:
        """Make the bodies, and tell compiled code where everything is."""
        scenario, state = self.scenario, self.state
        n, n_columns = self._command_shape
        state.take_conditions(scenario)
        lengths = lengths_of(scenario)
        floor = floor_of(scenario)
        self._physics = Physics(scenario, self._robot_places, len(floor.corners) // N_CORNERS)
        self._world = World(
            parameters=Parameters(*(getattr(scenario, name) for name in Parameters._fields)),
            commands=Commands(
                now=np.zeros(self._command_shape),
                log=np.empty((self._longest_log * n, n_columns)),
                n_logged=np.zeros(1, np.int64),
            ),
            robots=state.robots,
            able=state.able,
            batteries=state.batteries,
            items=state.items,
            obstacles=state.obstacle_position,
            floor=floor,
            progress=state.progress,
            orders=state.orders,
            contacts=state.contacts,
            outcome=blank(StepResult, lengths),
            robot_grid=self._robot_grid,
            item_grid=self._item_grid,
            nearby=blank(Nearby, lengths),
            claims=blank(Claims, lengths),
            engine=self._physics.engine,
        )
        self._world.claims.robot[:] = NOBODY
        self._words = packed(self._world)
        self._address: int = self._words.ctypes.data
        self._physics.begin(self._address)

    def _remember(self) -> None:
        """Note everything a pickle needs, and rebuild the bodies from it as unpickling will.

        What the engine remembers of contacts cannot be saved, so a pickle holds the world at the
        last such moment and the commands since, which unpickling replays.
        """
        self._robot_places = self.state.robot_position.copy()
        self._rebuild_bodies()
        self._world.commands.n_logged[0] = 0
        self._save()

    def _rebuild_bodies(self) -> None:
        self._physics = Physics(self.scenario, self._robot_places, self._physics.n_boxes)
        self._world = self._world._replace(engine=self._physics.engine)
        words = self._physics.words
        self._words[-len(words) :] = words  # the engine is the last field of a world
        self._physics.begin(self._address)

    def _logged(self) -> NDArray[np.float64]:
        """Return the commands since the last such moment, (steps, N, C)."""
        now, log, n_logged = self._world.commands
        return log.reshape(-1, *now.shape)[: n_logged.item()]

    def _save(self) -> None:
        attributes = {name: x for name, x in vars(self).items() if name not in _NOT_PICKLED}
        self._memory = pickle.dumps(attributes)

    @in_one_thread
    def __getstate__(self) -> dict[str, Any]:
        if self._seed is None:
            return {name: value for name, value in self.__dict__.items() if name != "lock"}
        if self._elsewhere is not None:
            raise SetupError(
                f"a world with bodies = {self.scenario.bodies} cannot be copied during an episode, "
                "as nobody can copy what moves them: should be played again from its seed"
            )
        return {"_memory": self._memory, "_log": self._logged().copy()}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        self.lock = threading.RLock()
        self._elsewhere = None
        if "_memory" not in saved:
            self.__dict__.update(saved)
            return
        self.__dict__.update(pickle.loads(saved["_memory"]))
        self._memory = saved["_memory"]
        self._build()
        for commands in saved["_log"]:
            self.step(commands)

    def _apply_faults(self) -> None:
        state = self.state
        period = self.scenario.control_period
        is_removed, is_away = apply_faults(state, self.scenario, self._occurrences)
        state.progress.is_changed[0] = True
        # Only now is known which robots fail, whose breaks are changes, too.
        state.progress.pause_step[0] = step_of_change(self._occurrences, state.step, period)
        change_presence(self._address, state, is_removed, is_away)


def _occurrences(faults: Sequence[FaultLike], seed: int, scenario: Scenario) -> list[Occurrence]:
    checked = check_returns(checked_faults("faults", faults), scenario)
    return [Occurrence(fault, seed, scenario) for fault in checked]


def _scenario(scenario: Scenario | None, otherwise: Scenario) -> Scenario:
    if not isinstance(scenario, Scenario | None):
        raise ScenarioError(f"scenario = {scenario!r}: should be a Scenario")
    return otherwise if scenario is None else scenario
