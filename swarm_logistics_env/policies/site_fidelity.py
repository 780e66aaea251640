"""Site fidelity: the central-place forager of Hecker and Moses, without its pheromones.

Source: J. P. Hecker and M. E. Moses, Beyond pheromones: evolving error-tolerant, flexible, and
scalable ant-inspired robot swarms, Swarm Intelligence 9, 43-70 (2015), equations 1 to 4. The paper
prints no evolved constants; these are the ones that their laboratory's later repository
BCLab-UNM/CPFA-ARGoS plays where targets lie evenly spread (experiments/CPFAU60min*.xml).

A robot leaves the delivery area in a random direction, and at some moment begins to search: its
heading turns by normal noise. It may give up, and returns. Where it lifts an item it counts those
that lie around, and notes the site. After a delivery it goes back to its site with a probability
that grows with that count; there it searches by wide turns, which narrow with time.
Pheromones, way-points that all robots read in the nest, are left out, as no place is shared here.

What it leans on: published robots know the nest's place by a compass and odometry. Here a robot
reckons its site by odometry in a frame that is held against the walls (`world.motion.memory`), and
drives home, fetches, keeps apart and avoids as `homing` does, so that the two differ by their
search alone. Any item may be asked for next, so each that lies around a site is counted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeFloat

from swarm_logistics_env.compiler.kernels import gaussian, kernel, pair_key, uniform
from swarm_logistics_env.policies.driving import (
    LET_GO,
    avoid_neighbours,
    home_direction,
    requested_item,
    search_direction,
)
from swarm_logistics_env.policies.homing import Homing, HomingParameters, decide_homing
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import command_own_frames
from swarm_logistics_env.world.motion.memory import MEMORY, is_out, length_of, to_frame
from swarm_logistics_env.world.motion.network_inputs import turn_frames
from swarm_logistics_env.world.motion.steering import set_velocity

Probability = Annotated[float, Field(ge=0.0, lt=1.0)]
STEP = 0.08  # [m] of the source, whose rates are per step
SEARCH_STREAM = 1  # number of the stream beside the robot's own
WIDEST_TURN = 4.0 * math.pi  # standard deviation of a turn on arrival at a site [rad]


class SiteFidelityParameters(HomingParameters):
    """The parameters of `SiteFidelity`: those of `Homing`, and the published ones.

    A step is 0.08 m at top speed.
    """

    of_small_robots: ClassVar[Mapping[str, float]] = {}  # those of `Homing` are of its own search

    search_rate: Probability = Field(
        0.504, description="probability to begin the search, a step of the way out; source"
    )
    give_up_rate: Probability = Field(
        0.001, description="probability to give the search up, a step; source"
    )
    turn: NonNegativeFloat = Field(
        math.radians(7.0),
        description="standard deviation of a turn in a search, a step [rad]; source",
    )
    turn_decay: NonNegativeFloat = Field(
        0.28, description="at which turns at a site narrow to `turn` [1/step]; source"
    )
    site_rate: NonNegativeFloat = Field(
        4.27,
        description="items: the site is sought again with the Poisson probability of no more than "
        "were counted, at this mean; source",
    )
    site_range: NonNegativeFloat = Field(
        0.5, description="in which items are counted [m]; source: 4 radii of an item"
    )


Parameters = SiteFidelityParameters.for_kernels()


class TripColumns(NamedTuple):
    """The columns of trips (N, N_TRIP_COLUMNS) of N robots."""

    mode: int
    x: int  # where it is by its odometry, in the frame of `MEMORY.wall` [m]
    y: int
    site_x: int  # where it last lifted a requested item [m]
    site_y: int
    n_around: int  # items that lay around that site, that one among them
    searched: int  # steps since it arrived at the site


N_TRIP_COLUMNS = len(TripColumns._fields)
TRIP = TripColumns(*range(N_TRIP_COLUMNS))

# The modes.
LEAVES = 0.0
SEARCHES = 1.0
GOES_TO_SITE = 2.0
SEARCHES_SITE = 3.0
GIVES_UP = 4.0
BRINGS = 5.0


class SiteFidelity(Homing):
    """Homing that searches as central-place foragers do, and returns to sites with many items.

    Its keyword arguments are the fields of `SiteFidelityParameters`.

    Raises:
        PolicyError: a parameter is unknown or out of range.

    Example:
        >>> policy = SiteFidelity()
        >>> policy.reset(n_robots=3, seed=0)
        >>> policy.act(np.zeros((3, row.N_COLUMNS), np.float32)).shape
        (3, 4)
    """

    parameters_type = SiteFidelityParameters
    parameters: SiteFidelityParameters

    def begin(self, keys: NDArray[np.uint64]) -> None:
        """Begin an episode: all leave, in random directions, with empty memories."""
        super().begin(keys)
        self._trips = np.zeros((len(keys), N_TRIP_COLUMNS))

    def memories(self) -> dict[str, NDArray[Any]]:
        """Return all that robots remember, their trips last."""
        trips = zip(TripColumns._fields, self._trips.T, strict=True)
        return super().memories() | {f"trip_{name}": values for name, values in trips}

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D).

        Raises:
            PolicyError: there are more or fewer rows than robots at `reset`.
        """
        frame = self._frame
        frame.check(observations)
        commands = np.empty((len(observations), 4))
        act_site_fidelity(
            observations, frame.memory, self._trips, frame.keys, frame.counts, frame.turned,
            self._period, self._values, commands,
        )  # fmt: skip
        return commands


