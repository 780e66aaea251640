"""The whole swarm as one agent: a Gymnasium environment for one central controller."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import checked_count, numbers_of
from swarm_logistics_env.policies.policy import mask_unreachable_commands
from swarm_logistics_env.wrappers import FixedAgents, Wrapper

from .worlds import with_episode_limit


class CentralEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One controller receives the observations of all robots and commands all of them.

    Observations are the swarm's rows (N, D), and actions are its commands (N, 4 + message_size).
    N is the largest swarm that is possible; robots that are absent have rows of zeros, and their
    commands are ignored. The reward is the mean of the rewards of the robots present: 1 per
    delivery by default. An episode terminates when everything is delivered or no robot is left,
    and is truncated when the time is up. A robot that hears nothing gets no commands; see
    `mask_unreachable_commands`.

    Infos are numbers, with the same keys at every step: "failed" (N,) is 1 for each robot in
    which any failure mode holds, else 0; "away" (N,) is 1 for each that left the arena and comes
    back; "delivered" is the number of items so far; wrappers add their own.

    `np_random_seed` is the seed of the current episode, also after a reset that was given none:
    `reset(seed=env.np_random_seed)` plays it again.

    Args:
        env: a `SwarmLogisticsEnv` or a wrapper of one; without it, the arguments make one.
        flat: whether observations and actions are vectors, (N * D,) and (N * (4 + message_size),),
            robot after robot, for learners that take no matrices (RLlib, stable-baselines3).
        **arguments: the arguments of `SwarmLogisticsEnv`.

    Raises:
        SetupError: both are given, or an argument is not allowed.
        ScenarioError, FaultError: an argument is not allowed.

    Example:
        >>> env = gymnasium.make("SwarmLogistics-v0", n_robots=3)
        >>> observation, info = env.reset(seed=0)
        >>> observation.shape == env.observation_space.shape, env.action_space.shape
        (True, (3, 4))
        >>> gymnasium.make("SwarmLogistics-v0", n_robots=3, flat=True).action_space.shape
        (12,)
    """

    metadata: dict[str, Any] = SwarmLogisticsEnv.metadata

    def __init__(
        self,
        env: SwarmLogisticsEnv | Wrapper | None = None,
        *,
        flat: bool = False,
        **arguments: Any,
    ) -> None:
        if env is not None and any(value is not None for value in arguments.values()):
            raise SetupError(
                f"env = {env} and {', '.join(arguments)}: should be an environment or the "
                "arguments of one, not both"
            )
        self.env = SwarmLogisticsEnv(**arguments) if env is None else env
        self._rows = self.env if isinstance(self.env, FixedAgents) else FixedAgents(self.env)
        self.metadata = self.env.metadata
        self.render_mode = self.env.render_mode
        robot = self.env.possible_agents[0]
        row = self.env.observation_space(robot)
        command = self.env.action_space(robot)
        if not isinstance(command, Box):
            raise SetupError(
                f"env = {self.env}: its commands are {command}, should be a Box; put no "
                "DiscreteActions inside of CentralEnv"
            )
        n_rows = self._rows.n_rows
        self._commands_shape = (n_rows, *command.shape)
        times = n_rows if flat else (n_rows, 1)
        self.observation_space = Box(np.tile(row.low, times), np.tile(row.high, times))
        self.action_space = Box(np.tile(command.low, times), np.tile(command.high, times))

    @property
    def spec(self) -> EnvSpec | None:
        """How Gymnasium made it, with the steps of the longest episode as `max_episode_steps`."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = with_episode_limit(spec, [self.env])

    _spec: EnvSpec | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode; see `SwarmLogisticsEnv.reset_arrays`. What is refused changes nothing.

        Raises:
            SetupError: the seed is below 0, which Gymnasium has no generator for.
        """
        # Both that seed the world and Gymnasium's generator: checked before either.
        seed = checked_count("seed", self.env.next_seed if seed is None else seed, least=0)
        observations = self._rows.reset_arrays(seed, options)
        super().reset(seed=seed)
        return self._reshape(observations), self._info()

    def step(
        self, action: ArrayLike
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Take one control period.

        Raises:
            CommandError: the action has another shape than the action space, cannot be read, or is
                not finite.
            SetupError: there was no reset, or the episode is over.
        """
        state = self.env.warehouse.state
        numbers = numbers_of(action, "action", self.action_space.shape or ())
        commands = numbers.reshape(self._commands_shape).copy()
        n_present = np.count_nonzero(state.robot_present)
        commands[: state.n_robots] = mask_unreachable_commands(commands[: state.n_robots], state)
        observations, rewards, terminations, truncations = self._rows.step_arrays(commands)
        reward = float(rewards.sum() / max(n_present, 1))
        is_over = bool(terminations.any())
        is_cut = bool(truncations.any())
        return self._reshape(observations), reward, is_over, is_cut, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture or show it; see `SwarmLogisticsEnv.render`."""
        return self.env.render()

    def state(self) -> NDArray[np.float32]:
        """Return the whole warehouse as one vector, see `SwarmLogisticsEnv.state`."""
        return self.env.state()

    def close(self) -> None:
        """Release what rendering holds; harmless when called twice."""
        self.env.close()

    def _reshape(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        return observations.reshape(self.observation_space.shape)

    def _info(self) -> dict[str, Any]:
        failed, away = np.zeros((2, self._rows.n_rows), np.int8)
        state = self.env.warehouse.state
        failed[: state.n_robots] = state.failed
        away[: state.n_robots] = state.robot_away
        return {"failed": failed, "away": away, **self.env.episode_info}
