"""The places where everything starts and items come back to, from keyed random streams.

Robot i's place, item j's place and their order depend on the seed and on i or j, not on how many
there are, as far as the places of those before them leave room.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarm_logistics_env.compiler.kernels import gaussian, inlined_kernel, kernel, pair_key, uniform
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.core.streams import key, row_keys
from swarm_logistics_env.world.scenario import Scenario

from .floor_cells import draw_in_cells, floor_of, is_near_solid
from .state import WarehouseState
from .structs import (
    CAME,
    DOCK,
    DUE,
    ITEM_ORDERED,
    NOBODY,
    NUMBER,
    PRIORITY,
    STORED,
    Floor,
    Integers,
    Keys,
    Numbers,
    Orders,
    World,
)

_ARRANGEMENTS = 100  # of all discs anew, where the first ones left no room for the last
_ATTEMPTS = 5_000  # to place a disc among those that stand
_GAP = 0.01  # [m] more than a robot needs to get past
_NO_DISCS = np.zeros((0, 2))


class Discs(NamedTuple):
    """What is strewn over the floor."""

    kind: str  # as the random streams name it
    n: int
    radius: float  # [m]
    cells: Integers  # (n, 2) of a plan in which they may lie
    rack_gap: float = 0.0  # [m] at least between a disc and a rack or side of a plan
    gap: float = 0.0  # [m] at least between two of them


def lay_out(state: WarehouseState, scenario: Scenario, seed: int) -> None:
    """Place everything and give it its random streams."""
    state.obstacle_position = place_obstacles(scenario, seed)
    state.item_position = place_items(scenario, seed, state.obstacle_position)
    state.robot_position, state.robot_heading = place_robots(
        scenario, seed, state.obstacle_position
    )
    state.robot_heading_drift = heading_drifts(scenario, seed)
    if scenario.battery is not None:
        state.batteries.energy[:] = start_energies(scenario, seed)
    state.batteries.station_position[:] = scenario.stations
    stations = row_keys(seed, "stations", len(scenario.stations))
    state.batteries.station_rank[:] = np.argsort(np.argsort(stations, kind="stable"))
    state.robots.sensor_key[:] = row_keys(seed, "sensors", scenario.n_robots)
    state.robots.hearing_key[:] = row_keys(seed, "requests told", scenario.n_robots)
    items = state.items
    items.request_key[:] = row_keys(seed, "requests 0", scenario.n_items)
    items.demand_key[0] = key(seed, "demand")
    items.restock_key[0] = key(seed, "restock")
    items.dock_key[0] = key(seed, "docks")
    items.order_key[0] = key(seed, "orders")
    state.open_requests[:] = NOBODY
    list_orders(state.orders, scenario)


def list_orders(orders: Orders, scenario: Scenario) -> None:
    """Take over the orders of a file; their docks by their numbers."""
    rows = scenario.order_file
    if rows is None:
        return
    docks = {"": NOBODY, **{name: dock for dock, name in enumerate(scenario.dock_names)}}
    orders.n_classes[0] = len(rows.classes)
    orders.listed[:, ITEM_ORDERED] = rows.item
    orders.listed[:, DOCK] = [docks[name] for name in rows.dock]
    orders.listed[:, CAME] = rows.time
    orders.listed[:, DUE] = rows.due
    orders.listed[:, PRIORITY] = rows.priority
    orders.listed[:, NUMBER] = rows.kind


def place_obstacles(scenario: Scenario, seed: int) -> Numbers:
    """Return obstacle centres in the storage [m], shape (n_obstacles, 2)."""
    floor = floor_of(scenario)
    # With a plan a robot gets past on every side, so that no obstacle closes a way.
    gap = 2.0 * scenario.robot_radius + _GAP if floor.n_columns else 0.0
    n = scenario.n_obstacles
    radius = scenario.obstacle_radius
    discs = Discs("obstacles", n, radius, floor.start, gap, gap)
    return _draw_centres(scenario, seed, discs, scenario.stations)


def place_items(scenario: Scenario, seed: int, obstacles: Numbers) -> Numbers:
    """Return item centres in the storage [m], shape (n_items, 2), clear of each other."""
    radius = scenario.item_radius
    cells = floor_of(scenario).storage
    discs = Discs("items", scenario.n_items, radius, cells, item_gap(radius, scenario.robot_radius))
    return _draw_centres(scenario, seed, discs, obstacles)


def place_robots(scenario: Scenario, seed: int, obstacles: Numbers) -> tuple[Numbers, Numbers]:
    """Return start centres [m] (N, 2), clear of each other, and headings [rad] (N,)."""
    n = scenario.n_robots
    discs = Discs("robots", n, scenario.robot_radius, floor_of(scenario).start)
    centres = _draw_centres(scenario, seed, discs, obstacles)
    draws = np.array([uniform(key, 0) for key in row_keys(seed, "headings", n)])
    return centres, (draws * 2.0 - 1.0) * np.pi


def heading_drifts(scenario: Scenario, seed: int) -> Numbers:
    """Return at which rate each robot's body turns unasked [rad/s], shape (N,)."""
    keys = row_keys(seed, "drift", scenario.n_robots)
    return scenario.heading_drift * np.array([gaussian(key, 0) for key in keys])


def start_energies(scenario: Scenario, seed: int) -> Numbers:
    """Return what is in each robot's battery [J], (N,): half of it to all, drawn evenly.

    So not all robots need a station at once.
    """
    keys = row_keys(seed, "start energy", scenario.n_robots)
    shares = np.array([0.5 + 0.5 * uniform(key, 0) for key in keys])
    return np.asarray(scenario.of_robots("battery") * shares)


