"""The inputs of a network: what a row and a robot's memory tell, in the frame of its motion.

A swarm has no compass, so what is to the left of a robot's motion matters, not what is to the
left of its body. The frame is turned by whole beams, so that scans need no interpolation.
"""

from __future__ import annotations

import math
from collections import namedtuple
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel, uniform
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import (
    MEMORY,
    SURELY_IN_VAIN,
    fading,
    length_of,
    remember_observation,
    remember_row,
    to_frame,
)
from swarm_logistics_env.world.motion.sight import N_SIGHT_INPUTS, SIGHT_INPUTS, read_sight
from swarm_logistics_env.world.motion.voices import N_VOICE_INPUTS, VOICE_INPUTS, read_voices

N_FAR = 8  # neighbours
N_NEAR = 3  # near ones
N_OBSTACLES = 6  # items that a laden robot avoids
WALL_REACH = 0.7  # [m], where nearness 1 .. 0 ends
FAR = 2.0  # [m]
NEAR = 0.5  # [m]
RANDOM_HEADING_TIME = 0.8  # [s] that a random direction lasts
FARTHEST = 8.0  # [m] from the delivery area, as far as a network is told
FIRST_RANDOM_HEADING = 1_000_003  # number in the robot's stream
ROLE_TIME = 40.0  # [s] that a role lasts
FIRST_ROLE = 2_000_003  # number in the robot's stream
ROLE_EDGE = 0.6  # a network is told on which side of it the role lies
# Of frames that are turned by 0, 1, .. beams [rad]; the cosines and sines are those of `math`.
TURNS = 2.0 * math.pi * np.arange(row.N_BEAMS) / row.N_BEAMS
COSINES = np.array([math.cos(turn) for turn in TURNS])
SINES = np.array([math.sin(turn) for turn in TURNS])

_VECTOR = ("along", "aside")
_OBSTACLE = ("present", *_VECTOR)
INPUTS: tuple[str, ...] = (
    *(f"wall_{beam}" for beam in range(row.N_BEAMS)),
    *(f"neighbour_{n}_{part}" for n in range(N_FAR) for part in _VECTOR),
    *(f"near_neighbour_{n}_{part}" for n in range(N_NEAR) for part in _VECTOR),
    *(f"obstacle_{n}_{part}" for n in range(N_OBSTACLES) for part in _OBSTACLE),
    "requested_present", "requested_along", "requested_aside", "requested_distance",
    "requested_nearness", "requested_recently_held",
    "lead_present", "lead_along", "lead_aside", "lead_distance", "lead_timer",
    "carrying", "carrying_requested", "in_delivery_area", "timer_runs", "timer", "contact",
    "velocity_along", "velocity_aside", "heading_along", "heading_aside",
    "home_along", "home_aside", "home_certainty", "failed", "stuck",
    "whim_along", "whim_aside",
    "kept_home_along", "kept_home_aside", "kept_home_distance",
    "cannot_deliver", "cannot_lift", "delivering_in_vain", "items_in_view",
    "top_speed", "handling_time", "turns_to_drive", "time_to_top_speed",
)  # fmt: skip
_Columns = namedtuple("_Columns", INPUTS)  # type: ignore[misc]  # by their names, as above
INPUT: Any = _Columns(*range(len(INPUTS)))  # the column of each input
LEAD = slice(INPUT.lead_present, INPUT.lead_timer + 1)
N_INPUTS = len(INPUTS)
ROLE_INPUTS = ("role", "role_edge")


def input_names(
    has_role: bool = False, talks: bool = False, sees_items: bool = False
) -> tuple[str, ...]:
    """Return the names of all that a network reads: `INPUTS`, then what is sensed besides."""
    sight = SIGHT_INPUTS if sees_items else ()
    role = ROLE_INPUTS if has_role else ()
    voices = VOICE_INPUTS if talks else ()
    return (*INPUTS, *sight, *role, *voices)


