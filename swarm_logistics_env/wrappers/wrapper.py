"""The base of all wrappers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pettingzoo.utils import BaseParallelWrapper

from swarm_logistics_env.environment.dict_view import ArrayStep, DictView
from swarm_logistics_env.environment.reset_options import checked_options, checked_seed
from swarm_logistics_env.errors import SetupError

if TYPE_CHECKING:
    from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
    from swarm_logistics_env.scenario import Scenario


class Wrapper(DictView, BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo ships no types
    """An environment around an environment, which leaves everything as it is; for subclasses.

    They override `plan`, for what an episode should be like, `begun`, `before_step`, `after_step`
    or the array methods themselves; the dict methods follow. Everything else is the wrapped
    environment's. Threads share out the worlds of a vector environment only if no wrapper
    overrides `step_arrays`.

    Args:
        env: a `SwarmLogisticsEnv` or a wrapper of one.

    Attributes:
        is_outermost: whether no other wrapper may be put around it, as its arrays have other rows
            than the warehouse's robots.

    Raises:
        SetupError: it is something else, or a wrapper that has to be the outermost one.

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
        """Return the options to reset the wrapped environment with, those given taken in.

        Pure: asked twice with the same seed and options it answers the same.
        """
        return options

    def scenario_of(self, seed: int, options: Mapping[str, Any]) -> Scenario:
        """Return the scenario of the episode that such a reset would begin; changes nothing."""
        scenario: Scenario = self.env.scenario_of(seed, self.plan(seed, dict(options)))
        return scenario

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode, as planned, and return the first observations (N, D)."""
        seed = self.env.next_seed if seed is None else checked_seed(seed)
        observations: NDArray[np.float32] = self.env.reset_arrays(
            seed, self.plan(seed, checked_options(options))
        )
        self.begun(seed)
        return observations

    def begun(self, seed: int) -> None:
        """Store what a subclass needs to know of the episode that has begun."""

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period; see `SwarmLogisticsEnv.step_arrays`."""
        return self.after_step(self.env.step_arrays(self.before_step(commands)))

    def before_step(self, commands: ArrayLike) -> ArrayLike:
        """Return the commands to step the wrapped environment with, of the same shape."""
        return commands

    def after_step(self, outcome: ArrayStep) -> ArrayStep:
        """Return what to tell of the step that the wrapped environment has taken."""
        return outcome

    @property
    def episode_info(self) -> dict[str, float]:
        """The part of every agent's infos that is about the episode; it always has the same keys.

        For wrappers that have more to say: `{**self.env.episode_info, "key": number}`.
        """
        info: dict[str, float] = self.env.episode_info
        return info

    @property
    def max_cycles(self) -> int | None:
        """Steps after which an episode is truncated."""
        cycles: int | None = self.env.max_cycles
        return cycles

    @max_cycles.setter
    def max_cycles(self, cycles: int | None) -> None:
        self.unwrapped.max_cycles = cycles

    def _place(self) -> int:
        """Return how many wrappers of the same class lie inside, so that each draws for itself."""
        place, env = 0, self.env
        while env is not env.unwrapped:
            place += type(env) is type(self)
            env = env.env
        return place
