"""Observations and commands in the frame of each robot's motion, and commands by number."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Discrete
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import CommandError, SetupError
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.requests import checked_options, numbers_of
from swarm_logistics_env.environment.spaces import ArrayStep
from swarm_logistics_env.world import motion
from swarm_logistics_env.world.motion.actions import ACTIONS, MOTION_ACTIONS
from swarm_logistics_env.world.motion.frame import OUTPUTS
from swarm_logistics_env.world.motion.network_inputs import INPUT, INPUTS, N_OBSTACLES
from swarm_logistics_env.world.observations import N_BEAMS
from swarm_logistics_env.world.scenario import Scenario

from .wrapper import Wrapper


class MotionFrame(Wrapper):
    """Gives each robot a memory of its own, and turns what it reads and commands into its motion.

    Observations become rows of `motion.INPUTS` (95 numbers, most within -1 and 1): walls,
    neighbours, items and the lowest timer, relative to the direction in which the robot drives,
    and what it remembers, such as the way to the delivery area. Actions become rows of
    `motion.OUTPUTS`: along and aside, fractions of the top speed, and the gripper, all within -1
    and 1. A robot of the differential drive turns to where it wants to go. It is what
    `swarm-logistics train` learns on; rows of absent robots are zeros.

    It goes around whatever changes rows of the warehouse, and inside of `DiscreteActions`.

    Args:
        env: the environment, or a wrapper of one.
        listens: whether the lowest timer heard is read; zeros if not, so that no liar leads.

    Raises:
        SetupError: it is something else, or its rows or commands are not the warehouse's.

    Example:
        >>> from swarm_logistics_env import swarm_logistics_v0
        >>> env = MotionFrame(swarm_logistics_v0.parallel_env(n_robots=3))
        >>> observations, infos = env.reset(seed=0)
        >>> observations["robot_0"].shape, env.action_space("robot_0").shape
        ((95,), (3,))
    """

    def __init__(self, env: SwarmLogisticsEnv | Wrapper, listens: bool = True) -> None:
        super().__init__(env)
        rows = env.observation_space("robot_0")
        commands = env.action_space("robot_0")
        core = self.unwrapped
        row_shape = core.observation_space("robot_0").shape
        if commands != core.action_space("robot_0") or rows.shape != row_shape:
            raise SetupError(
                f"MotionFrame around {type(env).__name__}, whose rows are {rows.shape} and whose "
                f"commands are {commands}: should be around the warehouse's rows and commands, "
                f"as {type(env).__name__}(MotionFrame(env))"
            )
        self._listens = listens
        self._output_space = Box(-1.0, 1.0, (len(OUTPUTS),), np.float32)
        self._spaces_of: dict[frozenset[Scenario], Box] = {}

    def observation_space(self, agent: str) -> Box:
        """Return the space of a row of inputs (95,), the same for every agent."""
        scenarios = self.unwrapped.declared_scenarios
        if scenarios not in self._spaces_of:
            self._spaces_of[scenarios] = _input_space(scenarios)
        return self._spaces_of[scenarios]

    def action_space(self, agent: str) -> Box:
        """Return the space of along, aside and gripper (3,), the same for every agent."""
        return self._output_space

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first inputs (N, 95).

        Raises:
            SetupError: as `SwarmLogisticsEnv.reset_arrays`, or the robots are slower to lift or to
                gather speed than the space holds.
        """
        seed = self.env.next_seed if seed is None else seed
        scenario = self.scenario_of(seed, checked_options(options))
        most = self.observation_space("robot_0").high[_OF_BODIES]
        is_declared = scenario in self.unwrapped.declared_scenarios
        if not is_declared and (_input_space([scenario]).high[_OF_BODIES] > most).any():
            least = min(scenario.of_kinds("max_acceleration"))
            raise SetupError(
                f"handling_time = {scenario.handling_time}, max_speed = {scenario.highest_speed}, "
                f"max_acceleration = {least}: inputs could leave their space; "
                "should be declared by env.declare_spaces(scenario)"
            )
        return self._read(super().reset_arrays(seed, options))

    @property
    def turned(self) -> NDArray[np.float64]:
        """How far the frame of each robot's motion is turned from its body (N,) [rad]."""
        return self._frame.turned

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


_OF_BODIES = [INPUT.top_speed, INPUT.handling_time, INPUT.time_to_top_speed]
_NEVER_NEGATIVE = [
    *(f"wall_{beam}" for beam in range(N_BEAMS)),
    "requested_present", "requested_distance", "requested_nearness", "requested_recently_held",
    "lead_present", "lead_distance", "lead_timer",
    "carrying", "carrying_requested", "in_delivery_area", "timer_runs", "timer", "contact",
    "home_certainty", "failed", "stuck", "cannot_deliver", "cannot_lift", "delivering_in_vain",
    "items_in_view", "top_speed", "handling_time", "turns_to_drive", "time_to_top_speed",
]  # fmt: skip