@inlined_kernel
def beams_turned(memory: NDArray[np.float64]) -> int:
    """Return by how many beams the frame of a robot's motion is turned from its body."""
    heading = math.atan2(memory[MEMORY.heading_y], memory[MEMORY.heading_x])
    return round(heading / (2.0 * math.pi / row.N_BEAMS)) % row.N_BEAMS


@kernel
def turn_frames(
    rows: NDArray[np.float32],
    period: float,
    memories: NDArray[np.float64],
    turned: NDArray[np.float64],
) -> None:
    """Take what rows tell into the memories; fill how far each frame is turned (N,) [rad]."""
    remember_observation(rows, period, memories)
    for robot in range(rows.shape[0]):
        turned[robot] = TURNS[beams_turned(memories[robot])]


@kernel
def read_observations(
    rows: NDArray[np.float32],
    period: float,
    memories: NDArray[np.float64],
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    listens: bool,
    inputs: NDArray[np.float32],
    turned: NDArray[np.float64],
) -> None:
    """Do as `turn_frames`, and fill inputs (N, k), as many as `input_names` has.

    Args:
        counts: the decisions of each row before this one (N,).
        listens: whether the lowest timer heard is read; zeros if not.
    """
    fades = fading(period)
    for robot in range(rows.shape[0]):
        sensed = rows[robot]
        memory = memories[robot]
        read = inputs[robot]
        kept_home = remember_row(sensed, period, fades, memory)
        beams = beams_turned(memory)
        turned[robot] = TURNS[beams]
        frame = COSINES[beams], SINES[beams]
        for beam in range(row.N_BEAMS):
            distance = np.float64(sensed[row.RANGE_WALLS + (beam + beams) % row.N_BEAMS])
            read[INPUT.wall_0 + beam] = max(0.0, 1.0 - distance / WALL_REACH)
        read_neighbours(sensed, frame, read)
        read_items(sensed, frame, read)
        # The robot that tells the lowest timer may lie: it counts less the more this robot knows.
        certainty = length_of(memory[MEMORY.home_x], memory[MEMORY.home_y])
        confidence = math.tanh(certainty)
        read_lead(sensed, frame, 1.0 - confidence, read)
        if not listens:
            read[INPUT.lead_present : INPUT.lead_timer + 1] = 0.0
        read_robot(sensed, memory, frame, read)
        angle = random_heading(keys[robot], counts[robot], period) - turned[robot]
        read[INPUT.whim_along], read[INPUT.whim_aside] = math.cos(angle), math.sin(angle)
        read_memory(memory, certainty, confidence, kept_home, frame, read)
        # How many there are says which: compiled code leaves out what a network does not read.
        # Sight has more inputs than voices and a role together, and a role has fewer than voices,
        # so the remainders tell which there are.
        if inputs.shape[1] >= N_INPUTS + N_SIGHT_INPUTS:
            read_sight(sensed, memory, kept_home[2], beams, frame, N_INPUTS, read)
        if (inputs.shape[1] - N_INPUTS) % N_SIGHT_INPUTS >= N_VOICE_INPUTS:
            read_voices(sensed, frame, inputs.shape[1] - N_VOICE_INPUTS, read)
        if (inputs.shape[1] - N_INPUTS) % N_SIGHT_INPUTS % N_VOICE_INPUTS > 0:
            role = role_of(keys[robot], random_heading_number(counts[robot], period))
            first = inputs.shape[1] - (inputs.shape[1] - N_INPUTS) % N_SIGHT_INPUTS
            read[first] = 2.0 * role - 1.0
            read[first + 1] = 1.0 if role < ROLE_EDGE else -1.0


@inlined_kernel
def put(
    read: NDArray[np.float32],
    along: int,
    scale: float,
    frame: tuple[float, float],
    x: float,
    y: float,
) -> None:
    """Fill two inputs, from column `along` on, with a vector in the frame, times `scale`."""
    vector = to_frame(frame, x, y)
    read[along], read[along + 1] = scale * vector[0], scale * vector[1]


