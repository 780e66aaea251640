"""Whether a scenario can be built: what its fields must be beside each other.

Each check raises a ValueError that names the field, its value and what would be right.
"""

from __future__ import annotations

import math

from .fields import ScenarioFields
from .order_file import ANY, OrderFile
from .robot_kinds import check_names

# Discs may cover this part of the floor; random sequential addition ends at 0.547.
DENSEST_COVER = 0.4
# In a physics step a robot may drive this part of its radius; a crowd presses a faster one
# through walls.
LONGEST_STRIDE = 0.8
# The longest physics step [s]; with a longer one, robots that press together overlap.
LONGEST_PHYSICS_PERIOD = 0.02
MOST_SUBSTEPS = 1000


def check(scenario: ScenarioFields) -> None:
    """Check everything."""
    check_names(scenario.robot_kinds, scenario.n_robots)
    check_radii(scenario)
    check_periods(scenario)
    check_storage(scenario)
    check_requests(scenario)
    check_orders(scenario)
    check_room(scenario)


def check_radii(scenario: ScenarioFields) -> None:
    """Check that no kind is larger than the robots that everything leaves room for."""
    for kind in scenario.robot_kinds:
        if kind.robot_radius is not None and kind.robot_radius > scenario.robot_radius:
            raise ValueError(
                f"robot_kinds: robot_radius = {kind.robot_radius:g} m of the kind {kind.name!r}: "
                f"should be at most the scenario's robot_radius = {scenario.robot_radius:g} m, "
                "which is that of the largest robots"
            )


def check_periods(scenario: ScenarioFields) -> None:
    """Check the lengths of steps and of the episode."""
    if scenario.physics_period > LONGEST_PHYSICS_PERIOD:
        raise ValueError(
            f"physics_period = {scenario.physics_period} s: should be at most "
            f"{LONGEST_PHYSICS_PERIOD} s, or robots in a crowd press each other through walls"
        )
    ratio = scenario.control_period / scenario.physics_period
    if ratio > MOST_SUBSTEPS:
        raise ValueError(
            f"physics_period = {scenario.physics_period} s makes {ratio:g} physics steps of a "
            f"control_period: should be at most {MOST_SUBSTEPS}"
        )
    if abs(ratio - round(ratio)) > 1e-6 or round(ratio) < 1:
        raise ValueError(
            f"control_period = {scenario.control_period} s should be a whole multiple of "
            f"physics_period = {scenario.physics_period} s"
        )
    radii = scenario.of_kinds("robot_radius")
    for radius, speed in zip(radii, scenario.of_kinds("max_speed"), strict=True):
        longest = LONGEST_STRIDE * radius / speed
        if scenario.physics_period > longest * (1.0 + 1e-9):
            raise ValueError(
                f"physics_period = {scenario.physics_period} s lets a robot cross "
                f"{speed * scenario.physics_period:g} m between two collision checks: "
                f"should be at most {LONGEST_STRIDE} robot_radius / max_speed = {longest:g} s"
            )
    if scenario.duration < scenario.control_period:
        raise ValueError(
            f"duration = {scenario.duration} s should be at least one control_period "
            f"({scenario.control_period} s)"
        )


def check_storage(scenario: ScenarioFields) -> None:
    """Check that what stands in the open room has width for it."""
    if scenario.floor is not None:
        return  # the plan was checked
    if scenario.delivery_width >= scenario.warehouse_width:
        raise ValueError(
            f"delivery_width = {scenario.delivery_width} m leaves no storage: should be less than "
            f"warehouse_width = {scenario.warehouse_width} m"
        )
    widest = max(
        scenario.robot_radius,
        scenario.item_radius,
        scenario.obstacle_radius if scenario.n_obstacles else 0.0,
    )
    for name, side in (
        ("warehouse_width - delivery_width", scenario.storage_width),
        ("warehouse_height", scenario.warehouse_height),
    ):
        if side < 2 * widest:
            raise ValueError(
                f"{name} = {side:g} m is narrower than what has to stand in it: should be at "
                f"least {2 * widest:g} m"
            )