def _input_space(scenarios: Iterable[Scenario]) -> Box:
    """Return the space of a row of inputs in all these scenarios; see `network_inputs`."""
    high = np.ones(len(INPUTS))
    for scenario in scenarios:
        # A vector whose parts are within a limit is longer by the root of 2.
        view = math.sqrt(2.0) * scenario.view_reach
        far = math.sqrt(2.0) * max(scenario.view_reach, scenario.radio_range)
        speed = math.sqrt(2.0) * scenario.highest_speed
        speeds = scenario.of_robots("max_speed")
        accelerations = scenario.of_robots("max_acceleration")
        most = {
            "requested_distance": view,
            "lead_distance": far / 4.0,
            "lead_timer": scenario.timer_limit / 10.0,
            "timer": scenario.timer_limit / 10.0,
            "velocity_along": speed / 2.0,
            "velocity_aside": speed / 2.0,
            "top_speed": scenario.highest_speed / 2.0,
            "handling_time": scenario.handling_time / 2.0,
            "time_to_top_speed": float((speeds / accelerations).max()),
        }
        for obstacle, part in product(range(N_OBSTACLES), ("along", "aside")):
            most[f"obstacle_{obstacle}_{part}"] = view
        for name, value in most.items():
            column = getattr(INPUT, name)
            high[column] = max(high[column], value)
    high *= 1.0 + 1e-5  # sines and cosines of single precision may pass 1
    low = -high
    low[[getattr(INPUT, name) for name in _NEVER_NEGATIVE]] = 0.0
    return Box(low.astype(np.float32), high.astype(np.float32))


STAY = 0
ACTION_MASK = "action_mask"


class DiscreteActions(Wrapper):
    """Commands robots by numbers: stay, eight directions, two turns, hold, open (`ACTIONS`).

    For learners with discrete actions (DQN, QMIX, MaskablePPO). A robot drives and turns at full
    speed; a gripper stays as it is until the next "hold" or "open", and so lifts and carries while
    its robot drives. Nothing is broadcast but the timers (`message_size` numbers are zeros). Arrays
    of commands are (N,); stay is 0. It goes inside of `FixedAgents`. Around a `MotionFrame` the
    directions are in the frame of motion, and there are no turns.

    An action is legal if it changes what a robot does: not "hold" of a gripper that holds already
    (nor "open" likewise), and not a direction in which a differential robot cannot drive; one that
    is absent may only stay. `action_masks` tells, and each agent's infos as "action_mask". Illegal
    ones are taken, too: they do nothing but what is legal.

    Args:
        env: the environment, or a wrapper of one.

    Attributes:
        actions: the names of the numbers.

    Raises:
        SetupError: it is something else, or its commands are numbers already.

    Example:
        >>> from swarm_logistics_env import swarm_logistics_v0
        >>> env = DiscreteActions(swarm_logistics_v0.parallel_env(n_robots=2))
        >>> env.action_space("robot_0")
        Discrete(13)
        >>> observations, infos = env.reset(seed=0)
        >>> observations, rewards, *_ = env.step({"robot_0": 1, "robot_1": 11})
        >>> env.actions[11], env.action_masks()[:, 11].tolist()
        ('hold', [True, False])
    """

    def __init__(self, env: SwarmLogisticsEnv | Wrapper) -> None:
        super().__init__(env)
        space = env.action_space("robot_0")
        if not isinstance(space, Box):
            raise SetupError(
                f"DiscreteActions around {type(env).__name__}, whose commands are {space}: should "
                "be around vectors"
            )
        self._is_of_motion = space.shape == (len(OUTPUTS),)
        table = MOTION_ACTIONS if self._is_of_motion else ACTIONS
        rows = np.array(list(table.values()))
        self.actions = tuple(table)
        self._space = Discrete(len(rows))
        self._commands = np.zeros((len(rows), *space.shape))
        self._commands[:, : rows.shape[1]] = rows
        self._grippers = rows[:, -1]
        self._goes_aside = rows[:, 1] != 0.0

    def action_space(self, agent: str) -> Discrete:
        """Return the numbers of `actions`; the same space for all."""
        return self._space

    def begun(self, seed: int) -> None:
        """Begin an episode with grippers that were never commanded."""
        self._gripper = np.zeros(self.warehouse.state.n_robots)

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period with the numbers of actions (N,).

        Raises:
            CommandError: no whole numbers of `actions`, one for each robot.
            SetupError: there was no reset.
        """
        numbers = numbers_of(commands, "actions", (self.n_rows,))
        is_action = np.isin(numbers, np.arange(len(self.actions)))
        if not is_action.all():
            robot = int(np.argmin(is_action))
            raise CommandError(
                f"action of robot_{robot} = {numbers[robot]}: should be a whole number from 0 to "
                f"{len(self.actions) - 1}"
            )
        chosen = numbers.astype(np.intp)
        outcome = super().step_arrays(self._commands[chosen])
        grippers = self._grippers[chosen]
        self._gripper = np.where(grippers == 0.0, self._gripper, grippers)
        return outcome

    def action_masks(self) -> NDArray[np.bool_]:
        """Return which actions are legal (N, actions); "stay" always is."""
        world = self.warehouse
        repeats = (self._grippers != 0.0) & (self._grippers == self._gripper[:, None])
        legal: NDArray[np.bool_] = ~repeats
        if not self._is_of_motion:
            legal &= world.state.is_holonomic[:, np.newaxis] | ~self._goes_aside
        legal[~world.state.robot_present, 1:] = False
        return legal

    @property
    def robot_info(self) -> dict[str, NDArray[Any]]:
        """It adds "action_mask", 1 for each legal action, else 0."""
        return {**self.env.robot_info, ACTION_MASK: self.action_masks().astype(np.int8)}
