"""Biased walk: the controller of the simulator from which the paper's swarm grew.

Source: the tasks of `SOURCES["simulator"]` as of January 2021, described here by their equations.
Every 0.02 m a robot's stored heading turns by up to 0.5 rad. It drives at full speed along the sum
of a unit vector in that direction; of `bias`, if it carries a requested item, towards the delivery
area; and of pushes away from robots, from walls and, while it carries something, from items. No
push turns the stored heading. It lifts whatever comes into reach, and puts down at random moments
what is not requested. Rates are per metre here, so that slower robots walk the same way.

What it leans on: the published robots know where the delivery area lies, robots of this package
do not. `BiasedWalk` takes the direction in which a robot remembers to have entered, held against
the walls (`world.motion.memory.kept_home`); one that did not enter lately walks without a bias.
`BiasedWalkCompass` has a compass, as published. Walls are seen by 16 rangers, not as planes, and
of the robots within reach nobody sees which carry an item: published ones push twice as hard.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat, PositiveFloat

from swarm_logistics_env.compiler.kernels import kernel, uniform
from swarm_logistics_env.policies.policy import Scripted, ScriptParameters
from swarm_logistics_env.policies.row_policy import UNREAD, RowPolicy
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import MotionView
from swarm_logistics_env.world.motion.memory import fading, length_of, note_command, remember_row
from swarm_logistics_env.world.motion.steering import set_velocity, steer
from swarm_logistics_env.world.scenario import Scenario, of_first_robots
from swarm_logistics_env.world.warehouse.state import WarehouseState


class BiasedWalkParameters(ScriptParameters):
    """The published constants, in metres; a step of the source is 0.02 m."""

    diffusion: NonNegativeFloat = Field(
        0.5**2 / 3.0 / 0.02,
        description="of the stored heading [rad^2/m]; source: U(+-0.5 rad) a step",
    )
    drop_rate: NonNegativeFloat = Field(
        -math.log(0.97) / 0.02,
        description="of an item that is not requested [1/m]; source: 3 % a step",
    )
    bias: NonNegativeFloat = Field(
        1.0,
        description="towards the delivery area, in unit vectors, of who carries a requested item; "
        "source",
    )
    push: NonNegativeFloat = Field(
        9375.0,
        description="away from robots and items, times distance [1/m], shared by the N - 1 others; "
        "source: 15 x 6.25 / cm",
    )
    push_range: PositiveFloat = Field(
        0.0625, description="in which that push falls to 1 / e [m]; source: half a robot's radius"
    )
    wall_push: NonNegativeFloat = Field(
        100.0, description="away from walls at `wall_distance`, times distance [1/m]; source"
    )
    wall_distance: NonNegativeFloat = Field(
        0.125, description="where that push is as large as this [m]; source: exp(25 - 2 / cm)"
    )
    wall_range: PositiveFloat = Field(
        0.005, description="in which it falls to 1 / e [m]; source: 2 / cm"
    )


Parameters = BiasedWalkParameters.for_kernels()


class WalkConstants(NamedTuple):
    """What follows from parameters, swarm and bodies for one control period.

    Attributes:
        largest_turn: of the stored heading of each robot (N,) [rad].
        drop_probability: of an item that is not requested, of each robot (N,).
        push: away from robots and items, times distance [1/m].
        period: the control period [s].
    """

    largest_turn: NDArray[np.float64]
    drop_probability: NDArray[np.float64]
    push: float
    period: float


class BiasedWalk(RowPolicy, Scripted):
    """A random walk with a bias home, which a robot takes from where it remembers to have entered.

    Its keyword arguments are the fields of `BiasedWalkParameters`.

    Raises:
        PolicyError: a parameter is unknown or out of range.

    Example:
        >>> policy = BiasedWalk(bias=0.5)
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    parameters_type = BiasedWalkParameters
    parameters: BiasedWalkParameters
    stream = "biased walk"
    ignores = UNREAD | {
        "item_present", "item_requested", "item_recently_held", "neighbour_present",
        "lowest_timer_present", "lowest_timer_x", "lowest_timer_y", "lowest_timer", "timer_runs",
        "timer", "contact",
    }  # fmt: skip

    def configure(self, scenario: Scenario) -> None:
        """Take what the maker of a robot knows: its speed and control period, and the swarm."""
        parameters = self.parameters
        # Of the first robots, whose kinds repeat.
        strides = [body.max_speed * body.control_period for body in of_first_robots(scenario)]
        turns = [math.sqrt(3.0 * parameters.diffusion * stride) for stride in strides]
        drops = [-math.expm1(-parameters.drop_rate * stride) for stride in strides]
        self._of_first = WalkConstants(
            largest_turn=np.array(turns),
            drop_probability=np.array(drops),
            push=parameters.push / max(scenario.n_robots - 1, 1),
            period=scenario.control_period,
        )
        self._values = parameters.values()
        self._frame = MotionView(scenario)

    def begin(self, keys: NDArray[np.uint64]) -> None:
        """Begin an episode with random stored headings."""
        self._frame.begin(keys)
        self._constants = self._of_first._replace(
            largest_turn=np.resize(self._of_first.largest_turn, len(keys)),
            drop_probability=np.resize(self._of_first.drop_probability, len(keys)),
        )
        self._heading = np.array([math.tau * uniform(key, 0) for key in keys])
        self._compass = np.empty((0, 2))

    def memories(self) -> dict[str, NDArray[Any]]:
        """Return all that robots remember, their stored headings [rad] last."""
        return self._frame.memories() | {"stored_heading": self._heading}

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D).

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`.
        """
        frame = self._frame
        frame.check(observations)
        frame.counts += 1
        commands = np.empty((len(observations), 4))
        act_biased_walk(
            observations, self._compass, frame.memory, frame.keys, frame.counts, self._values,
            self._constants, self._heading, commands,
        )  # fmt: skip
        return commands


class BiasedWalkCompass(BiasedWalk):
    """The biased walk with a compass, as published; for an empty room, and it needs the state.

    No row has a compass, so it is read off the state: robots that do not hear get no commands, as
    those of any controller that needs the state.
    """

    needs_state = True

    def act(
        self, observations: NDArray[np.float32], state: WarehouseState | None = None
    ) -> NDArray[np.float64]:
        """Return commands (N, 4) for rows (N, D) and a state; without one, as `BiasedWalk`.

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`.
        """
        if state is not None:
            heading = state.robot_heading
            # The delivery area lies where x is highest.
            self._compass = np.column_stack([np.cos(heading), -np.sin(heading)])
        return super().act(observations)


@kernel
def act_biased_walk(
    rows: NDArray[np.float32],
    compass: NDArray[np.float64],
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    values: tuple[float, ...],
    constants: WalkConstants,
    heading: NDArray[np.float64],
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) from rows (N, D); memories and stored headings (N,) go on.

    Args:
        compass: the direction of the delivery area in each robot's frame (N, 2); none: (0, 2).
        counts: the decisions of each robot, this one among them (N,).
        values: of the fields of `BiasedWalkParameters`.
    """
    parameters = Parameters(*values)
    period = constants.period
    fades = fading(period)
    for robot in range(rows.shape[0]):
        observation = rows[robot]
        memory = memories[robot]
        home_x, home_y, _ = remember_row(observation, period, fades, memory)
        if len(compass) > 0:
            home_x, home_y = compass[robot]
        carries = observation[row.CARRYING] > 0.5
        delivers = observation[row.CARRYING_REQUESTED] > 0.5
        share = 2.0 * uniform(keys[robot], 2 * counts[robot]) - 1.0
        body_turn = period * np.float64(observation[row.TURN_RATE])
        heading[robot] += constants.largest_turn[robot] * share - body_turn
        x = math.cos(heading[robot])
        y = math.sin(heading[robot])
        if delivers:
            x += parameters.bias * home_x
            y += parameters.bias * home_y
        push_x, push_y = push_away(
            observation, row.NEIGHBOURS, row.N_NEIGHBOURS, constants.push, parameters.push_range
        )
        x += push_x
        y += push_y
        if carries:
            push_x, push_y = push_away(
                observation, row.ITEMS, row.N_ITEMS_IN_VIEW, constants.push, parameters.push_range
            )
            x += push_x
            y += push_y
        push_x, push_y = push_off_walls(observation, parameters)
        x += push_x
        y += push_y
        number = uniform(keys[robot], 2 * counts[robot] + 1)
        drops = carries and not delivers and number < constants.drop_probability[robot]
        set_velocity(x, y, 1.0, -1.0 if drops else 1.0, commands[robot])
        note_command(observation, commands[robot], memory)
        steer(memory, commands[robot])


