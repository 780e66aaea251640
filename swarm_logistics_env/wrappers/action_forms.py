"""Commands in other forms: in the frame of each robot's motion, and by number."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env import motion
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import numbers_of
from swarm_logistics_env.environment.spaces import ArrayStep
from swarm_logistics_env.errors import CommandError, SetupError
from swarm_logistics_env.motion.frame import OUTPUTS
from swarm_logistics_env.motion.network_inputs import INPUTS
from swarm_logistics_env.streams import row_keys

from .wrapper import Wrapper


class MotionFrame(Wrapper):
    """Gives each robot a memory of its own, and turns what it reads and commands into its motion.

    Observations become rows of `motion.INPUTS` (94 numbers, most within -1 and 1): walls,
    neighbours, items and the lowest timer, relative to the direction in which the robot drives,
    and what it remembers, such as the way to the delivery area. Actions become rows of
    `motion.OUTPUTS`: along and aside, fractions of the top speed, and the gripper, all within -1
    and 1. A robot of the differential drive turns to where it wants to go. It is what
    `swarm-logistics train` learns on; rows of absent robots are zeros.

    Args:
        env: the environment, or a wrapper of one.
        listens: whether the lowest timer heard is read; zeros if not, so that no liar leads.

    Raises:
        SetupError: it is something else.

    Example:
        >>> from swarm_logistics_env import swarm_logistics_v0
        >>> env = MotionFrame(swarm_logistics_v0.parallel_env(n_robots=3))
        >>> observations, infos = env.reset(seed=0)
        >>> observations["robot_0"].shape, env.action_space("robot_0").shape
        ((94,), (3,))
    """

    def __init__(self, env: SwarmLogisticsEnv | Wrapper, listens: bool = True) -> None:
        super().__init__(env)
        self._listens = listens
        self._read_space = Box(-np.inf, np.inf, (len(INPUTS),), np.float32)
        self._output_space = Box(-1.0, 1.0, (len(OUTPUTS),), np.float32)

    def observation_space(self, agent: str) -> Box:
        """Return the space of a row of inputs (94,), the same for every agent."""
        return self._read_space

    def action_space(self, agent: str) -> Box:
        """Return the space of along, aside and gripper (3,), the same for every agent."""
        return self._output_space

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first inputs (N, 94)."""
        observations = super().reset_arrays(seed, options)
        return self._read(observations)

    def begun(self, seed: int) -> None:
        """Begin an episode of empty memories and random headings."""
        self._frame = motion.MotionView(self.warehouse.scenario, self._listens)
        self._frame.begin(row_keys(seed, "motion frame", self.warehouse.state.n_robots))

    def step_arrays(self, outputs: ArrayLike) -> ArrayStep:
        """Take one control period with outputs (N, 3); see `SwarmLogisticsEnv.step_arrays`.

        Raises:
            CommandError: wrong shape, not readable or not finite; nothing has happened then.
        """
        rows = numbers_of(outputs, "outputs", (self.n_rows, len(OUTPUTS)))
        if not np.isfinite(rows).all():
            raise CommandError(f"outputs = {rows}: should be finite")
        outcome = self.env.step_arrays(self._frame.command(rows))
        return (self._read(outcome[0]), *outcome[1:])

    def _read(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        inputs = self._frame.read(observations)
        inputs[~self.warehouse.state.robot_present] = 0.0
        return inputs


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
        space = env.action_space("robot_0")
        if not isinstance(space, Box):
            raise SetupError(f"env = {env}: its commands are {space}, should be a Box")
        self._space = Discrete(len(ACTIONS))
        self._commands = np.zeros((len(ACTIONS), *space.shape))
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
        numbers = numbers_of(commands, "actions", (self.n_rows,))
        is_action = np.isin(numbers, np.arange(len(ACTIONS)))
        if not is_action.all():
            robot = int(np.argmin(is_action))
            raise CommandError(
                f"action of robot_{robot} = {numbers[robot]}: should be a whole number from 0 to "
                f"{len(ACTIONS) - 1}"
            )
        return super().step_arrays(self._commands[numbers.astype(np.intp)])
