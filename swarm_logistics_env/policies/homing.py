"""Homing: a scripted swarm whose robots remember in which direction the delivery area lies.

SEARCH: straight ahead, away from neighbours; lifts nothing but the requested item. DELIVER: in the
direction in which the robot itself entered the delivery area before, and towards the lowest timer
heard as long as it has entered rarely; of 32 directions it takes the one that fits best and is
free. A robot that stands still drives in a random direction for a moment. One that has met a
failure of its own leaves requested items to others, and lets go inside the area.

What it leans on: the remembered direction is kept in the robot's own frame, which drifts, so the
memory fades within ten seconds. Swarm D-T remembers no direction and does not need it. This policy
commands no turn; a robot of the differential drive turns to where it wants to go, see
`world.motion.steering.steer`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.policies.driving import (
    LET_GO,
    LIFT,
    AvoidGain,
    AvoidRange,
    Clearance,
    DrivingParameters,
    ObstacleRange,
    SpreadGain,
    SpreadRange,
    Sure,
    WallGain,
    WallRange,
    avoid_neighbours,
    fetch,
    freest_direction,
    home_direction,
    requested_item,
    search,
)
from swarm_logistics_env.policies.policy import Scripted
from swarm_logistics_env.policies.row_policy import UNREAD, RowPolicy
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import MotionView, command_own_frames
from swarm_logistics_env.world.motion.memory import MEMORY, has_failed
from swarm_logistics_env.world.motion.network_inputs import random_heading, turn_frames
from swarm_logistics_env.world.motion.steering import set_velocity
from swarm_logistics_env.world.scenario import Scenario


class HomingParameters(DrivingParameters):
    """The parameters of `Homing`."""

    spread_gain: SpreadGain = 0.2863
    spread_range: SpreadRange = 3.767
    avoid_gain: AvoidGain = 2.149
    avoid_range: AvoidRange = 0.2247
    wall_gain: WallGain = 4.609
    wall_range: WallRange = 0.3258
    sure: Sure = 4.061
    clearance: Clearance = 0.2135
    obstacle_range: ObstacleRange = 0.6606

    # What two searches of `research/search_again.py` found in `dotbots`, one after the other.
    of_small_robots: ClassVar[Mapping[str, float]] = {
        "spread_gain": 11.1, "spread_range": 0.445, "avoid_gain": 0.212, "avoid_range": 0.858,
        "wall_gain": 0.233, "wall_range": 1.1, "sure": 1.94, "clearance": 1.22,
        "obstacle_range": 0.233,
    }  # fmt: skip


Parameters = HomingParameters.for_kernels()


@kernel
def act_homing(
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    turned: NDArray[np.float64],
    period: float,
    values: tuple[float, ...],
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) of a step of `Homing`; memories and counts go on.

    One kernel a step, because each call of a kernel costs more than a microsecond.

    Args:
        values: of the fields of `HomingParameters`.
    """
    turn_frames(rows, period, memories, turned)
    counts += 1
    decide_homing(rows, memories, keys, counts, period, Parameters(*values), commands)
    command_own_frames(commands, turned, rows, memories)


@kernel
def decide_homing(
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    period: float,
    parameters: HomingParameters,
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4), in the robots' own frames, from rows (N, D) and memories.

    `counts` (N,) are the decisions of each robot, this one among them.
    """
    for robot in range(rows.shape[0]):
        observation = rows[robot]
        memory = memories[robot]
        is_inside = observation[row.IN_DELIVERY_AREA] > 0.5
        x = memory[MEMORY.heading_x]
        y = memory[MEMORY.heading_y]
        push_x, push_y = avoid_neighbours(observation, parameters)
        speed = 1.0
        gripper = LET_GO
        if observation[row.CARRYING_REQUESTED] > 0.5:
            # Inside it stands, and lets go only once it takes its delivery for broken.
            if not is_inside or not has_failed(memory):
                gripper = LIFT
            speed = 0.0 if is_inside and gripper == LIFT else 1.0
            if memory[MEMORY.stuck] > 0.0:
                angle = random_heading(keys[robot], counts[robot] - 1, period)
                x = math.cos(angle)
                y = math.sin(angle)
            elif not is_inside:
                x, y = home_direction(observation, memory, x, y, parameters)
            x, y = freest_direction(observation, memory, x + push_x, y + push_y, parameters)
        else:
            item = requested_item(observation, memory, is_inside)
            if item >= 0 and observation[row.CARRYING] < 0.5:
                x, y, speed, gripper = fetch(observation, item, push_x, push_y, period, parameters)
            else:
                x, y, speed, gripper = search(
                    observation, memory, x, y, push_x, push_y, is_inside, parameters
                )
        set_velocity(x, y, speed, gripper, commands[robot])


class Homing(RowPolicy, Scripted):
    """Every robot remembers for some ten seconds where it last entered the delivery area.

    Its keyword arguments are the fields of `HomingParameters`.

    Raises:
        PolicyError: a parameter is unknown or out of range.

    Example:
        >>> policy = Homing()
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    parameters_type: ClassVar[type[DrivingParameters]] = HomingParameters
    parameters: DrivingParameters
    stream = "homing"
    ignores = UNREAD | {"neighbour_present", "lowest_timer", "timer", "timer_runs", "contact"}
    _fill_commands: ClassVar[Callable[..., None]] = staticmethod(act_homing)

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows: the control period, and how large robots are."""
        self._period = scenario.control_period
        self._frame = MotionView(scenario)
        self.fit_to(scenario)

    def fit_to(self, swarm: Scenario) -> None:
        """Take how large the largest robots are."""
        self._values = self.parameters.scaled_to(swarm).values()

    def begin(self, keys: NDArray[np.uint64]) -> None:
        """Begin an episode with random headings and empty memories."""
        self._frame.begin(keys)

    def memories(self) -> dict[str, NDArray[Any]]:
        """Return all that robots remember, see `MotionView.memories`."""
        return self._frame.memories()

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D).

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`.
        """
        self._frame.check(observations)
        commands = np.empty((len(observations), 4))
        frame = self._frame
        self._fill_commands(
            observations, frame.memory, frame.keys, frame.counts, frame.turned, self._period,
            self._values, commands,
        )  # fmt: skip
        return commands
