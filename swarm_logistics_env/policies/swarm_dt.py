"""Swarm Diffusion-Taxis: the scripted swarm of the paper, from observation rows alone.

The paper describes it in a paragraph; its full description and code are not public, so what
follows beyond that paragraph is inferred, and each parameter says from where.

SEARCH (empty): random walk, avoiding robots and walls, lifting what comes into reach.
SHUFFLE (another item than the requested one): the same, avoiding items too, and putting it down
at random moments. DELIVER (the requested item): never puts it down; where a neighbour tells its
timer, moves towards the one that tells the lowest.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat

from swarm_logistics_env.compiler.kernels import kernel, uniform
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.policy import Scripted, ScriptParameters
from swarm_logistics_env.policies.row_policy import UNREAD, RowPolicy
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import length_of
from swarm_logistics_env.world.scenario import Scenario, of_first_robots


class SwarmDTParameters(ScriptParameters):
    """The constants of Swarm D-T.

    Where a description ends with "fitted", the default is of the fit `shipped` of
    docs/research/paper_fit.md, to the paper's cells without a failed robot. "simulator" is that of
    the paper's author, which draws the noise of the heading and the drop both once a step.
    `CONSTANTS_2026` are those before, which were fitted by hand to all of the paper's tables.
    """

    diffusion: NonNegativeFloat = Field(
        0.07057, description="of the stored heading [rad^2/s]; fitted"
    )
    avoidance_gain: NonNegativeFloat = Field(
        0.863, description="away from each near robot, in top speeds at distance 0; fitted"
    )
    avoidance_range: NonNegativeFloat = Field(
        0.3472, description="where avoidance begins [m]; fitted"
    )
    item_avoidance_gain: NonNegativeFloat = Field(
        0.3102, description="the same away from each near item, while it carries one; fitted"
    )
    item_avoidance_range: NonNegativeFloat = Field(
        0.7016, description="where the avoidance of items begins [m]; fitted"
    )
    wall_distance: NonNegativeFloat = Field(
        0.139, description="reflects the stored heading at a wall nearer than this [m]; fitted"
    )
    taxis_gain: NonNegativeFloat = Field(
        0.3043, description="towards the lowest timer heard, in top speeds; fitted"
    )
    drop_rate: NonNegativeFloat = Field(
        0.7823, description="of an item that is not requested [1/s]; fitted"
    )
    heading_follows: bool = Field(
        False, description="whether avoidance and taxis turn the stored heading; fitted"
    )
    full_speed: bool = Field(
        True,
        description="always drives at its top speed; else it slows where the pushes on it cancel "
        "each other; source: simulator",
    )
    scales: bool = Field(
        False, description="whether all go with the radius and the top speed of robots; fitted"
    )

    # What the search of `research/search_again.py` found in `dotbots`.
    of_small_robots: ClassVar[Mapping[str, float]] = {
        "diffusion": 0.852, "avoidance_gain": 0.738, "avoidance_range": 3.7,
        "item_avoidance_gain": 3.91, "item_avoidance_range": 3.36, "wall_distance": 0.395,
        "taxis_gain": 2.14, "drop_rate": 0.394,
    }  # fmt: skip
    # Part of what that search found in the paper's world: all of it cost a swarm of 10 a quarter.
    of_fast_robots: ClassVar[Mapping[str, float]] = {
        "diffusion": 5.15, "avoidance_gain": 0.67, "avoidance_range": 9.78,
        "item_avoidance_gain": 2.36, "item_avoidance_range": 1.2, "wall_distance": 2.26,
        "taxis_gain": 1.76, "drop_rate": 2.77,
    }  # fmt: skip


# The simulator's noise, U(+-0.5 rad) in a step of 0.06 s, and its drop, 3 % in one of 0.02 s.
CONSTANTS_2026 = {
    "diffusion": 1.39,
    "avoidance_gain": 2.0,
    "avoidance_range": 0.5,
    "item_avoidance_gain": 2.0,
    "item_avoidance_range": 0.5,
    "wall_distance": 0.2,
    "taxis_gain": 0.75,
    "drop_rate": 1.5,
    "full_speed": False,
}

# Of two searches for the most deliveries, `research/tune.py` and then `research/search_again.py`,
# that which delivers more in their twelve worlds; not of the paper's tables.
CONSTANTS_TUNED = {
    "diffusion": 0.0998,
    "avoidance_gain": 1.076,
    "avoidance_range": 0.3872,
    "item_avoidance_gain": 0.9757,
    "item_avoidance_range": 0.8559,
    "wall_distance": 0.4332,
    "taxis_gain": 3.149,
    "drop_rate": 1.297,
    "scales": True,
}


Parameters = SwarmDTParameters.for_kernels()


class StepConstants(NamedTuple):
    """What follows from parameters and the robot's body for one control period.

    Attributes:
        turn_by_diffusion: the largest turn of the stored heading [rad].
        drop_probability: the probability to drop an item that is not requested.
        turn_of_body: the largest turn of a differential robot's body [rad]; 0 if it is holonomic.
    """

    turn_by_diffusion: float
    drop_probability: float
    turn_of_body: float


def turn_of_body(scenario: Scenario) -> float:
    """Return how far a robot's body turns in a control period [rad]; 0 if it never has to."""
    if scenario.drive == "holonomic":
        return 0.0
    return scenario.max_turn_rate * scenario.control_period