@kernel
def act_site_fidelity(
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    trips: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    turned: NDArray[np.float64],
    period: float,
    values: tuple[float, ...],
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) of a control period; memories, trips and counts go on.

    `values` are those of the fields of `SiteFidelityParameters`.
    """
    turn_frames(rows, period, memories, turned)
    counts += 1
    parameters = Parameters(*values)
    decide_homing(rows, memories, keys, counts, period, parameters, commands)
    for robot in range(rows.shape[0]):
        observation = rows[robot]
        memory = memories[robot]
        n_steps = memory[MEMORY.top_speed] * period / STEP  # of the source in a control period
        key = pair_key(keys[robot], SEARCH_STREAM)
        is_inside = observation[row.IN_DELIVERY_AREA] > 0.5
        if is_out(observation):
            trips[robot, :] = 0.0
        go_on(observation, memory, period, n_steps, key, counts[robot], trips[robot], parameters)
        carries = observation[row.CARRYING] > 0.5
        delivers = observation[row.CARRYING_REQUESTED] > 0.5
        if delivers or (not carries and requested_item(observation, memory, is_inside) >= 0):
            continue  # homing brings or fetches it
        x, y = way_of_search(
            observation, memory, n_steps, key, counts[robot], trips[robot], parameters
        )
        x, y = search_direction(observation, memory, x, y, is_inside, parameters)
        push_x, push_y = avoid_neighbours(observation, parameters)
        set_velocity(x + push_x, y + push_y, 1.0, LET_GO, commands[robot])
    command_own_frames(commands, turned, rows, memories)


@kernel
def go_on(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    period: float,
    n_steps: float,
    key: np.uint64,
    count: int,
    trip: NDArray[np.float64],
    parameters: SiteFidelityParameters,
) -> None:
    """Reckon a robot's place, and change the mode of its trip where that is over."""
    wall = memory[MEMORY.wall]
    velocity_x = float(observation[row.VELOCITY_X])
    velocity_y = float(observation[row.VELOCITY_Y])
    along, aside = to_frame((math.cos(wall), math.sin(wall)), velocity_x, velocity_y)
    trip[TRIP.x] += period * along
    trip[TRIP.y] += period * aside
    mode = trip[TRIP.mode]
    number = uniform(key, 4 * count)
    if observation[row.CARRYING_REQUESTED] > 0.5:
        if mode != BRINGS:
            trip[TRIP.site_x] = trip[TRIP.x]
            trip[TRIP.site_y] = trip[TRIP.y]
            trip[TRIP.n_around] = 1.0 + items_around(observation, parameters.site_range)
            trip[TRIP.mode] = BRINGS
    elif mode in (GIVES_UP, BRINGS):
        if observation[row.IN_DELIVERY_AREA] > 0.5:
            again = poisson_at_most(trip[TRIP.n_around], parameters.site_rate)
            returns = mode == BRINGS and number < again
            trip[TRIP.mode] = GOES_TO_SITE if returns else LEAVES
            angle = 2.0 * math.pi * uniform(key, 4 * count + 1)
            memory[MEMORY.heading_x] = math.cos(angle)
            memory[MEMORY.heading_y] = math.sin(angle)
    elif mode == LEAVES:
        if number < 1.0 - (1.0 - parameters.search_rate) ** n_steps:
            trip[TRIP.mode] = SEARCHES
    elif mode == GOES_TO_SITE:
        to_x = trip[TRIP.site_x] - trip[TRIP.x]
        to_y = trip[TRIP.site_y] - trip[TRIP.y]
        if length_of(to_x, to_y) < n_steps * STEP:
            trip[TRIP.mode] = SEARCHES_SITE
            trip[TRIP.searched] = 0.0
    elif number < 1.0 - (1.0 - parameters.give_up_rate) ** n_steps:
        trip[TRIP.mode] = GIVES_UP