def check_requests(scenario: ScenarioFields) -> None:
    """Check requests, docks and the item count against each other."""
    if scenario.n_requests > scenario.n_items:
        raise ValueError(
            f"n_requests = {scenario.n_requests}: should be at most n_items = {scenario.n_items}"
        )
    if scenario.draws_docks and (scenario.plan is None or len(scenario.plan.dock_names) < 2):
        raise ValueError("request_docks = random: should have a floor of two docks or more")
    most = 1.0 / scenario.control_period
    if scenario.dock_capacity is not None and scenario.dock_capacity > most * (1.0 + 1e-9):
        raise ValueError(
            f"dock_capacity = {scenario.dock_capacity}: should be at most one in a control_period, "
            f"{most:g} per second, or None"
        )


def check_orders(scenario: ScenarioFields) -> None:
    """Check the orders of a file against the items and docks that there are."""
    try:
        orders = scenario.order_file
        if orders is not None:
            _check_ordered_items(orders, scenario.n_items, scenario.restock)
            _check_docks(orders, scenario.dock_names)
    except ValueError as error:
        raise ValueError(f"Scenario.orders: {error}") from None


def _check_ordered_items(orders: OrderFile, n_items: int, restock: bool) -> None:
    line_of_item: dict[int, int] = {}
    for item, line in zip(orders.item.tolist(), orders.line.tolist(), strict=True):
        if item >= n_items:
            raise ValueError(
                f"line {line}: item = {item}: should be at most {n_items - 1}, as there are "
                f"{n_items} items, from 0 on"
            )
        if item != ANY and item in line_of_item and not restock:
            raise ValueError(
                f"line {line}: item = {item} is ordered in line {line_of_item[item]} already: "
                "should be ordered once, or restock be True, as a delivered item has left"
            )
        line_of_item[item] = line
    n_classes = len(orders.classes)
    for number, name in enumerate(orders.classes):
        of_class = set(range(number, n_items, n_classes))
        n_of_class = len(of_class if restock else of_class.difference(line_of_item))
        n_ordered = int((orders.kind == number).sum())
        if n_of_class == 0 or (n_ordered > n_of_class and not restock):
            raise ValueError(
                f"item = {name!r} is ordered {n_ordered} times: there are {n_of_class} items of "
                f"that class that no other row names ({n_items} items in {n_classes} classes): "
                "should be fewer, or restock be True"
            )


def _check_docks(orders: OrderFile, dock_names: tuple[str, ...]) -> None:
    for name, line in zip(orders.dock, orders.line.tolist(), strict=True):
        if name and name not in dock_names:
            docks = ", ".join(dock_names) or "empty, as there is no floor with docks"
            raise ValueError(f"line {line}: dock = {name!r}: should be {docks}")


def check_room(scenario: ScenarioFields) -> None:
    """Check that robots, items and obstacles fit into the cells or the room that they have."""
    plan = scenario.plan
    if plan is None:
        storage = scenario.storage_width * scenario.warehouse_height
        starts = storage
        room = f"a storage of {scenario.storage_width:g} x {scenario.warehouse_height:g} m"
        start_room = room
    else:
        storage = plan.storage_area
        starts = plan.start_area
        room = 'the storage cells (":") of the plan'
        start_room = f"the {plan.start_name} of the plan"
    obstacle_cover = scenario.n_obstacles * scenario.obstacle_radius**2
    for count, name, radius, area, place in (
        (scenario.n_obstacles, "n_obstacles", scenario.obstacle_radius, storage, room),
        (scenario.n_robots, "n_robots", scenario.robot_radius, starts, start_room),
        (scenario.n_items, "n_items", scenario.item_radius, storage, room),
    ):
        cover = 0.0 if name == "n_obstacles" else obstacle_cover
        most = int((DENSEST_COVER * area / math.pi - cover) / radius**2)
        if count > most:
            raise ValueError(
                f"{name} = {count} of radius {radius} m do not fit into {place}: should be "
                f"at most {max(most, 0)} (discs may cover {DENSEST_COVER:.0%} of it)"
            )
