"""What goes around a `SwarmVecEnv` in a training: a log of deliveries, and VecNormalize.

Both count robots alone, no padding.
"""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.running_mean_std import RunningMeanStd
from stable_baselines3.common.vec_env import VecNormalize

from swarm_logistics_env.core.errors import SetupError

from .sb3 import SwarmVecEnv  # first: it says what to install


class LogDeliveries(BaseCallback):  # type: ignore[misc]  # not in the environment of the type check
    """Logs `rollout/delivered_mean`: the mean P [items] of the episodes that `ep_rew_mean` is of.

    Example:
        >>> from stable_baselines3 import PPO
        >>> model = PPO("MlpPolicy", SwarmVecEnv(n_robots=2, duration=2.0), n_steps=32)
        >>> model.learn(512, callback=LogDeliveries()).num_timesteps
        512
    """

    def _init_callback(self) -> None:
        self._delivered: deque[float] = deque(maxlen=self.model._stats_window_size)

    def _on_step(self) -> bool:
        # A VecMonitor around the worlds replaces "episode", but not what else infos say.
        for info, is_done in zip(self.locals["infos"], self.locals["dones"]):
            if is_done and not info["padding"]:
                self._delivered.append(info["delivered"])
        return True

    def _on_rollout_end(self) -> None:
        if self._delivered:
            self.logger.record("rollout/delivered_mean", float(np.mean(self._delivered)))


class SwarmVecNormalize(VecNormalize):  # type: ignore[misc]  # not in the environment of the type check
    """`VecNormalize` around a `SwarmVecEnv` whose rows are partly padding.

    `VecNormalize` itself counts rows of padding, which are zeros: with sizes drawn from 3 and 25
    that is 44 % of all rows, so that its means and deviations are not those of what robots sense.
    Here rows that are no robot's count neither among observations nor among returns, and they stay
    zeros.

    Args:
        venv: a `SwarmVecEnv`, or wrappers of stable-baselines3 around one.
        **arguments: those of `VecNormalize`.

    Raises:
        SetupError: `venv` is something else.

    Example:
        >>> env = SwarmVecNormalize(SwarmVecEnv(n_worlds=2, n_robots=3))
        >>> env.reset().shape
        (6, 141)
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

    def _normalize_obs(
        self, obs: NDArray[np.float32], obs_rms: RunningMeanStd
    ) -> NDArray[np.float32]:
        # Robots always sense something, so zeros are padding; of rows, or of one, as at an end.
        is_robot = obs.any(axis=-1, keepdims=True)
        return np.where(is_robot, super()._normalize_obs(obs, obs_rms), 0.0)

    def _unnormalize_obs(
        self, obs: NDArray[np.float32], obs_rms: RunningMeanStd
    ) -> NDArray[np.float32]:
        is_robot = obs.any(axis=-1, keepdims=True)
        return np.where(is_robot, super()._unnormalize_obs(obs, obs_rms), 0.0)

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
