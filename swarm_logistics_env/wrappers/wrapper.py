"""The base of all wrappers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pettingzoo.utils import BaseParallelWrapper

from swarm_logistics_env.environment.dict_view import ArrayStep, DictView
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.reset_options import checked_options, checked_seed
from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.scenario import Scenario


class Wrapper(DictView, BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo ships no types
    """An environment around an environment, which changes nothing; a base for subclasses.

    A subclass overrides `plan`, which decides the conditions of an episode, `begun`,
    `before_step`, `after_step`, or the array methods; the dict methods call these. All other
    attributes are the wrapped environment's. `SwarmVecEnv` steps its worlds in threads only if
    no wrapper overrides `step_arrays`.

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

    def plan(self, seed: int, options: dict[str, Any]) -> dict[str, Any]:
        """Return the options of the wrapped environment's reset, made from the given options.

        The same seed and options have to give the same result, also when it is called twice.
        """
        return options

    def scenario_of(self, seed: int, options: Mapping[str, Any]) -> Scenario:
        """Return the scenario of the episode that such a reset would begin; it begins nothing."""
        scenario: Scenario = self.env.scenario_of(seed, self.plan(seed, dict(options)))
        return scenario

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin the episode that `plan` describes and return the first observations (N, D)."""
        seed = self.env.next_seed if seed is None else checked_seed(seed)
        observations: NDArray[np.float32] = self.env.reset_arrays(
            seed, self.plan(seed, checked_options(options))
        )
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
        info: dict[str, float] = self.env.episode_info
        return info

    @property
    def max_cycles(self) -> int | None:
        """The number of steps after which an episode is truncated, or None."""
        cycles: int | None = self.env.max_cycles
        return cycles

    @max_cycles.setter
    def max_cycles(self, cycles: int | None) -> None:
        self.unwrapped.max_cycles = cycles

    def _place(self) -> int:
        """Return the number of wrappers of the same class inside; it gives each its own draws."""
        place, env = 0, self.env
        while env is not env.unwrapped:
            place += type(env) is type(self)
            env = env.env
        return place
