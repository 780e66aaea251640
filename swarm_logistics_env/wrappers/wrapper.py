"""The base of all wrappers, and the condition of an episode, by which indicators tell them apart.

Quantities of an episode are fixed, or one of a list.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pettingzoo.utils import BaseParallelWrapper

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import checked_options
from swarm_logistics_env.environment.spaces import ArrayStep, DictView
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.world.warehouse.faults import Fault


@dataclass(frozen=True)
class Condition:
    """The difference of an episode from its reference: size, faults, a changed parameter.

    The onset of a fault is no part of it: if onsets are drawn, P_F is the mean over them.

    Args:
        n_robots: the swarm size N.
        modes: failure modes of its faults, sorted; "removed" is none of them.
        n_failed: how many robots these affect (m of R and FT).
        n_removed: how many robots are removed.
        changes: (field, value) of the scenario where it is not the environment's own, sorted.

    Raises:
        SetupError: more robots fail or are removed than there are, or faults without a mode.

    Example:
        >>> Condition(25, ("FM1",), n_failed=2)
        Condition(n_robots=25, modes=('FM1',), n_failed=2, n_removed=0, changes=())
    """

    n_robots: int
    modes: tuple[str, ...] = ()
    n_failed: int = 0
    n_removed: int = 0
    changes: tuple[tuple[str, Any], ...] = ()

    def __post_init__(self) -> None:
        for name in ("n_failed", "n_removed"):
            if not 0 <= getattr(self, name) <= self.n_robots:
                raise SetupError(
                    f"Condition.{name} = {getattr(self, name)}: should be at least 0 and at most "
                    f"n_robots = {self.n_robots}"
                )
        if bool(self.modes) != bool(self.n_failed):
            raise SetupError(
                f"Condition.modes = {self.modes}, n_failed = {self.n_failed}: should both be given "
                "or neither"
            )


def condition_of(world: Warehouse, base: Scenario) -> Condition:
    """Return the condition of the episode in `world`, relative to the scenario `base`.

    A fault by role that has not chosen its robots yet counts as one of robots that fail by no other
    fault.
    """
    n_robots = world.scenario.n_robots
    modes = set[str]()
    failed = set[int]()
    removed = set[int]()
    faults = world.numbered_faults
    for fault in sorted(faults, key=lambda fault: isinstance(fault.robots, int)):
        affected = removed if fault.mode == "removed" else failed
        if fault.mode != "removed":
            modes.add(fault.mode)
        if isinstance(fault.robots, int):
            unaffected = [robot for robot in range(n_robots) if robot not in affected]
            affected.update(unaffected[: fault.robots])
        else:
            affected.update(fault.robots)
    changes = changes_of(world.scenario, base)
    return Condition(n_robots, tuple(sorted(modes)), len(failed), len(removed), changes)


def changes_of(scenario: Scenario, base: Scenario) -> tuple[tuple[str, Any], ...]:
    """Return the fields of `scenario`, but for the size, that differ from `base`, with values."""
    return tuple(
        (name, getattr(scenario, name))
        for name in sorted(type(base).model_fields)
        if name != "n_robots" and getattr(scenario, name) != getattr(base, name)
    )


def as_choices(name: str, value: Any) -> tuple[Any, ...]:
    """Return the values that an episode's is drawn from: those of a list or array, or the one.

    Raises:
        SetupError: the list is empty.
    """
    values = list(value) if isinstance(value, list | np.ndarray) else [value]
    if not values:
        raise SetupError(f"{name} = []: should list at least one value")
    return tuple(value.item() if isinstance(value, np.generic) else value for value in values)


def draw(values: Sequence[Any], rng: np.random.Generator) -> Any:
    """Return one of the values, each equally likely."""
    return values[int(rng.integers(len(values)))]


class Wrapper(DictView, BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo ships no types
    """An environment around an environment, which changes nothing; a base for subclasses.

    A subclass overrides `plan`, which decides the conditions of an episode, `begun`,
    `before_step`, `after_step`, or the array methods; the dict methods call these. One that
    changes observations overrides `reset_arrays` beside `after_step`, and changes a copy. All
    other attributes are the wrapped environment's. `SwarmVecEnv` steps its worlds in threads
    only if no wrapper overrides `step_arrays`.

    Args:
        env: a `SwarmLogisticsEnv` or a wrapper of one.

    Attributes:
        is_outermost: whether it has to be the outermost wrapper; it has to if the rows of its
            arrays are not the robots of the warehouse.

    Raises:
        SetupError: `env` is something else, or a wrapper that has to be the outermost one.

    Example:
        >>> from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
        >>> env = Wrapper(SwarmLogisticsEnv(n_robots=2))
        >>> env.reset_arrays(seed=0).shape == env.unwrapped.reset_arrays(seed=0).shape
        True
    """

    is_outermost = False
    env: SwarmLogisticsEnv | Wrapper

    def __init__(self, env: SwarmLogisticsEnv | Wrapper) -> None:
        if not hasattr(env, "reset_arrays"):
            raise SetupError(
                f"env = {env}: should be a SwarmLogisticsEnv (swarm_logistics_v0.parallel_env) or "
                "a wrapper of one; wrap before converting to AEC"
            )
        if isinstance(env, Wrapper) and env.is_outermost:
            raise SetupError(
                f"{type(self).__name__} around {type(env).__name__}: should be inside of it, as "
                f"{type(env).__name__}({type(self).__name__}(env, ...))"
            )
        super().__init__(env)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.env!r})"

    __str__ = __repr__

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options of the wrapped environment's reset, made from the given options.

        The same seed and options have to give the same result, also when it is called twice.
        """
        return options

    def scenario_of(self, seed: int, options: Mapping[str, Any]) -> Scenario:
        """Return the scenario of the episode that such a reset would begin; it begins nothing."""
        return self.env.scenario_of(seed, self.plan(seed, dict(options)))

    def conditions_of(
        self, seed: int, options: Mapping[str, Any]
    ) -> tuple[Scenario, tuple[Fault, ...]]:
        """Return scenario and faults of the episode that such a reset would begin."""
        return self.env.conditions_of(seed, self.plan(seed, checked_options(options)))

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin the episode that `plan` describes and return the first observations (N, D)."""
        seed = self.env.next_seed if seed is None else seed
        observations = self.env.reset_arrays(seed, self.plan(seed, checked_options(options)))
        self.begun(seed)
        return observations

    def begun(self, seed: int) -> None:
        """Is called when an episode has begun; a subclass stores here what it needs of it."""

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period; see `SwarmLogisticsEnv.step_arrays`."""
        return self.after_step(self.env.step_arrays(self.before_step(commands)))

    def before_step(self, commands: ArrayLike) -> ArrayLike:
        """Return the commands for the wrapped environment, of the same shape."""
        return commands

    def after_step(self, outcome: ArrayStep) -> ArrayStep:
        """Return the result of a step, made from the result of the wrapped environment."""
        return outcome

    @property
    def episode_info(self) -> dict[str, float]:
        """The entries of every agent's infos that are about the episode; keys never change.

        A subclass adds entries by returning `{**self.env.episode_info, "key": number}`.
        """
        return self.env.episode_info

    @property
    def robot_info(self) -> Mapping[str, NDArray[Any]]:
        """The entries of agents' infos that differ by robot: name -> (N, ...), a row for each.

        A subclass adds entries by returning `{**self.env.robot_info, "key": rows}`.
        """
        return self.env.robot_info

    @property
    def max_cycles(self) -> int | None:
        """The number of steps after which an episode is truncated, or None."""
        return self.env.max_cycles

    @max_cycles.setter
    def max_cycles(self, cycles: int | None) -> None:
        self.unwrapped.max_cycles = cycles

    def _declare(self, name: str, values: Iterable[Any]) -> tuple[Scenario, ...]:
        """Declare the spaces of all scenarios with one of these values of a field; return them."""
        scenarios = self.env.scenarios
        declared = dict.fromkeys(
            scenario.replace(**{name: value}) for scenario in scenarios for value in values
        )
        for scenario in declared:
            self.declare_spaces(scenario)
        return tuple(declared)

    def _n_alike_inside(self) -> int:
        """Return the number of wrappers of the same class inside; it gives each its own draws."""
        return sum(type(env) is type(self) for env in layers_of(self.env))


def layers_of(env: SwarmLogisticsEnv | Wrapper) -> list[Any]:
    """Return the wrappers, outermost first, and the environment."""
    layers: list[Any] = [env]
    while layers[-1] is not env.unwrapped:
        layers.append(layers[-1].env)
    return layers