class SwarmDT(RowPolicy, Scripted):
    """Swarm Diffusion-Taxis: a robot with the requested item follows the lowest timer it hears.

    Its keyword arguments are the fields of `SwarmDTParameters`.

    Raises:
        PolicyError: a parameter is unknown or out of range.

    Example:
        >>> policy = SwarmDT(taxis_gain=0.5)
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    parameters_type = SwarmDTParameters
    parameters: SwarmDTParameters
    stream = "swarm D-T"
    ignores = UNREAD | {
        "item_requested", "item_recently_held", "lowest_timer", "in_delivery_area", "timer_runs",
        "timer", "velocity", "contact", "turn_rate",
    }  # fmt: skip

    def configure(self, scenario: Scenario) -> None:
        """Take what the maker of a robot knows: its control period and how it drives."""
        self._period = scenario.control_period
        self._turns = [turn_of_body(body) for body in of_first_robots(scenario)]
        self.fit_to(scenario)

    def fit_to(self, swarm: Scenario) -> None:
        """Take how large and how fast robots are, if parameters go with it."""
        scales = self.parameters.scales
        parameters = self.parameters.scaled_to(swarm) if scales else self.parameters
        self._values = parameters.values()
        self._constants = StepConstants(
            turn_by_diffusion=math.sqrt(3.0 * parameters.diffusion * self._period),
            drop_probability=-math.expm1(-parameters.drop_rate * self._period),
            turn_of_body=self._turns[0],
        )

    def begin(self, keys: NDArray[np.uint64]) -> None:
        """Begin an episode; the first step draws the stored headings."""
        self._keys = keys
        turns = np.resize(self._turns, len(keys))
        # Robots whose bodies turn alike decide together.
        self._groups: list[tuple[StepConstants, slice | NDArray[np.intp]]] = [
            (self._constants._replace(turn_of_body=turn), np.flatnonzero(turns == turn))
            for turn in np.unique(turns).tolist()
        ]
        if len(self._groups) < 2:
            self._groups = [(self._constants, slice(None))]
        self._heading = np.full(len(keys), np.nan)
        self._step = 0

    def memories(self) -> dict[str, NDArray[Any]]:
        """Return the stored headings [rad], and the number of steps."""
        return {"heading": self._heading, "steps": np.full(len(self._keys), self._step)}

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D)."""
        if observations.shape[0] != self._heading.shape[0]:
            raise PolicyError(
                f"observations of {observations.shape[0]} robots: reset was told "
                f"{self._heading.shape[0]}"
            )
        commands = np.empty((observations.shape[0], 4))
        for constants, robots in self._groups:
            heading = self._heading[robots]
            of_group = commands[robots]
            decide_swarm_dt(
                observations[robots], self._keys[robots], self._step, self._values, constants,
                heading, of_group,
            )  # fmt: skip
            self._heading[robots] = heading
            commands[robots] = of_group
        self._step += 1
        return commands


