"""Stable-baselines3's VecNormalize, with statistics of robots alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from swarm_logistics_env.errors import SetupError

from .sb3 import SwarmVecEnv


class SwarmVecNormalize(VecNormalize):  # type: ignore[misc]  # not in the environment of the type check
    """`VecNormalize` around a `SwarmVecEnv` whose rows are partly padding.

    `VecNormalize` itself counts rows of padding, which are zeros: with sizes drawn from 3 and 25
    that is 44 % of all rows, so that its means and deviations are not those of what robots sense.
    Here rows that are no robot's count neither among observations nor among returns.

    Args:
        venv: a `SwarmVecEnv`, or wrappers of stable-baselines3 around one.
        **arguments: those of `VecNormalize`.

    Raises:
        SetupError: `venv` is something else.

    Example:
        >>> env = SwarmVecNormalize(SwarmVecEnv(n_worlds=2, n_robots=3))
        >>> env.reset().shape
        (6, 140)
    """

    returns: NDArray[np.float64]

    def __init__(self, venv: Any, **arguments: Any) -> None:
        if not isinstance(getattr(venv, "unwrapped", None), SwarmVecEnv):
            raise SetupError(f"venv = {venv!r}: should be a SwarmVecEnv or wrappers around one")
        super().__init__(venv, **arguments)
        if self.norm_obs:
            self.obs_rms = _OfRobots(shape=self.observation_space.shape)

    def step_async(self, actions: ArrayLike) -> None:
        """Take the commands of the step that `step_wait` makes."""
        self._acting = self.venv.present
        super().step_async(actions)

    def _update_reward(self, reward: NDArray[np.float32]) -> None:
        self.returns = self.returns * self.gamma + reward
        if self._acting.any():
            self.ret_rms.update(self.returns[self._acting])


class _OfRobots(RunningMeanStd):  # type: ignore[misc]  # as above
    def update(self, arr: NDArray[np.float32]) -> None:
        """Count the rows of robots, who always sense something; padding is zeros."""
        robots = arr[arr.any(axis=1)]
        if len(robots):
            super().update(robots)
