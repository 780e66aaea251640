"""Batteries: what robots use of them, and the stations that charge them."""

from __future__ import annotations

import math

from swarm_logistics_env.compiler.kernels import gaussian, inlined_kernel, kernel, pair_key
from swarm_logistics_env.world import observations as row

from .floor_cells import is_in_sight
from .pose import Pose, in_frame
from .sensor_errors import ITEM_SEEN, is_missed
from .structs import NOBODY, Sensed, World

# Stations have streams between a robot and a thing of their own, beyond any robot's and item's.
_SEEN = 2**40
_PLACED = 2**41


@inlined_kernel
def use(world: World, robot: int, energy: float) -> None:
    """Take energy [J] out of a robot's battery, at most what is in it."""
    batteries = world.batteries
    if not world.parameters.has_batteries:
        return
    taken = min(energy, batteries.energy[robot])
    batteries.energy[robot] -= taken
    batteries.used[robot] += taken


@kernel
def run_batteries(world: World) -> None:
    """Take out of the batteries what this step used, and charge who stands on a station.

    The way is the straight one from where a robot was at the end of the step before. A robot whose
    centre is within its radius of a station's is on it; two discs cannot both be.
    """
    parameters = world.parameters
    if not parameters.has_batteries:
        return
    robots = world.robots
    batteries = world.batteries
    position_before = world.contacts.position_before
    velocity_before = world.contacts.velocity_before
    for robot in range(len(batteries.energy)):
        batteries.station[robot] = NOBODY
        if not robots.present[robot]:
            continue
        way_x = robots.position[robot, 0] - position_before[robot, 0]
        way_y = robots.position[robot, 1] - position_before[robot, 1]
        square = robots.velocity[robot, 0] ** 2 + robots.velocity[robot, 1] ** 2
        square_before = velocity_before[robot, 0] ** 2 + velocity_before[robot, 1] ** 2
        kinetic = 0.5 * robots.mass[robot] * max(square - square_before, 0.0)
        driven = parameters.driving_energy * math.sqrt(way_x * way_x + way_y * way_y)
        if robots.is_empty[robot]:
            driven = kinetic = 0.0  # whoever shoves it pays for that
        use(world, robot, driven + kinetic + parameters.idle_power * parameters.control_period)
        beyond = batteries.energy[robot] - world.able.battery[robot]  # as a cell faded
        use(world, robot, max(beyond, 0.0))
        charge(world, robot)
        robots.is_empty[robot] = batteries.energy[robot] <= 0.0


@inlined_kernel
def charge(world: World, robot: int) -> None:
    """Charge a robot for a step if its centre is on a station that works."""
    parameters = world.parameters
    batteries = world.batteries
    x = world.robots.position[robot, 0]
    y = world.robots.position[robot, 1]
    for station in range(len(batteries.station_rank)):
        if batteries.station_rank[station] < batteries.n_dead[0]:
            continue
        dx = batteries.station_position[station, 0] - x
        dy = batteries.station_position[station, 1] - y
        if dx * dx + dy * dy > world.robots.radius[robot] ** 2:
            continue
        room = world.able.battery[robot] - batteries.energy[robot]
        energy = min(parameters.charging_power * parameters.control_period, room)
        batteries.energy[robot] += energy
        batteries.charged[robot] += energy
        batteries.station[robot] = station


@kernel
def sense_battery(me: int, pose: Pose, world: World, out: Sensed) -> None:
    """Fill the last columns of a row: charge, whether it charges, the nearest stations in view."""
    if not world.parameters.has_batteries:
        return
    batteries = world.batteries
    first = len(out) - row.N_BATTERY_COLUMNS
    holds = world.able.battery[me]
    # A cell that fades may hold less by now than it was charged to in this step.
    out[first + row.BATTERY.charge] = min(batteries.energy[me] / holds, 1.0) if holds > 0.0 else 0.0
    out[first + row.BATTERY.charging] = 1.0 if batteries.station[me] != NOBODY else 0.0
    farther_than = -1.0
    for rank in range(row.N_STATIONS_IN_VIEW):
        column = first + row.BATTERY.stations + rank * row.STATION_WIDTH
        station = next_in_view(me, pose, world, farther_than)
        if station == NOBODY:
            return
        position = batteries.station_position[station]
        farther_than = (position[0] - pose.x) ** 2 + (position[1] - pose.y) ** 2
        forward, left = in_frame(pose, position[0], position[1])
        limit = world.parameters.view_reach
        noise = world.parameters.position_noise
        if noise > 0.0:
            key = pair_key(world.robots.sensor_key[me], _PLACED + station)
            forward += noise * gaussian(key, 2 * world.progress.step[0])
            left += noise * gaussian(key, 2 * world.progress.step[0] + 1)
        out[column + row.STATION.present] = 1.0
        out[column + row.STATION.x] = min(max(forward, -limit), limit)
        out[column + row.STATION.y] = min(max(left, -limit), limit)


@kernel
def next_in_view(me: int, pose: Pose, world: World, farther_than: float) -> int:
    """Return the nearest station in view whose square of the distance [m2] is above; or NOBODY."""
    batteries = world.batteries
    view_range = world.able.view_range[me]
    dropout = world.parameters.sensor_dropout
    step = world.progress.step[0]
    nearest = NOBODY
    nearest_square = view_range**2 if view_range > 0.0 else -1.0
    for station in range(len(batteries.station_rank)):
        x = batteries.station_position[station, 0]
        y = batteries.station_position[station, 1]
        square = (x - pose.x) ** 2 + (y - pose.y) ** 2
        if square <= farther_than or square > nearest_square:
            continue
        if not is_in_sight(world, pose.x, pose.y, x, y):
            continue
        key = world.robots.sensor_key[me]
        if dropout > 0.0 and is_missed(key, _SEEN + station, step, ITEM_SEEN, dropout):
            continue
        nearest = station
        nearest_square = square
    return nearest
