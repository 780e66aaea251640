"""The named columns of an observation row: what one robot senses, in its own frame.

A row has the same length for every swarm size. Positions are relative to the robot, x forward
and y left [m]; there is no place in the warehouse and no compass. Blocks of several things
(neighbours, items) are sorted by distance, nearest first, and end in absent entries of zeros.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.world.scenario import Scenario

N_BEAMS = 16
N_ITEMS_IN_VIEW = 8
N_NEIGHBOURS = 8


class ItemColumns(NamedTuple):
    """The columns of an item, counted from its first one; a neighbour's begin with the same."""

    present: int
    x: int
    y: int
    requested: int
    recently_held: int


class NeighbourColumns(NamedTuple):
    """The columns of a neighbour, counted from its first one."""

    present: int
    x: int
    y: int
    timer_heard: int
    timer: int


ITEM_FEATURES = ItemColumns._fields
ITEM_WIDTH = len(ITEM_FEATURES)
ITEM = ItemColumns(*range(ITEM_WIDTH))
NEIGHBOUR_FEATURES = NeighbourColumns._fields
NEIGHBOUR_WIDTH = len(NEIGHBOUR_FEATURES)
NEIGHBOUR = NeighbourColumns(*range(NEIGHBOUR_WIDTH))

# First columns of the blocks; kernels and scripted policies index with these.
RANGE_ROBOTS = 0
RANGE_WALLS = RANGE_ROBOTS + N_BEAMS
RANGE_ITEMS = RANGE_WALLS + N_BEAMS
ITEMS = RANGE_ITEMS + N_BEAMS
NEIGHBOURS = ITEMS + N_ITEMS_IN_VIEW * ITEM_WIDTH
LOWEST_TIMER = NEIGHBOURS + N_NEIGHBOURS * NEIGHBOUR_WIDTH
LOWEST_TIMER_X = LOWEST_TIMER + 1
LOWEST_TIMER_Y = LOWEST_TIMER + 2
LOWEST_TIMER_TIME = LOWEST_TIMER + 3
CARRYING = LOWEST_TIMER + 4
CARRYING_REQUESTED = CARRYING + 1
IN_DELIVERY_AREA = CARRYING + 2
TIMER_RUNS = CARRYING + 3
TIMER = CARRYING + 4
VELOCITY = CARRYING + 5
VELOCITY_X = VELOCITY
VELOCITY_Y = VELOCITY + 1
CONTACT = CARRYING + 7
TURN_RATE = CONTACT + 1
N_COLUMNS = TURN_RATE + 1  # = 141; after them, per neighbour, the message it broadcasts
MESSAGES = N_COLUMNS


class BatteryColumns(NamedTuple):
    """The last columns of a row where robots have batteries, counted from their first one."""

    charge: int
    charging: int
    stations: int


class StationColumns(NamedTuple):
    """The columns of a charging station, counted from its first one."""

    present: int
    x: int
    y: int


BATTERY = BatteryColumns(*range(len(BatteryColumns._fields)))
STATION_FEATURES = StationColumns._fields
STATION_WIDTH = len(STATION_FEATURES)
STATION = StationColumns(*range(STATION_WIDTH))
N_STATIONS_IN_VIEW = 2
N_BATTERY_COLUMNS = BATTERY.stations + N_STATIONS_IN_VIEW * STATION_WIDTH


def n_columns(scenario: Scenario) -> int:
    """Return the length D of a row in `scenario`."""
    n_of_battery = N_BATTERY_COLUMNS if scenario.battery is not None else 0
    return N_COLUMNS + N_NEIGHBOURS * scenario.message_size + n_of_battery