@kernel
def way_of_search(
    observation: NDArray[np.float32],
    memory: NDArray[np.float64],
    n_steps: float,
    key: np.uint64,
    count: int,
    trip: NDArray[np.float64],
    parameters: SiteFidelityParameters,
) -> tuple[float, float]:
    """Return the direction of a robot without a requested item, in its own frame."""
    mode = trip[TRIP.mode]
    x = memory[MEMORY.heading_x]
    y = memory[MEMORY.heading_y]
    if mode in (GIVES_UP, BRINGS):  # it lost what it brought
        return home_direction(observation, memory, x, y, parameters)
    if mode == GOES_TO_SITE:
        wall = memory[MEMORY.wall]
        to_x = trip[TRIP.site_x] - trip[TRIP.x]
        to_y = trip[TRIP.site_y] - trip[TRIP.y]
        x, y = to_frame((math.cos(wall), -math.sin(wall)), to_x, to_y)
        length = max(length_of(x, y), 1e-9)
        return x / length, y / length
    if mode == LEAVES:
        return x, y
    deviation = parameters.turn
    if mode == SEARCHES_SITE:
        fades = math.exp(-parameters.turn_decay * trip[TRIP.searched])
        deviation += (WIDEST_TURN - parameters.turn) * fades
        trip[TRIP.searched] += n_steps
    turn = deviation * math.sqrt(n_steps) * gaussian(key, 2 * count + 1)
    return to_frame((math.cos(turn), -math.sin(turn)), x, y)


@kernel
def items_around(observation: NDArray[np.float32], reach: float) -> int:
    """Return how many free items are in view within `reach` [m]."""
    n_items = 0
    for item in range(row.N_ITEMS_IN_VIEW):
        start = row.ITEMS + row.ITEM_WIDTH * item
        x = observation[start + row.ITEM.x]
        y = observation[start + row.ITEM.y]
        if observation[start + row.ITEM.present] > 0.5 and length_of(x, y) < reach:
            n_items += 1
    return n_items


@kernel
def poisson_at_most(count: float, mean: float) -> float:
    """Return the probability of a Poisson number that is at most `count`."""
    term = math.exp(-mean)
    total = term
    for number in range(1, int(count) + 1):
        term *= mean / number
        total += term
    return total
