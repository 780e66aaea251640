"""Commands by number, for learners with discrete actions."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import ArrayLike

from swarm_logistics_env.environment.commands import as_array
from swarm_logistics_env.environment.dict_view import ArrayStep
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import CommandError, SetupError

from .wrapper import Wrapper

_HALF = math.sqrt(0.5)

# Forward, left, turn, gripper of each action; one that drives or turns leaves the gripper as it is.
ACTIONS: Mapping[str, tuple[float, float, float, float]] = {
    "stay": (0.0, 0.0, 0.0, 0.0),
    "forward": (1.0, 0.0, 0.0, 0.0),
    "forward_left": (_HALF, _HALF, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0, 0.0),
    "back_left": (-_HALF, _HALF, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0, 0.0),
    "back_right": (-_HALF, -_HALF, 0.0, 0.0),
    "right": (0.0, -1.0, 0.0, 0.0),
    "forward_right": (_HALF, -_HALF, 0.0, 0.0),
    "turn_left": (0.0, 0.0, 1.0, 0.0),
    "turn_right": (0.0, 0.0, -1.0, 0.0),
    "hold": (0.0, 0.0, 0.0, 1.0),
    "open": (0.0, 0.0, 0.0, -1.0),
}


class DiscreteActions(Wrapper):
    """Commands robots by the numbers of `ACTIONS`: stay, eight directions, two turns, hold, open.

    For learners with discrete actions (DQN, QMIX, VDN). A robot drives and turns at full speed; a
    gripper stays as it is until the next "hold" or "open", and so lifts and carries while its robot
    drives. Nothing is broadcast but the timers (`message_size` numbers are zeros). Arrays of
    commands are (N,); stay is 0. It goes inside of `FixedAgents`.

    Args:
        env: the environment, or a wrapper of one.

    Raises:
        SetupError: it is something else, or its commands are numbers already.

    Example:
        >>> from swarm_logistics_env import swarm_logistics_v0
        >>> env = DiscreteActions(swarm_logistics_v0.parallel_env(n_robots=2))
        >>> env.action_space("robot_0")
        Discrete(13)
        >>> observations, infos = env.reset(seed=0)
        >>> observations, rewards, *_ = env.step({"robot_0": 1, "robot_1": 11})
    """

    def __init__(self, env: SwarmLogisticsEnv | Wrapper) -> None:
        super().__init__(env)
        told = env.action_space("robot_0")
        if not isinstance(told, Box):
            raise SetupError(f"env = {env}: its commands are {told}, should be a Box")
        self._space = Discrete(len(ACTIONS))
        self._commands = np.zeros((len(ACTIONS), *told.shape))
        self._commands[:, :4] = list(ACTIONS.values())

    def action_space(self, agent: str) -> Discrete:
        """Return the numbers of `ACTIONS`; the same space for all."""
        return self._space

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period with the numbers of actions (N,).

        Raises:
            CommandError: no whole numbers from 0 to 12, one for each robot.
            SetupError: there was no reset.
        """
        given, n_robots = as_array(commands, "actions"), self.n_rows
        if given.shape != (n_robots,) or given.dtype.kind not in "fiu":
            raise CommandError(
                f"actions of shape {given.shape} and type {given.dtype}: should be ({n_robots},) "
                "whole numbers"
            )
        is_action = np.isin(given, np.arange(len(ACTIONS)))
        if not is_action.all():
            robot = int(np.argmin(is_action))
            raise CommandError(
                f"action of robot_{robot} = {given[robot]}: should be a whole number from 0 to "
                f"{len(ACTIONS) - 1}"
            )
        return super().step_arrays(self._commands[given.astype(np.intp)])