# What a robot needs to fill a row: by the name of a sensor, what it has to tell.
SENSORS: Mapping[str, str] = MappingProxyType(
    {
        "rangers": "16 beams around, which tell walls, robots and items apart",
        "item camera": "range and bearing of free items, which of them are requested, and which it "
        "put down itself since its last delivery",
        "neighbour camera and radio": "range and bearing of robots that are in view or heard",
        "radio": "the timers and messages that others broadcast, and from whom they come",
        "gripper": "whether it holds an item, and whether that is a requested one",
        "floor sensor": "a sense of being inside the delivery area",
        "clock": "the time since it was last inside the delivery area",
        "odometry": "its velocity",
        "bumper": "whether it touches something",
        "gyro": "how fast its body turns, without the drift that nobody tells it",
        "battery gauge": "how full its battery is, and whether it charges",
        "station camera": "range and bearing of charging stations",
    }
)


@dataclass(frozen=True)
class Column:
    """A named part of an observation row: its columns, its unit and the range of its values.

    Attributes:
        sensor: what tells it, of `SENSORS`.
        absent: the value where there is nothing to tell; None: there always is.
        flag: the column that is 0 where there is nothing to tell; empty: no column says so.
    """

    name: str
    unit: str
    columns: slice
    low: float
    high: float
    meaning: str
    sensor: str
    absent: float | None = None
    flag: str = ""


def columns(scenario: Scenario) -> tuple[Column, ...]:
    """Return the named columns of a row in `scenario`; together they cover it without a gap."""
    reach = scenario.ranger_reach
    limit = scenario.timer_limit
    speed = scenario.highest_speed
    turn = scenario.highest_turn_rate
    beam = "beam k looks k * 22.5 degrees left of forward; the full range where it meets nothing"
    beams = partial(Column, sensor="rangers", absent=reach)
    return (
        beams("range_robots", "m", _run(RANGE_ROBOTS, N_BEAMS), 0, reach, f"to robots; {beam}"),
        beams("range_walls", "m", _run(RANGE_WALLS, N_BEAMS), 0, reach, "to walls and obstacles"),
        beams("range_items", "m", _run(RANGE_ITEMS, N_BEAMS), 0, reach, "to free items"),
        *_columns_of_others(scenario),
        Column("carrying", "flag", _run(CARRYING, 1), 0, 1, "it carries an item", "gripper"),
        Column(
            "carrying_requested", "flag", _run(CARRYING_REQUESTED, 1), 0, 1, "a requested one",
            "gripper", 0, "carrying",
        ),
        Column(
            "in_delivery_area", "flag", _run(IN_DELIVERY_AREA, 1), 0, 1, "its centre is there",
            "floor sensor",
        ),
        Column(
            "timer_runs", "flag", _run(TIMER_RUNS, 1), 0, 1, "its own timer is not silent", "clock"
        ),
        Column(
            "timer", "s", _run(TIMER, 1), 0, limit, "its own timer; the limit when silent", "clock",
            limit, "timer_runs",
        ),
        Column(
            "velocity", "m/s", _run(VELOCITY, 2), -speed, speed, "forward, left; cut at top speed",
            "odometry",
        ),
        Column(
            "contact", "flag", _run(CONTACT, 1), 0, 1, "it touches a robot, wall or obstacle",
            "bumper",
        ),
        Column(
            "turn_rate", "rad/s", _run(TURN_RATE, 1), -turn, turn,
            "to the left, as its gyro tells: without its drift", "gyro",
        ),
        *_messages(scenario),
        *columns_of_battery(scenario),
    )  # fmt: skip


