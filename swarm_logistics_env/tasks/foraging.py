"""Foraging: robots bring items to a nest, any of them, and each comes back at a random place.

A second world on the warehouse's bodies, drives, sensors, radio and faults. Its rules differ in
three things: there is no order of requests, home is a disc in the middle of the arena in place of
a strip along a wall, and items do not run out.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import Field, PositiveFloat

from swarm_logistics_env.errors import ScenarioError
from swarm_logistics_env.kernels import inlined_kernel, kernel, pair_key, uniform
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import row_keys
from swarm_logistics_env.warehouse import Warehouse, WarehouseState
from swarm_logistics_env.warehouse.engine import CAME_BACK, DELIVERED_IT, follow
from swarm_logistics_env.warehouse.item_collisions import mask_below_lifters
from swarm_logistics_env.warehouse.kinematics import refused_command
from swarm_logistics_env.warehouse.layout import is_clear
from swarm_logistics_env.warehouse.logistics import (
    carry_along,
    close_grippers,
    note_event,
    open_grippers,
)
from swarm_logistics_env.warehouse.packing import unpacked_at
from swarm_logistics_env.warehouse.stepping import begin, finish
from swarm_logistics_env.warehouse.structs import (
    DELIVERED,
    NOBODY,
    STORED,
    Numbers,
    Parameters,
    Sensed,
    World,
    parameters_of,
)

_ATTEMPTS = 5_000  # to place an item among those that lie there


class ForagingScenario(Scenario):
    """Every condition of one run of foraging: the warehouse's, two of them with another meaning.

    Raises:
        ScenarioError: as `Scenario`, or the nest leaves no room around it.
    """

    delivery_width: PositiveFloat = Field(
        2.0, description="diameter of the nest, a disc in the middle of the arena [m]; chosen"
    )
    restock: bool = Field(
        True, description="an item that was brought home comes back at a random place; chosen"
    )

    @property
    def storage_width(self) -> float:
        """Width of where robots start and items lie: all of the arena [m]."""
        return self.warehouse_width


class Foraging(Warehouse):
    """A world in which every item counts that comes into the nest; P is how many did."""

    @property
    def all_delivered(self) -> bool:
        """Whether every item was brought home and none comes back."""
        return bool((self.state.item_status == DELIVERED).all())

    def _advance(self, rows: Sensed) -> bool:
        return forage(self._address, 0.5 * self.scenario.delivery_width, rows)

    def _lay_out(self, state: WarehouseState, scenario: Scenario, seed: int) -> None:
        super()._lay_out(state, scenario, seed)
        state.requested = NOBODY
        parameters, nest_radius = parameters_of(scenario), 0.5 * scenario.delivery_width
        places, obstacles = state.item_position, state.obstacle_position
        keys = row_keys(seed, "places around the nest", scenario.n_items)
        for item, key in enumerate(keys):
            places[item] = free_place(key, parameters, nest_radius, obstacles, places[:item])
            if math.isnan(places[item, 0]):
                raise ScenarioError(
                    f"no room for {scenario.n_items} items around a nest of "
                    f"{scenario.delivery_width} m: should be fewer items or a larger arena"
                )


@kernel
def free_place(
    key: np.uint64, parameters: Parameters, nest_radius: float, obstacles: Numbers, items: Numbers
) -> tuple[float, float]:
    """Return a random place [m], clear of obstacles, of items and of what the nest's robots reach.

    It is NaN, NaN if there is none.
    """
    width, height = parameters.warehouse_width, parameters.warehouse_height
    radius, clearance = parameters.item_radius, nest_radius + parameters.pickup_range
    for attempt in range(_ATTEMPTS):
        x = radius + (width - 2.0 * radius) * uniform(key, 2 * attempt)
        y = radius + (height - 2.0 * radius) * uniform(key, 2 * attempt + 1)
        is_outside = math.hypot(x - 0.5 * width, y - 0.5 * height) > clearance
        if (
            is_outside
            and is_clear(x, y, obstacles, parameters.obstacle_radius + radius)
            and is_clear(x, y, items, 2.0 * radius)
        ):
            return x, y
    return math.nan, math.nan


@kernel
def forage(address: int, nest_radius: float, rows: Sensed) -> bool:
    """Take a control step in the world at `address`, as `stepping.step` does in the warehouse."""
    world = unpacked_at(World, address)
    world.outcome.refused[0] = refused_command(world.commands.now, world.robots, world.able)
    if world.outcome.refused[0] != NOBODY:
        return True
    begin(world)
    n_delivered, is_room = handle_items(world, nest_radius)
    return finish(address, world, rows, n_delivered, is_room)


@inlined_kernel
def handle_items(world: World, nest_radius: float) -> tuple[int, bool]:
    """Carry along, let go, lift and bring home; returns how many, and whether there was room."""
    robots, parameters, commands = world.robots, world.parameters, world.commands.now
    carry_along(world)
    for robot in range(len(robots.item)):
        dx = robots.position[robot, 0] - 0.5 * parameters.warehouse_width
        dy = robots.position[robot, 1] - 0.5 * parameters.warehouse_height
        robots.in_delivery[robot] = robots.present[robot] and math.hypot(dx, dy) <= nest_radius
    n_events = open_grippers(world, commands)
    n_events = close_grippers(world, commands, n_events)
    mask_below_lifters(world, n_events)
    n_events, n_delivered, is_room = bring_home(world, nest_radius, n_events)
    follow(world.engine, world.claims.events, n_events, world.items.position)
    return n_delivered, is_room


@inlined_kernel
def bring_home(world: World, nest_radius: float, n_events: int) -> tuple[int, int, bool]:
    """Take the items of all robots in the nest that can deliver.

    With `restock` each comes back at a random place, which depends on how many came home before.

    Returns:
        The number of events so far, of deliveries, and whether all that came back found room.
    """
    robots, items, claims = world.robots, world.items, world.claims
    n_delivered, is_room = 0, True
    for robot in range(len(robots.item)):
        item = robots.item[robot]
        if item == NOBODY or not robots.in_delivery[robot] or not world.able.delivers[robot]:
            continue
        robots.item[robot] = NOBODY
        items.carrier[item] = NOBODY
        items.status[item] = DELIVERED
        claims.delivered_by[n_delivered] = robot
        n_delivered += 1
        world.progress.n_delivered[0] += 1
        n_events = note_event(claims.events, n_events, DELIVERED_IT, robot, item)
        if world.parameters.restock:
            key = pair_key(items.restock_key[0], world.progress.n_delivered[0])
            x, y = free_place(key, world.parameters, nest_radius, world.obstacles, items.position)
            is_room &= not math.isnan(x)
            if not math.isnan(x):
                items.position[item, 0], items.position[item, 1] = x, y
                items.status[item] = STORED
                items.covered[item] = 1
                n_events = note_event(claims.events, n_events, CAME_BACK, robot, item)
    return n_events, n_delivered, is_room