@kernel
def place_restocked(world: World, item: int) -> bool:
    """Put an item that comes back into the storage, clear of free items and of robots.

    The place depends on the episode's key and on the number of items delivered before.

    Returns whether there was room.
    """
    parameters = world.parameters
    items = world.items
    robots = world.robots
    radius = parameters.item_radius
    high_x = parameters.storage_width - radius
    high_y = parameters.warehouse_height - radius
    spacing = radius + max(radius, parameters.robot_radius)
    key = pair_key(items.restock_key[0], world.progress.n_delivered[0])
    floor = world.floor
    gap = item_gap(radius, parameters.robot_radius)
    for attempt in range(_ATTEMPTS):
        if floor.n_columns > 0:
            x, y = draw_in_cells(floor, floor.storage, key, attempt)
            is_free = is_clear_of_sides(floor, x, y, radius + gap)
        else:
            x, y = draw_position(key, attempt, radius, high_x, high_y)
            is_free = True
        is_free &= is_clear(x, y, world.obstacles, parameters.obstacle_radius + radius)
        for other in range(len(items.status)):
            dx = items.position[other, 0] - x
            dy = items.position[other, 1] - y
            is_near = dx * dx + dy * dy < spacing * spacing
            is_free &= not (is_near and items.status[other] == STORED)
        for robot in range(len(robots.present)):
            dx = robots.position[robot, 0] - x
            dy = robots.position[robot, 1] - y
            is_near = dx * dx + dy * dy < spacing * spacing
            is_free &= not (is_near and robots.present[robot])
        if is_free:
            items.position[item, 0] = x
            items.position[item, 1] = y
            return True
    return False


@inlined_kernel
def item_gap(item_radius: float, robot_radius: float) -> float:
    """Return how far from racks an item stays, so that a robot can stand above it [m]."""
    return max(robot_radius - item_radius, 0.0)


def _draw_centres(scenario: Scenario, seed: int, discs: Discs, obstacles: Numbers) -> Numbers:
    floor = floor_of(scenario)
    radius = discs.radius
    centres = np.zeros((discs.n, 2))
    high_x = scenario.storage_width - radius
    high_y = scenario.warehouse_height - radius
    reach = scenario.obstacle_radius + radius
    for arrangement in range(_ARRANGEMENTS):
        suffix = f" {arrangement}" if arrangement else ""
        keys = row_keys(seed, f"places of {discs.kind}{suffix}", discs.n)
        if floor.n_columns > 0:
            gaps = radius + discs.rack_gap, 2.0 * radius + discs.gap, reach
            is_room = strew_in_cells(floor, discs.cells, keys, centres, gaps, obstacles)
        else:
            is_room = strew(keys, centres, radius, high_x, high_y, obstacles, reach)
        if is_room:
            return centres
    fewer = " or ".join(f"fewer {kind}" for kind in dict.fromkeys((discs.kind, "obstacles")))
    raise ScenarioError(
        f"no room for {discs.n} {discs.kind} of radius {radius} m: should be {fewer}, or a larger "
        "warehouse"
    )


@kernel
def strew(
    keys: Keys,
    centres: Numbers,
    radius: float,
    high_x: float,
    high_y: float,
    obstacles: Numbers,
    obstacle_spacing: float,
) -> bool:
    """Fill the rows of `centres` of discs, one per key, uniformly in the box, by rejection.

    Returns whether there was room for all.
    """
    for disc in range(len(keys)):
        for attempt in range(_ATTEMPTS):
            x, y = draw_position(keys[disc], attempt, radius, high_x, high_y)
            is_free = is_clear(x, y, centres[:disc], 2.0 * radius)
            if is_free and is_clear(x, y, obstacles, obstacle_spacing):
                centres[disc, 0] = x
                centres[disc, 1] = y
                break
        else:
            return False
    return True


@kernel
def strew_in_cells(
    floor: Floor,
    cells: Integers,
    keys: Keys,
    centres: Numbers,
    spacings: tuple[float, float, float],
    obstacles: Numbers,
) -> bool:
    """Fill the rows of `centres` as `strew` does, in cells of a plan.

    `spacings` [m] are those of a centre from racks, from other discs, and from obstacles.
    """
    from_racks, apart, from_obstacles = spacings
    for disc in range(len(keys)):
        for attempt in range(_ATTEMPTS):
            x, y = draw_in_cells(floor, cells, keys[disc], attempt)
            is_free = is_clear_of_sides(floor, x, y, from_racks)
            is_free = is_free and is_clear(x, y, obstacles, from_obstacles)
            if is_free and is_clear(x, y, centres[:disc], apart):
                centres[disc, 0] = x
                centres[disc, 1] = y
                break
        else:
            return False
    return True


@kernel
def is_clear_of_sides(floor: Floor, x: float, y: float, distance: float) -> bool:
    """Return whether no side of the warehouse and no rack is nearer than `distance` [m]."""
    width = floor.n_columns * floor.cell
    height = floor.n_rows * floor.cell
    from_sides = min(min(x, width - x), min(y, height - y))
    return from_sides >= distance and not is_near_solid(floor, x, y, distance)


@inlined_kernel
def draw_position(
    key: np.uint64, attempt: int, low: float, high_x: float, high_y: float
) -> tuple[float, float]:
    """Return the place that a stream draws at an attempt, from (low, low) to (high_x, high_y)."""
    x = low + (high_x - low) * uniform(key, 2 * attempt)
    return x, low + (high_y - low) * uniform(key, 2 * attempt + 1)


@kernel
def is_clear(x: float, y: float, centres: Numbers, spacing: float) -> bool:
    """Return whether no centre is nearer than `spacing` to (x, y)."""
    for other in range(centres.shape[0]):
        dx = centres[other, 0] - x
        dy = centres[other, 1] - y
        if dx * dx + dy * dy < spacing * spacing:
            return False
    return True