def _columns_of_others(scenario: Scenario) -> tuple[Column, ...]:
    """Return the columns of items, neighbours, and of who tells the lowest timer."""
    view = scenario.view_reach
    limit = scenario.timer_limit
    far = max(view, scenario.radio_range)
    items = _block(ITEMS, N_ITEMS_IN_VIEW, ITEM_FEATURES)
    neighbours = _block(NEIGHBOURS, N_NEIGHBOURS, NEIGHBOUR_FEATURES)
    item = partial(Column, sensor="item camera", absent=0, flag="item_present")
    neighbour = partial(
        Column, sensor="neighbour camera and radio", absent=0, flag="neighbour_present"
    )
    timer = partial(Column, sensor="radio", absent=0, flag="neighbour_present")
    lowest = partial(Column, sensor="radio", absent=0, flag="lowest_timer_present")
    return (
        item("item_present", "flag", items["present"], 0, 1, "a free item is in view"),
        item("item_x", "m", items["x"], -view, view, "its centre, forward"),
        item("item_y", "m", items["y"], -view, view, "its centre, left"),
        item("item_requested", "flag", items["requested"], 0, 1, "it is a requested one"),
        item("item_recently_held", "flag", items["recently_held"], 0, 1, "it was put down lately"),
        neighbour(
            "neighbour_present", "flag", neighbours["present"], 0, 1, "one is heard or in view"
        ),
        neighbour("neighbour_x", "m", neighbours["x"], -far, far, "its centre, forward"),
        neighbour("neighbour_y", "m", neighbours["y"], -far, far, "its centre, left"),
        timer(
            "neighbour_timer_heard", "flag", neighbours["timer_heard"], 0, 1, "its timer is heard"
        ),
        timer("neighbour_timer", "s", neighbours["timer"], 0, limit, "its timer"),
        lowest("lowest_timer_present", "flag", _run(LOWEST_TIMER, 1), 0, 1, "a timer is heard"),
        lowest("lowest_timer_x", "m", _run(LOWEST_TIMER_X, 1), -far, far, "its sender, forward"),
        lowest("lowest_timer_y", "m", _run(LOWEST_TIMER_Y, 1), -far, far, "its sender, left"),
        lowest("lowest_timer", "s", _run(LOWEST_TIMER_TIME, 1), 0, limit, "the lowest timer heard"),
    )


def _messages(scenario: Scenario) -> tuple[Column, ...]:
    if scenario.message_size == 0:
        return ()
    numbers = _run(MESSAGES, N_NEIGHBOURS * scenario.message_size)
    meaning = "the numbers that each broadcasts"
    return (Column("neighbour_message", "1", numbers, -1, 1, meaning, "radio", 0),)


def columns_of_battery(scenario: Scenario) -> tuple[Column, ...]:
    """Return the last columns of a row where robots have batteries; else none."""
    if scenario.battery is None:
        return ()
    first = n_columns(scenario) - N_BATTERY_COLUMNS
    view = scenario.view_reach
    stations = _block(first + BATTERY.stations, N_STATIONS_IN_VIEW, STATION_FEATURES)
    gauge = partial(Column, sensor="battery gauge")
    station = partial(Column, sensor="station camera", absent=0, flag="station_present")
    return (
        gauge("charge", "1", _run(first + BATTERY.charge, 1), 0, 1, "share that is left of it"),
        gauge("charging", "flag", _run(first + BATTERY.charging, 1), 0, 1, "a station charges it"),
        station("station_present", "flag", stations["present"], 0, 1, "a station is in view"),
        station("station_x", "m", stations["x"], -view, view, "its centre, forward"),
        station("station_y", "m", stations["y"], -view, view, "its centre, left"),
    )


def bounds(scenario: Scenario) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the lowest and highest possible row, each of shape (D,)."""
    low, high = np.zeros((2, n_columns(scenario)), np.float32)
    for column in columns(scenario):
        low[column.columns], high[column.columns] = column.low, column.high
    return low, high


def unflatten(
    observation: NDArray[np.float32], scenario: Scenario
) -> dict[str, NDArray[np.float32]]:
    """Return the named parts of a row (D,) or of rows (N, D), as views, last axis the part's."""
    return {column.name: observation[..., column.columns] for column in columns(scenario)}


def _run(start: int, length: int) -> slice:
    return slice(start, start + length, 1)


def _block(start: int, length: int, features: tuple[str, ...]) -> dict[str, slice]:
    width = len(features)
    stop = start + length * width
    return {name: slice(start + first, stop, width) for first, name in enumerate(features)}