@kernel
def push_away(
    observation: NDArray[np.float32], first: int, count: int, push: float, reach: float
) -> tuple[float, float]:
    """Return the push away from the things in a block of (present, x, y, ..) columns.

    `push` exp(-d / `reach`) times the vector from each thing to the robot, of length d.
    """
    push_x = 0.0
    push_y = 0.0
    for number in range(count):
        # A neighbour is as wide, and begins with the same columns; absent ones are zeros.
        column = first + row.ITEM_WIDTH * number
        x = observation[column + row.ITEM.x]
        y = observation[column + row.ITEM.y]
        strength = np.float64(push * math.exp(-np.float64(length_of(x, y)) / reach))
        push_x -= strength * x
        push_y -= strength * y
    return push_x, push_y


@kernel
def push_off_walls(
    observation: NDArray[np.float32], parameters: BiasedWalkParameters
) -> tuple[float, float]:
    """Return the push away from walls, each along the beam that meets it at the least distance."""
    push_x = 0.0
    push_y = 0.0
    walls = observation[row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
    for beam in range(row.N_BEAMS):
        distance = np.float64(walls[beam])
        if distance <= walls[beam - 1] and distance < walls[(beam + 1) % row.N_BEAMS]:
            nearness = (parameters.wall_distance - distance) / parameters.wall_range
            push = parameters.wall_push * distance * math.exp(nearness)
            angle = 2.0 * math.pi * beam / row.N_BEAMS
            push_x -= push * math.cos(angle)
            push_y -= push * math.sin(angle)
    return push_x, push_y
