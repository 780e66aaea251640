"""Wrappers that let robots fail, or change a parameter of the scenario during an episode."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from swarm_logistics_env.core.errors import FaultError, ScenarioError, suggest
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import faults_among, scenario_fields
from swarm_logistics_env.world.scenario import CHANGES_DURING_RUN, Scenario
from swarm_logistics_env.world.warehouse import Fault
from swarm_logistics_env.world.warehouse.faults import GRACE, failed_robots

from .wrapper import Wrapper, as_choices, draw


class FaultInjection(Wrapper):
    """Lets robots fail in every episode, in addition to the environment's own faults.

    Robots do not sense that they failed. `infos` tell it by the key "failed", and
    `warehouse.state.failure_modes` names the modes while they hold. Faults in the options of a
    reset replace the environment's own; the faults of this wrapper are added to either.

    Args:
        env: the environment, or a wrapper of one.
        mode: a key of `FAILURE_MODES`.
        robots: how many robots fail, or the numbers of those that do. A number of robots is
            chosen by the episode's seed alone: sets of 1, 2, 3, .. are nested, and are the same
            for every mode.
        onset: the time of the failure [s]; a list to draw from in each episode; or a function of
            a numpy Generator that returns one time or an array of times. At each further time
            as many robots more fail, as long as there are any; robots given by number fail once
            more, which in `motor_slow` makes them slower still while both failures last.
        duration: how long a failure lasts [s]; None means until the end.
        factor: the part of speed (`motor_slow`) or of view (`view_reduced`) that is left, in
            [0, 1).

    Attributes:
        injected: this episode's faults of this wrapper, with the robots' numbers.

    Raises:
        FaultError: mode, robots, times or factor are not allowed, or there may be fewer robots
            than that. If a function gives such times, the reset raises it.
        SetupError: `env` is not such an environment.

    Example:
        >>> from swarm_logistics_env import swarm_logistics_v0
        >>> env = FaultInjection(swarm_logistics_v0.parallel_env(), "FM1", robots=2, onset=200.0)
        >>> observations, infos = env.reset(seed=0)
        >>> len(env.failed_robots), env.injected[0].onset
        (2, 200.0)
        >>> def onsets(rng):
        ...     return rng.exponential(100.0, size=3).cumsum()
        >>> env = FaultInjection(env, "motor_dead", onset=onsets)
        >>> observations, infos = env.reset(seed=0)
        >>> len(env.failed_robots)
        3
    """

    def __init__(
        self,
        env: SwarmLogisticsEnv | Wrapper,
        mode: str,
        robots: int | Sequence[int] = 1,
        onset: ArrayLike | Callable[[np.random.Generator], ArrayLike] = 0.0,
        duration: float | None = None,
        factor: float | None = None,
    ) -> None:
        super().__init__(env)
        self._fault = Fault(mode, robots, duration=duration, factor=factor)
        if not callable(onset):
            onset = _as_times(onset)
            for time in onset:
                self._fault.replace(onset=time)
            if len(onset) == 0:
                raise FaultError("Fault.onset = []: should list at least one time [s]")
        self._onset = onset
        self.injected: tuple[Fault, ...] = ()
        for scenario in self.env.scenarios:
            failed_robots(self._fault, 0, scenario)

    @property
    def failed_robots(self) -> tuple[int, ...]:
        """The robots that this wrapper's faults affect in this episode, ascending."""
        groups = [fault.robots for fault in self.injected if isinstance(fault.robots, tuple)]
        return tuple(sorted(set().union(*groups)))

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with this episode's faults added to theirs."""
        faults = self._draw_faults(seed, self.env.scenario_of(seed, options))
        return {**options, "faults": (*faults_among(options, self.unwrapped.faults), *faults)}

    def begun(self, seed: int) -> None:
        """Store this episode's faults."""
        self.injected = self._draw_faults(seed, self.warehouse.scenario)

    def declare_spaces(self, scenario: Scenario) -> None:
        """Widen the spaces for `scenario`; see `SwarmLogisticsEnv.declare_spaces`.

        Raises:
            FaultError: `scenario` has fewer robots than are to fail.
        """
        failed_robots(self._fault, 0, scenario)
        self.env.declare_spaces(scenario)

    def _draw_faults(self, seed: int, scenario: Scenario) -> tuple[Fault, ...]:
        rng = generator(seed, "fault onsets", self._n_alike_inside())
        if callable(self._onset):
            onsets = sorted(_as_times(self._onset(rng)))
        else:
            onsets = [draw(self._onset, rng)]
        if isinstance(self._fault.robots, tuple):
            return tuple(self._fault.replace(onset=onset) for onset in onsets)
        faults = []
        failed = set[int]()
        size = self._fault.robots
        for number, onset in enumerate(onsets, start=1):
            # The first group has to exist; later groups are drawn from the robots that are left.
            group = self._fault.replace(robots=max(size, min(number * size, scenario.n_robots)))
            failing = set(failed_robots(group, seed, scenario).tolist())
            if new_robots := tuple(sorted(failing - failed)):
                faults.append(self._fault.replace(robots=new_robots, onset=onset))
            failed = failing
        return tuple(faults)


