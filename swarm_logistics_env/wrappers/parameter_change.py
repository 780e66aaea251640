"""A wrapper that changes a parameter of the scenario, for an episode or during it."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.reset_options import scenario_fields
from swarm_logistics_env.errors import ScenarioError, suggest
from swarm_logistics_env.scenario import CHANGES_DURING_RUN, Scenario
from swarm_logistics_env.streams import generator
from swarm_logistics_env.warehouse.faults import GRACE

from .sampling import Sampler
from .wrapper import Wrapper


class ParameterChange(Wrapper):
    """Plays each episode with a parameter of the scenario changed, throughout or from a time on.

    If the options of a reset name the parameter, their value holds until the time of the change.

    Args:
        env: the environment, or a wrapper of one.
        name: a field of `Scenario`, e.g. "delivery_width".
        values: the new value; a list to draw from in each episode (a tuple is one value, as
            `speed_mix` has them); or a function of a numpy Generator.
        at: the time of the change [s], given like `values`; the value holds from the first step
            that begins then or later. None means that it holds throughout the episode.
        within: (least, greatest) value that a function returns; required with a function.
        at_within: (earliest, latest) time that a function returns; required with a function.

    Attributes:
        value: the value that the parameter has, or will have, in this episode.
        time: the time of the change [s], or None.

    Raises:
        ScenarioError: there is no such parameter, it cannot change during a run, or its value or
            time is not allowed.
        SetupError: a function comes without its bounds, or the spaces have no room for a value.

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
        within: tuple[Any, Any] | None = None,
        at_within: tuple[float, float] | None = None,
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
        self._values = Sampler(name, values, within)
        self._times = None if at is None else Sampler("at", at, at_within)
        if self._times is not None:
            for time in self._times.ends:
                if not isinstance(time, int | float) or not time >= 0:
                    raise ScenarioError(f"at = {time!r}: should be a time of at least 0 s")
        self.value: Any = None
        self.time: float | None = None
        self._is_due = False
        before = self.env.scenarios
        after = [known.replace(**{name: value}) for known in before for value in self._values.ends]
        for scenario in after:
            self.declare_spaces(scenario)
        known = after if at is None else [*before, *after]
        self.scenarios: tuple[Scenario, ...] = tuple(dict.fromkeys(known))

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options with the parameter among them, if it holds throughout."""
        value, time = self._drawn(seed)
        if time is None:
            return {**options, "scenario": {self.name: value, **scenario_fields(options)}}
        # The change is tried now, because an error in mid-run would cost the run.
        self.env.scenario_of(seed, options).replace(**{self.name: value})
        return options

    def begun(self, seed: int) -> None:
        """Store this episode's value and time."""
        self.value, self.time = self._drawn(seed)
        present = getattr(self.warehouse.scenario, self.name)
        if self.time is None:
            self.value = present
        self._is_due = self.value != present

    def before_step(self, commands: ArrayLike) -> ArrayLike:
        """Make the change if it is due."""
        if self._is_due and self.warehouse.state.time >= (self.time or 0.0) - GRACE:
            self.warehouse.change(**{self.name: self.value})
            self._is_due = False
        return commands

    def _drawn(self, seed: int) -> tuple[Any, float | None]:
        rng = generator(seed, f"change of {self.name}", self._place())
        value = self._values.sample(rng)
        return value, None if self._times is None else float(self._times.sample(rng))