@kernel
def read_neighbours(
    sensed: NDArray[np.float32], frame: tuple[float, float], read: NDArray[np.float32]
) -> None:
    """Fill the inputs of neighbours: near they are larger."""
    for index in range(N_FAR + N_NEAR):
        is_far = index < N_FAR
        reach = FAR if is_far else NEAR
        first = INPUT.neighbour_0_along if is_far else INPUT.near_neighbour_0_along
        rank = index if is_far else index - N_FAR
        neighbour = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * rank
        x = sensed[neighbour + row.NEIGHBOUR.x]
        y = sensed[neighbour + row.NEIGHBOUR.y]
        distance = np.float64(length_of(x, y))
        nearness = max(0.0, 1.0 - distance / reach) / distance if distance > 0.0 else 0.0
        put(read, first + len(_VECTOR) * rank, nearness, frame, x, y)


@kernel
def read_items(
    sensed: NDArray[np.float32], frame: tuple[float, float], read: NDArray[np.float32]
) -> None:
    """Fill the inputs of obstacles, the requested item, and how full the view is of items."""
    carries = sensed[row.CARRYING] > 0.5
    for index in range(N_OBSTACLES):
        item = row.ITEMS + row.ITEM_WIDTH * index
        present = INPUT.obstacle_0_present + len(_OBSTACLE) * index
        read[present] = 1.0 if carries and sensed[item + row.ITEM.present] > 0.5 else 0.0
        along = INPUT.obstacle_0_along + len(_OBSTACLE) * index
        x = sensed[item + row.ITEM.x]
        y = sensed[item + row.ITEM.y]
        put(read, along, read[present], frame, x, y)
    read[INPUT.requested_present : INPUT.requested_recently_held + 1] = 0.0
    for index in range(row.N_ITEMS_IN_VIEW):
        item = row.ITEMS + row.ITEM_WIDTH * index
        if sensed[item + row.ITEM.present] > 0.5 and sensed[item + row.ITEM.requested] > 0.5:
            x = sensed[item + row.ITEM.x]
            y = sensed[item + row.ITEM.y]
            distance = np.float64(max(length_of(x, y), 1e-9))
            along, aside = to_frame(frame, x, y)
            read[INPUT.requested_present] = 1.0
            read[INPUT.requested_along] = along / distance
            read[INPUT.requested_aside] = aside / distance
            read[INPUT.requested_distance] = distance
            read[INPUT.requested_nearness] = max(0.0, 1.0 - distance / NEAR)
            read[INPUT.requested_recently_held] = sensed[item + row.ITEM.recently_held]
            break  # the nearest one comes first
    n_in_view = 0.0
    for index in range(row.N_ITEMS_IN_VIEW):
        item = row.ITEMS + row.ITEM_WIDTH * index
        n_in_view += sensed[item + row.ITEM.present]
    read[INPUT.items_in_view] = n_in_view / row.N_ITEMS_IN_VIEW


@kernel
def read_lead(
    sensed: NDArray[np.float32], frame: tuple[float, float], trust: float, read: NDArray[np.float32]
) -> None:
    """Fill the inputs of the lowest timer heard, times `trust`."""
    heard = np.float64(sensed[row.LOWEST_TIMER]) * trust
    x = sensed[row.LOWEST_TIMER_X]
    y = sensed[row.LOWEST_TIMER_Y]
    distance = length_of(x, y)
    unit = heard / distance if distance > 0.0 else 0.0
    read[INPUT.lead_present] = heard
    put(read, INPUT.lead_along, unit, frame, x, y)
    read[INPUT.lead_distance] = heard * distance / 4.0
    read[INPUT.lead_timer] = heard * sensed[row.LOWEST_TIMER_TIME] / 10.0


