"""The whole warehouse as one vector, for central critics and central controllers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import Warehouse
from swarm_logistics_env.warehouse.state import CARRIED, NOBODY, STORED

ROBOT_FEATURES = (
    "present", "x", "y", "cos_heading", "sin_heading", "velocity_x", "velocity_y",
    "carrying", "carrying_requested", "timer",
)  # fmt: skip
ITEM_FEATURES = ("stored", "carried", "x", "y", "requested")


def global_state(world: Warehouse, n_robots: int, n_items: int) -> NDArray[np.float32]:
    """Return the state of `world` as one float32 vector.

    First `ROBOT_FEATURES` for each of `n_robots` rows, then `ITEM_FEATURES` for each of `n_items`
    rows, then the time. Positions [m] and velocities [m/s] in the warehouse's frame, timers [s]
    (the limit when silent), time [s]; rows of what is absent or delivered are zeros.
    """
    state = world.state
    robots = np.zeros((n_robots, len(ROBOT_FEATURES)), np.float32)
    here = robots[: state.n_robots]
    here[:, 0] = 1.0
    here[:, 1:3] = state.robot_position
    here[:, 3] = np.cos(state.robot_heading)
    here[:, 4] = np.sin(state.robot_heading)
    limit = world.scenario.max_speed
    here[:, 5:7] = np.clip(state.robot_velocity, -limit, limit)
    here[:, 7] = state.robot_item != NOBODY
    here[:, 8] = here[:, 7] * (state.robot_item == state.requested)
    here[:, 9] = np.nan_to_num(state.robot_timer, nan=world.scenario.timer_limit)
    here[~state.robot_present] = 0.0
    items = np.zeros((n_items, len(ITEM_FEATURES)), np.float32)
    there = items[: len(state.item_status)]
    there[:, 0] = state.item_status == STORED
    there[:, 1] = state.item_status == CARRIED
    there[:, 2:4] = state.item_position * (there[:, :1] + there[:, 1:2])
    if state.requested != NOBODY:
        there[state.requested, 4] = 1.0
    width, height = world.scenario.warehouse_width, world.scenario.warehouse_height
    for places in (here[:, 1:3], there[:, 2:4]):
        np.clip(places, 0.0, (width, height), out=places)
    return np.concatenate([robots.ravel(), items.ravel(), [np.float32(state.time)]])


def global_state_bounds(
    scenario: Scenario, n_robots: int, n_items: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the lowest and highest vector that `global_state` gives in `scenario`."""
    width, height, speed = scenario.warehouse_width, scenario.warehouse_height, scenario.max_speed
    robot_low = [0, 0, 0, -1, -1, -speed, -speed, 0, 0, 0]
    robot_high = [1, width, height, 1, 1, speed, speed, 1, 1, scenario.timer_limit]
    item_high = [1, 1, width, height, 1]
    low = [*(robot_low * n_robots), *([0] * len(item_high) * n_items), 0]
    high = [*(robot_high * n_robots), *(item_high * n_items), scenario.duration + 1.0]
    return np.array(low, np.float32), np.array(high, np.float32)
