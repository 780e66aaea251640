"""A session: a run, its fault-free twin on the same seed, and the actions on them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

from swarm_logistics_env.episode import Play
from swarm_logistics_env.errors import FaultError, ScenarioError, SetupError, suggest
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.rendering.curves import Curve, Event
from swarm_logistics_env.rendering.trails import Trails
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import FAILURE_MODES, Fault
from swarm_logistics_env.warehouse.faults import failed_robots

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)  # times real time
WIDTH_STEP = 0.25  # [m]


class Session:
    """A run and its twin, which has the same seed, policy and conditions but no faults.

    Args:
        scenario: the conditions.
        make_policy: returns a policy; it is called once for the run and once for the twin.
        seed: the seed of the first episode.
        faults: faults of the run in every episode, in addition to those that are added by hand.
        speed: how many times real time it plays; one of `SPEEDS`.

    Attributes:
        run, twin: the run and its twin.
        seed: the seed of this episode.
        paused: whether time stands still.
        mode: the failure mode that `break_robot` uses.
        selected: the robot that is inspected, or None.
        events: the failures and repairs of robots in this episode.
        note: a sentence about what happened last.
        trails: the paths of the run's robots, with every step, also of steps that are not shown.

    Raises:
        FaultError, ScenarioError: as `Warehouse.reset`.
        SetupError: `speed` is not one of `SPEEDS`.
    """

    def __init__(
        self,
        scenario: Scenario,
        make_policy: Callable[[], Policy],
        seed: int = 0,
        faults: Sequence[Fault] = (),
        speed: float = 1.0,
    ) -> None:
        if speed not in SPEEDS:
            known = ", ".join(f"{known:g}" for known in SPEEDS)
            raise SetupError(f"speed = {speed:g}: should be one of {known}")
        for fault in faults:
            failed_robots(fault, seed, scenario.n_robots)
        self._make_policy, self._planned = make_policy, tuple(faults)
        self.speed, self.paused, self.mode = speed, False, "FM4"
        self.selected: int | None = None
        self.note = ""
        self._due = 0.0  # control periods
        self._begin(scenario, seed)

    @property
    def scenario(self) -> Scenario:
        """The conditions that hold now."""
        return self.run.world.scenario

    @property
    def is_over(self) -> bool:
        """Whether run and twin have come to their ends."""
        return self.run.is_over and self.twin.is_over

    @property
    def curves(self) -> tuple[Curve, Curve]:
        """Deliveries of the run and of its twin."""
        run, twin = self.run.world.state, self.twin.world.state
        return (
            Curve("this run", run.delivery_times, run.time, 0),
            Curve("without faults", twin.delivery_times, twin.time, 1),
        )

    # Time

    def play(self, elapsed: float, budget: float = math.inf) -> int:
        """Let run and twin go on for some wall time; return the number of steps taken.

        Args:
            elapsed: wall time since the last call [s].
            budget: the most time to compute [s]; steps that do not fit into it are left out.
        """
        if self.paused or self.is_over:
            return 0
        self._due += elapsed * self.speed / self.scenario.control_period
        stop, steps = time.perf_counter() + budget, 0
        while self._due >= 1.0 and not self.is_over:
            self._advance()
            self._due -= 1.0
            steps += 1
            if time.perf_counter() >= stop:
                self._due = min(self._due, 1.0)
                break
        return steps

    def pause(self) -> None:
        """Pause, or go on."""
        self.paused = not self.paused

    def step(self) -> None:
        """Pause, and take one control period."""
        self.paused = True
        self._advance()

    def faster(self) -> None:
        """Play at the next higher speed."""
        self.speed = SPEEDS[min(SPEEDS.index(self.speed) + 1, len(SPEEDS) - 1)]

    def slower(self) -> None:
        """Play at the next lower speed."""
        self.speed = SPEEDS[max(SPEEDS.index(self.speed) - 1, 0)]

    def next_seed(self) -> None:
        """Begin an episode with the next seed."""
        self._begin(self.scenario, self.seed + 1)
        self.note = f"seed {self.seed}"

    def restart(self) -> None:
        """Begin the episode again, with the same seed, all robots as they were."""
        self._begin(self.scenario, self.seed)
        self.note = f"seed {self.seed} again"

    # Robots

    def select(self, robot: int | None) -> None:
        """Inspect `robot`; None ends the inspection."""
        if robot is not None:
            self._check_there(robot)
        self.selected = robot

    def choose_mode(self, mode: str) -> None:
        """Break robots in that failure mode from now on."""
        if mode not in FAILURE_MODES:
            raise FaultError(f"no failure mode {mode!r}{suggest(mode, FAILURE_MODES)}")
        self.mode = mode

    def next_mode(self, forward: bool = True) -> None:
        """Choose the failure mode after, or before, the one that is chosen."""
        modes = list(FAILURE_MODES)
        self.mode = modes[(modes.index(self.mode) + (1 if forward else -1)) % len(modes)]

    def break_robot(self, robot: int | None = None) -> None:
        """Let `robot` fail from now on in the chosen mode; None means the selected robot."""
        robot = self._meant(robot)
        if robot is None:
            return
        if self.mode in self.run.world.state.failure_modes[robot]:
            self.note = f"robot {robot} already fails in mode {self.mode}"
            return
        now = round(self.run.world.state.time, 9)
        fault = Fault(self.mode, [robot], onset=now)
        self.run.world.set_faults([*self.run.world.faults, fault])
        self._look_after_selection()
        self._log(robot, self.mode)
        self.note = f"robot {robot} fails: {self.mode}, {FAILURE_MODES[self.mode].description}"

    def repair_robot(self, robot: int | None = None) -> None:
        """End all failures of `robot`; None means the selected robot."""
        robot = self._meant(robot)
        if robot is None:
            return
        world = self.run.world
        if not world.state.failed[robot]:
            self.note = f"robot {robot} is sound"
            return
        kept = []
        for fault in world.faults:
            if fault.is_active(world.state.time) and isinstance(fault.robots, tuple):
                others = [other for other in fault.robots if other != robot]
                kept += [fault.replace(robots=tuple(others))] if others else []
            else:
                kept.append(fault)
        world.set_faults(kept)
        self._log(robot, None)
        self.note = f"robot {robot} is repaired"

    def toggle_robot(self, robot: int) -> None:
        """Select a robot, and break it, or repair it if it fails."""
        self.select(robot)
        if self.run.world.state.failed[robot]:
            self.repair_robot(robot)
        else:
            self.break_robot(robot)

    # Conditions

    def resize(self, n_robots: int) -> None:
        """Begin the episode again with a swarm of that size."""
        try:
            scenario = self.scenario.replace(n_robots=n_robots)
        except ScenarioError as error:
            self.note = str(error)
            return
        self._begin(scenario, self.seed)
        self.note = f"swarm size {n_robots}: a swarm cannot grow in a run, so it began again"
        left_out = len(self._planned) - len(self.run.world.faults)
        if left_out:
            self.note += f"; {left_out} faults affect more robots than there are: left out"

    def set_delivery_width(self, width: float) -> None:
        """Make the delivery area that wide [m], in the run and in its twin, at once."""
        width = round(width, 6)
        try:
            for play in (self.run, self.twin):
                play.world.change(delivery_width=width)
        except ScenarioError as error:
            self.note = str(error)
            return
        self.note = f"delivery area {width:g} m wide"

    def _begin(self, scenario: Scenario, seed: int) -> None:
        # The faults name their robots, so that each robot can be repaired by itself.
        faults = []
        for fault in self._planned:
            try:
                robots = failed_robots(fault, seed, scenario.n_robots)
            except FaultError:
                continue
            faults.append(fault.replace(robots=tuple(robots.tolist())))
        self.run = Play(scenario, self._make_policy(), seed, faults)
        self.twin = Play(scenario, self._make_policy(), seed)
        self.seed, self._due = seed, 0.0
        self.trails = Trails()
        self.trails.note(self.run.world.state)
        self.events: list[Event] = [
            Event(fault.onset, robot, fault.mode)
            for fault in faults
            if isinstance(fault.robots, tuple)
            for robot in fault.robots
        ]
        self._look_after_selection()

    def _advance(self) -> None:
        self.run.step()
        self.twin.step()
        self.trails.note(self.run.world.state)
        self._look_after_selection()

    def _look_after_selection(self) -> None:
        present = self.run.world.state.robot_present
        if self.selected is not None and not (
            self.selected < len(present) and present[self.selected]
        ):
            self.selected = None

    def _log(self, robot: int, mode: str | None) -> None:
        self.events.append(Event(self.run.world.state.time, robot, mode))

    def _meant(self, robot: int | None) -> int | None:
        if robot is None:
            robot = self.selected
        if robot is None:
            self.note = "click a robot first"
            return None
        self._check_there(robot)
        if self.run.is_over:
            self.note = "the run is over: begin the next seed, or this one again"
            return None
        return robot

    def _check_there(self, robot: int) -> None:
        state = self.run.world.state
        if not (0 <= robot < state.n_robots and state.robot_present[robot]):
            raise SetupError(f"robot = {robot}: should be one that is in the warehouse")