@kernel
def read_robot(
    sensed: NDArray[np.float32],
    memory: NDArray[np.float64],
    frame: tuple[float, float],
    read: NDArray[np.float32],
) -> None:
    """Fill the inputs of what a robot feels of itself, and of its body."""
    read[INPUT.carrying] = sensed[row.CARRYING]
    read[INPUT.carrying_requested] = sensed[row.CARRYING_REQUESTED]
    read[INPUT.in_delivery_area] = sensed[row.IN_DELIVERY_AREA]
    read[INPUT.timer_runs] = sensed[row.TIMER_RUNS]
    read[INPUT.timer] = sensed[row.TIMER] / 10.0
    read[INPUT.contact] = sensed[row.CONTACT]
    velocity_x = sensed[row.VELOCITY_X]
    velocity_y = sensed[row.VELOCITY_Y]
    put(read, INPUT.velocity_along, 0.5, frame, velocity_x, velocity_y)
    heading_x = memory[MEMORY.heading_x]
    heading_y = memory[MEMORY.heading_y]
    put(read, INPUT.heading_along, 1.0, frame, heading_x, heading_y)
    # The heading is at most half a beam aside, so it is doubled to be as large as other inputs.
    read[INPUT.heading_aside] *= 2.0
    read[INPUT.top_speed] = memory[MEMORY.top_speed] / 2.0
    read[INPUT.handling_time] = memory[MEMORY.handling_time] / 2.0
    read[INPUT.turns_to_drive] = 1.0 if memory[MEMORY.widest_turn] > 0.0 else 0.0
    read[INPUT.time_to_top_speed] = memory[MEMORY.top_speed] / memory[MEMORY.acceleration]


@kernel
def read_memory(
    memory: NDArray[np.float64],
    certainty: float,
    confidence: float,
    kept_home: tuple[float, float, float],
    frame: tuple[float, float],
    read: NDArray[np.float32],
) -> None:
    """Fill the inputs of what a robot remembers: the way home, and failures of its own.

    Args:
        certainty: length of the sum of its directions home; `confidence` is its tanh.
        kept_home: see `memory.kept_home`.
    """
    unit = confidence / certainty if certainty > 0.0 else 0.0
    put(read, INPUT.home_along, unit, frame, memory[MEMORY.home_x], memory[MEMORY.home_y])
    read[INPUT.home_certainty] = math.tanh(certainty / 3.0)
    read[INPUT.failed], read[INPUT.stuck] = memory[MEMORY.failed], memory[MEMORY.stuck]
    home_x, home_y, sure = kept_home
    kept_certainty = math.tanh(sure)
    put(read, INPUT.kept_home_along, kept_certainty, frame, home_x, home_y)
    distance = min(max(memory[MEMORY.away], -FARTHEST), FARTHEST)
    read[INPUT.kept_home_distance] = kept_certainty * distance / FARTHEST
    read[INPUT.cannot_deliver] = memory[MEMORY.cannot_deliver]
    read[INPUT.cannot_lift] = memory[MEMORY.cannot_lift]
    longest = memory[MEMORY.handling_time] + SURELY_IN_VAIN
    read[INPUT.delivering_in_vain] = min(1.0, memory[MEMORY.delivering] / longest)


@kernel
def random_heading_number(count: int, period: float) -> int:
    """Return which of its random directions a robot has after so many decisions."""
    return int(count * period / RANDOM_HEADING_TIME + 1e-9)


@kernel
def random_heading(key: np.uint64, count: int, period: float) -> float:
    """Return a robot's random direction after so many decisions, in its own frame [rad]."""
    number = FIRST_RANDOM_HEADING + random_heading_number(count, period)
    return 2.0 * math.pi * uniform(key, number)


@kernel
def role_of(key: np.uint64, heading_number: int) -> float:
    """Return the number in [0, 1) that decides a robot's role at present.

    Robots change their roles at different times.
    """
    n_roles = heading_number * RANDOM_HEADING_TIME / ROLE_TIME
    role = int(n_roles + uniform(key, FIRST_ROLE))
    return uniform(key, FIRST_ROLE + 1 + role)
