"""Two runs on the same seed, side by side, and the actions on them."""

from __future__ import annotations

import logging
import math
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from swarm_logistics_env import policies
from swarm_logistics_env.core.errors import SetupError, SwarmLogisticsError, suggest, users_line
from swarm_logistics_env.core.records import plain
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.world.floor import floor_title
from swarm_logistics_env.world.rendering.palette import Event
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.failure_modes import failure_mode
from swarm_logistics_env.world.warehouse.faults import Fault, FaultLike, checked_faults
from swarm_logistics_env.world.warehouse.state import WarehouseState

_LONGEST_REASON = 500  # characters
# What README says of two robots that fail: of its seeds 0 to 12 this one has the median loss, 10 of
# 24 items in 240 s. Items come back, so that the sound swarm goes on.
_SHOWN_SCENARIO = Scenario.preset("realistic").replace(restock=True)
_SHOWN_POLICY = "ppo-delivery"
_SHOWN_FAULT = "FM4:2"
_SHOWN_SEED = 2
_SHOWN_SPEED = 32.0
_ABSENCE = 30.0  # [s] of a robot that is away, as nobody can click it to repair it
SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)  # times real time


class Session:
    """A run, and beside it another on the same seed: its twin without faults, or another policy.

    Args:
        scenario: the conditions.
        policy: the policy of the run.
        against: the policy of the run beside it, with the same faults; None: the same policy
            without faults, the twin.
        seed: the seed of the first episode.
        faults: faults in every episode, in addition to those that are added by hand.
        speed: how many times real time it plays; one of `SPEEDS`.
        load: returns the policy of a name.

    Attributes:
        run, beside: the run and the one beside it.
        policy, against: the names of their policies; `against` is None for the twin.
        choices: the names that `compare` takes.
        seed: the seed of this episode.
        episode: its number, from 1.
        paused: whether time stands still.
        mode: the failure mode that `break_robot` uses.
        selected: the robot that is inspected, or None.
        events: what was done to the run in this episode.
        note: a sentence about what happened last.
        failure: the error of a policy that has stopped this episode, and where it was raised;
            empty: none has.

    Raises:
        FaultError, ScenarioError: as `Warehouse.reset`.
        PolicyError: no such policy.
        SetupError: `speed` is not one of `SPEEDS`.
    """

    _due: float  # control periods to play

    def __init__(
        self,
        scenario: Scenario,
        policy: str = "swarm-dt",
        against: str | None = None,
        seed: int = 0,
        faults: Sequence[FaultLike] = (),
        speed: float = 1.0,
        load: Callable[[str], policies.Policy] = policies.load,
    ) -> None:
        self.load = load
        self._planned_faults = checked_faults("faults", faults)
        chosen = filter(None, (policy, against))
        self.choices = tuple(dict.fromkeys([*chosen, *policies.NAMES]))
        self.paused = False
        self.mode = "FM4"
        self.set_speed(speed)
        self.selected: int | None = None
        self.note = self.failure = ""
        self.episode = 0
        self._begin(scenario, seed, policy, against)

    @property
    def scenario(self) -> Scenario:
        """The conditions that hold now."""
        return self.run.world.scenario

    @property
    def state(self) -> WarehouseState:
        """The state of the run, beside which the other one plays."""
        return self.run.world.state

    @property
    def is_over(self) -> bool:
        """Whether both runs have come to their ends."""
        return self.run.is_over and self.beside.is_over

    # Time

    def play(
        self,
        elapsed: float,
        budget: float = math.inf,
        after_step: Callable[[], object] = lambda: None,
    ) -> None:
        """Let both runs go on for some wall time, until a policy fails: see `failure`.

        Args:
            elapsed: wall time since the last call [s].
            budget: the most time to compute [s]; steps that do not fit into it are left out.
            after_step: is called after every step.
        """
        if self.paused or self.is_over or self.failure:
            return
        self._due += elapsed * self.speed / self.scenario.control_period
        stop = time.perf_counter() + budget
        while self._due >= 1.0 and not (self.is_over or self.failure):
            self._try_to_advance()
            after_step()
            self._due -= 1.0
            if time.perf_counter() >= stop:
                self._due = min(self._due, 1.0)
                break

    def pause(self) -> None:
        """Pause, or go on."""
        self.paused = not self.paused

    def step(self) -> None:
        """Pause, and take one control period, unless a policy has failed."""
        self.paused = True
        if not self.failure:
            self._try_to_advance()

    def set_speed(self, speed: float) -> None:
        """Play that many times as fast as real time, one of `SPEEDS`."""
        if speed not in SPEEDS:
            allowed = ", ".join(f"{allowed:g}" for allowed in SPEEDS)
            raise SetupError(f"speed = {speed:g}: should be one of {allowed}")
        self.speed = speed

    def compare(self, policy: str, against: str | None = None) -> None:
        """Begin the episode again with other policies, out of `choices`; None is the twin."""
        for name in filter(None, (policy, against)):
            if name not in self.choices:
                raise SetupError(f"no policy {name!r} to choose{suggest(name, self.choices)}")
        self._begin_again(self.scenario, self.seed, policy, against)
        self.note = f"seed {self.seed} again"

    def next_seed(self) -> None:
        """Begin an episode with the next seed."""
        self._begin_again(self.scenario, self.seed + 1, self.policy, self.against)
        self.note = f"seed {self.seed}"

    def restart(self) -> None:
        """Begin the episode again, with the same seed, all robots as they were."""
        self.compare(self.policy, self.against)

    def show_fault(self) -> None:
        """Begin, fast, what README shows: two of 25 robots fail in FM4, beside them none fails."""
        self._planned_faults = checked_faults("faults", [_SHOWN_FAULT])
        self._begin_again(_SHOWN_SCENARIO, _SHOWN_SEED, _SHOWN_POLICY, None)
        self.paused = False
        self.speed = _SHOWN_SPEED
        self.selected = None
        self.note = (
            f"two robots of {self.scenario.n_robots} deliver nothing from the start (FM4); "
            "beside them the same swarm without faults"
        )

    # Robots

    def select(self, robot: int | None) -> None:
        """Inspect `robot`; None ends the inspection."""
        state = self.state
        if robot is not None and not (0 <= robot < state.n_robots and state.robot_present[robot]):
            raise SetupError(f"robot = {robot}: should be one that is in the warehouse")
        self.selected = robot

    def choose_mode(self, mode: str) -> None:
        """Break robots in that failure mode from now on."""
        failure_mode(mode)  # raises FaultError if there is none
        self.mode = mode

    def break_robot(self) -> None:
        """Let the selected robot fail from now on in the chosen mode."""
        robot = self._robot_to_change()
        if self.mode in self.state.failure_modes[robot]:
            self.note = f"robot {robot} already fails in mode {self.mode}"
            return
        now = round(self.state.time, 9)
        duration = _ABSENCE if failure_mode(self.mode).returns else None
        fault = Fault(self.mode, [robot], now, duration)
        self._change_faults(lambda faults: [*faults, fault])
        self._deselect_absent_robot()
        self._add_event(Event(self.state.time, robot, self.mode))

    def repair_robot(self) -> None:
        """End all failures of the selected robot."""
        robot = self._robot_to_change()
        state = self.state
        if not state.failed[robot]:
            self.note = f"robot {robot} is sound"
            return

        def without_robot(faults: Iterable[Fault]) -> Iterator[Fault]:
            for fault in faults:
                if not (fault.is_active(state.time) and isinstance(fault.robots, tuple)):
                    yield fault
                elif still_faulty := tuple(faulty for faulty in fault.robots if faulty != robot):
                    yield fault.replace(robots=still_faulty)

        self._change_faults(lambda faults: [*without_robot(faults)])
        self._add_event(Event(self.state.time, robot))

    def toggle_robot(self, robot: int) -> None:
        """Select a robot, and break it, or repair it if it fails."""
        self.select(robot)
        if self.state.failed[robot]:
            self.repair_robot()
        else:
            self.break_robot()

    # Conditions

    def resize(self, n_robots: int) -> None:
        """Begin the episode again with a swarm of that size."""
        scenario = self.scenario.replace(n_robots=n_robots)
        self._begin_again(scenario, self.seed, self.policy, self.against)
        self.note = f"swarm size {n_robots}: a swarm cannot grow in a run, so it began again"

    def set_delivery_width(self, width: float) -> None:
        """Make the delivery area that wide [m], in both runs, at once.

        Raises:
            ScenarioError: it leaves no storage.
            SetupError: a floor plan fixes the delivery area.
        """
        width = round(width, 6)
        if self.scenario.floor is not None:
            raise SetupError(
                f"delivery_width = {width:g}: should stay as it is, as the floor plan "
                f"{floor_title(self.scenario.floor)} has the docks"
            )
        for play in (self.run, self.beside):
            play.world.change(delivery_width=width)
        self._add_event(Event(self.state.time, note=f"delivery area {width:g} m wide"))

    def _begin(self, scenario: Scenario, seed: int, policy: str, against: str | None) -> None:
        faults = self._planned_faults
        run = Play(scenario, self.load(policy), seed, faults)
        if against is None:
            self.beside = Play(scenario, self.load(policy), seed)
        else:
            self.beside = Play(scenario, self.load(against), seed, faults)
        self.run = run
        self.episode += 1
        self.seed = seed
        self._due = 0.0
        self.policy = policy
        self.against = against
        self.events: list[Event] = []
        self._unannounced_faults = [*faults]
        self._announce_faults()
        self._deselect_absent_robot()

    def _begin_again(self, scenario: Scenario, seed: int, policy: str, against: str | None) -> None:
        with _explain_policy_errors():
            self._begin(scenario, seed, policy, against)
        self.failure = ""

    def _try_to_advance(self) -> None:
        try:
            with _explain_policy_errors():
                self.advance()
        except SwarmLogisticsError as error:
            self.failure = str(error)

    def advance(self) -> None:
        """Take one control period in both runs."""
        self.run.step()
        self.beside.step()
        self._announce_faults()
        self._deselect_absent_robot()

    def _announce_faults(self) -> None:
        """Note which robots the faults strike; faults by role choose theirs at the onset."""
        if not self._unannounced_faults:
            return
        world = self.run.world
        for fault, numbered in zip(world.faults, world.numbered_faults):
            if fault in self._unannounced_faults and isinstance(numbered.robots, tuple):
                self._unannounced_faults.remove(fault)
                self.events += [Event(fault.onset, robot, fault.mode) for robot in numbered.robots]

    def _change_faults(self, change: Callable[[Sequence[Fault]], Sequence[Fault]]) -> None:
        # The faults name their robots, so that each robot can be repaired by itself.
        self.run.world.set_faults(change(self.run.world.numbered_faults))
        if self.against is not None and not self.beside.is_over:
            self.beside.world.set_faults(change(self.beside.world.numbered_faults))

    def _add_event(self, event: Event) -> None:
        self.events.append(event)
        self.note = event.words

    def _deselect_absent_robot(self) -> None:
        robot = self.selected
        present = self.state.robot_present
        if robot is not None and not (robot < len(present) and present[robot]):
            self.selected = None

    def _robot_to_change(self) -> int:
        if self.selected is None:
            raise SetupError("robot: none is selected, click one first")
        if self.run.is_over:
            raise SetupError("the run is over: begin the next seed, or this one again")
        return self.selected


@contextmanager
def _explain_policy_errors() -> Iterator[None]:
    """Let whatever a policy raises be a SetupError that says what and where; log the traceback."""
    try:
        yield
    except (Exception, SystemExit) as raised:
        error: BaseException = raised
        if isinstance(raised, SwarmLogisticsError):
            # Loading wraps what the policy raised.
            if raised.__cause__ is None or isinstance(raised.__cause__, SwarmLogisticsError):
                raise
            error = raised.__cause__
        logging.getLogger(__name__).warning("A policy has failed.", exc_info=error)
        reason = plain(traceback.format_exception_only(error)[-1].strip())[:_LONGEST_REASON]
        # The policy's own line, not that of a library that it calls.
        line = users_line("".join(traceback.format_tb(error.__traceback__)))
        if line is None:
            raise SetupError(reason) from error
        file, number = line
        raise SetupError(f"{reason}, {plain(Path(file).name)} line {number}") from error