@kernel
def decide_swarm_dt(
    observations: NDArray[np.float32],
    keys: NDArray[np.uint64],
    step: int,
    values: tuple[float, ...],
    constants: StepConstants,
    heading: NDArray[np.float64],
    commands: NDArray[np.float64],
) -> None:
    """Fill each robot's command (N, 4) from its own row, its own stream and stored heading.

    Args:
        values: of the fields of `SwarmDTParameters`.
    """
    parameters = Parameters(*values)
    for robot in range(observations.shape[0]):
        observation = observations[robot]
        carries = observation[row.CARRYING] > 0.5
        delivers = observation[row.CARRYING_REQUESTED] > 0.5
        if math.isnan(heading[robot]):
            heading[robot] = (2.0 * uniform(keys[robot], 0) - 1.0) * math.pi
        share = 2.0 * uniform(keys[robot], 2 * step + 1) - 1.0
        heading[robot] += constants.turn_by_diffusion * share
        x = math.cos(heading[robot])
        y = math.sin(heading[robot])

        walls = observation[row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
        nearest = np.argmin(walls)
        if walls[nearest] < parameters.wall_distance:
            towards = 2.0 * math.pi * nearest / row.N_BEAMS
            wall_x = math.cos(towards)
            wall_y = math.sin(towards)
            approach = x * wall_x + y * wall_y
            if approach > 0.0:
                x -= 2.0 * approach * wall_x
                y -= 2.0 * approach * wall_y
                heading[robot] = math.atan2(y, x)

        gain = parameters.avoidance_gain
        reach = parameters.avoidance_range
        push_x, push_y = avoid(observation, row.NEIGHBOURS, row.N_NEIGHBOURS, gain, reach)
        x += push_x
        y += push_y
        if carries:
            gain = parameters.item_avoidance_gain
            reach = parameters.item_avoidance_range
            push_x, push_y = avoid(observation, row.ITEMS, row.N_ITEMS_IN_VIEW, gain, reach)
            x += push_x
            y += push_y
        if delivers and observation[row.LOWEST_TIMER] > 0.5:
            lead_x = observation[row.LOWEST_TIMER_X]
            lead_y = observation[row.LOWEST_TIMER_Y]
            distance = length_of(lead_x, lead_y)
            if distance > 0.0:
                x += parameters.taxis_gain * np.float64(lead_x) / distance
                y += parameters.taxis_gain * np.float64(lead_y) / distance
        if parameters.heading_follows:
            heading[robot] = math.atan2(y, x)

        length = math.sqrt(x * x + y * y)
        norm = length if parameters.full_speed and length > 0.0 else max(length, 1.0)
        commands[robot, 0] = x / norm
        commands[robot, 1] = y / norm
        commands[robot, 2] = 0.0
        if constants.turn_of_body > 0.0:
            # It turns towards where it wants to go and drives as far as it then faces that way;
            # the stored heading is kept in the robot's frame, so it turns back by as much.
            direction = math.atan2(y, x)
            speed = math.sqrt(x * x + y * y) / norm
            turn = min(max(direction, -constants.turn_of_body), constants.turn_of_body)
            commands[robot, 0] = speed * max(math.cos(direction - turn), 0.0)
            commands[robot, 1] = 0.0
            commands[robot, 2] = turn / constants.turn_of_body
            heading[robot] -= turn
        lets_go = (
            carries
            and not delivers
            and uniform(keys[robot], 2 * step + 2) < constants.drop_probability
        )
        commands[robot, 3] = -1.0 if lets_go else 1.0


@kernel
def avoid(
    observation: NDArray[np.float32], first: int, count: int, gain: float, reach: float
) -> tuple[float, float]:
    """Return the push away from the things in a block of (present, x, y, ..) columns."""
    push_x = 0.0
    push_y = 0.0
    for number in range(count):
        # A neighbour is as wide, and begins with the same columns.
        column = first + row.ITEM_WIDTH * number
        if observation[column + row.ITEM.present] < 0.5:
            break
        x = observation[column + row.ITEM.x]
        y = observation[column + row.ITEM.y]
        distance = length_of(x, y)
        if distance >= reach:
            break
        if distance > 0.0:
            push = gain * (1.0 - np.float64(distance) / reach) / distance
            push_x -= push * x
            push_y -= push * y
    return push_x, push_y