def _as_times(onset: ArrayLike) -> list[float]:
    try:
        times: list[float] = np.asarray(onset, dtype=np.float64).ravel().tolist()
    except (TypeError, ValueError):
        raise FaultError(
            f"Fault.onset = {onset!r}: should be a time [s], a list of times, or a function of a "
            "numpy Generator that returns them"
        ) from None
    return times


class ParameterChange(Wrapper):
    """Plays each episode with a parameter of the scenario changed, throughout or from a time on.

    If the options of a reset name the parameter, their value holds until the time of the change.

    Args:
        env: the environment, or a wrapper of one.
        name: a field of `Scenario`, e.g. "delivery_width".
        values: the new value, or a list to draw from in each episode (a tuple is one value, as
            `speed_mix` has them).
        at: the time of the change [s], given like `values`; the value holds from the first step
            that begins then or later. None means that it holds throughout the episode.

    Attributes:
        value: the value that the parameter has, or will have, in this episode.
        time: the time of the change [s], or None.

    Raises:
        ScenarioError: there is no such parameter, it cannot change during a run, or its value or
            time is not allowed.
        SetupError: a list is empty, or the spaces have no room for a value.

    Example:
        >>> from swarm_logistics_env import swarm_logistics_v0
        >>> env = swarm_logistics_v0.parallel_env(duration=500.0)
        >>> env = ParameterChange(env, "delivery_width", [0.5, 1.0], at=250.0)
        >>> observations, infos = env.reset(seed=0)
        >>> env.value in (0.5, 1.0), env.time, env.warehouse.scenario.delivery_width
        (True, 250.0, 2.0)
    """

    def __init__(
        self,
        env: SwarmLogisticsEnv | Wrapper,
        name: str,
        values: Any,
        *,
        at: Any = None,
    ) -> None:
        super().__init__(env)
        if not isinstance(name, str) or name not in Scenario.model_fields:
            raise ScenarioError(
                f"Scenario has no field {name!r}{suggest(str(name), Scenario.model_fields)}. What "
                f"a policy decides by is set where it is made, as policies.load(.., {name}=..)"
            )
        if at is not None and name not in CHANGES_DURING_RUN:
            raise ScenarioError(
                f"Scenario.{name} cannot change during a run: should be set per episode, at=None; "
                f"these can change: {', '.join(sorted(CHANGES_DURING_RUN))}"
            )
        self.name = name
        self._values = as_choices(name, values)
        self._times = () if at is None else as_choices("at", at)
        for time in self._times:
            if not isinstance(time, int | float) or not time >= 0:
                raise ScenarioError(f"at = {time!r}: should be a time of at least 0 s")
        self.value: Any = None
        self.time: float | None = None
        self._is_due = False
        before = () if at is None else self.env.scenarios
        after = self._declare(name, self._values)
        self.scenarios: tuple[Scenario, ...] = tuple(dict.fromkeys((*before, *after)))

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with the parameter among them, if it holds throughout."""
        value, time = self._draw_change(seed)
        if time is None:
            return {**options, "scenario": {self.name: value, **scenario_fields(options)}}
        # The change is tried now, because an error in mid-run would cost the run.
        self.env.scenario_of(seed, options).replace(**{self.name: value})
        return options

    def begun(self, seed: int) -> None:
        """Store this episode's value and time."""
        self.value, self.time = self._draw_change(seed)
        self._is_due = self.time is not None
        if not self._is_due:
            self.value = getattr(self.warehouse.scenario, self.name)

    def before_step(self, commands: ArrayLike) -> ArrayLike:
        """Make the change if it is due."""
        if self._is_due and self.warehouse.state.time >= (self.time or 0.0) - GRACE:
            self._is_due = False
            if self.value != getattr(self.warehouse.scenario, self.name):
                self.warehouse.change(**{self.name: self.value})
        return commands

    def _draw_change(self, seed: int) -> tuple[Any, float | None]:
        rng = generator(seed, f"change of {self.name}", self._n_alike_inside())
        value = draw(self._values, rng)
        return value, float(draw(self._times, rng)) if self._times else None
