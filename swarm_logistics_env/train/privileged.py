"""What the value network reads beside the inputs of the network that decides.

That is more than a robot can sense, such as where the requested item is: the value network judges
while the policy learns and is not shipped (an asymmetric critic, Pinto et al. 2018). The network
that decides never reads this; one that talks learns to tell some of it (`messages_of`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import engine_kernel, kernel
from swarm_logistics_env.world.motion.memory import length_of, to_frame
from swarm_logistics_env.world.motion.voices import SILENT
from swarm_logistics_env.world.warehouse.structs import NOBODY, World


class PrivilegedColumns(NamedTuple):
    """The columns of what the value network alone reads, behind the inputs of the other one.

    Lengths are in units of 10 m; directions are in the frame of the robot's motion.
    """

    to_delivery: int
    y: int  # from the middle of the warehouse
    frame_cos: int
    frame_sin: int
    drift: int  # of the gyro [0.1 rad/s]
    swarm_size: int  # its logarithm / 5
    lifts: int
    delivers: int
    requested_along: int
    requested_aside: int
    requested_distance: int
    requested_nearness: int  # 1 .. 0 at a distance of 0 .. 2 m
    is_carried: int
    carrier_to_delivery: int
    carrier_delivers: int


PRIVILEGED = PrivilegedColumns(*range(len(PrivilegedColumns._fields)))
_NEARNESS = PRIVILEGED.requested_nearness


def messages_of(privileged: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what networks that talk should say (rows, 2), see `world.motion.voices`.

    Of several requested items it is the nearest one that counts, and 0 if that one is carried.

    Args:
        privileged: (rows, len(PRIVILEGED)).
    """
    # Zeros where nothing is asked for.
    of_request = [PRIVILEGED.requested_along, PRIVILEGED.requested_aside, _NEARNESS]
    is_requested = (privileged[:, of_request] != 0.0).any(axis=1)
    is_free = is_requested & (privileged[:, PRIVILEGED.is_carried] == 0.0)
    to_item = np.where(is_free, 10.0 * privileged[:, PRIVILEGED.requested_distance], SILENT)
    to_dock = -10.0 * privileged[:, PRIVILEGED.to_delivery]
    nearness = 1.0 - np.stack([to_item, to_dock], axis=1) / SILENT
    return np.clip(nearness, 0.0, 1.0).astype(np.float32)


@engine_kernel
def fill_privileged(
    address: int,
    turned: NDArray[np.float64],
    to_delivery: NDArray[np.float64],
    privileged: NDArray[np.float32],
) -> None:
    """Fill `privileged` (rows, len(PRIVILEGED)); rows without a robot stay as they are.

    Args:
        address: of the world (`Warehouse.address`).
        turned: how far each row's frame is turned from its robot's body (rows,) [rad].
        to_delivery: the way of each robot to the nearest dock, in one less than 0 (N,) [m].
    """
    world = unpacked_at(World, address)
    robots = world.robots
    able = world.able
    items = world.items
    height = world.parameters.warehouse_height
    for robot in range(len(robots.position)):
        row = privileged[robot]
        x = robots.position[robot, 0]
        y = robots.position[robot, 1]
        requested = nearest_request(world, x, y)
        carrier = NOBODY if requested == NOBODY else items.carrier[requested]
        frame = robots.heading[robot] + turned[robot]
        cos = math.cos(frame)
        sin = math.sin(frame)
        row[:] = 0.0
        row[PRIVILEGED.to_delivery] = to_delivery[robot] / 10.0
        row[PRIVILEGED.y] = (y - 0.5 * height) / 10.0
        row[PRIVILEGED.frame_cos] = cos
        row[PRIVILEGED.frame_sin] = sin
        row[PRIVILEGED.drift] = 10.0 * robots.heading_drift[robot]
        row[PRIVILEGED.swarm_size] = math.log(len(robots.position)) / 5.0
        row[PRIVILEGED.lifts] = 1.0 if able.lifts[robot] else 0.0
        row[PRIVILEGED.delivers] = 1.0 if able.delivers[robot] else 0.0
        if requested != NOBODY:
            to_x = items.position[requested, 0] - x
            to_y = items.position[requested, 1] - y
            distance = max(length_of(to_x, to_y), 1e-9)
            along, aside = to_frame((cos, sin), to_x, to_y)
            row[PRIVILEGED.requested_along] = along / distance
            row[PRIVILEGED.requested_aside] = aside / distance
            row[PRIVILEGED.requested_distance] = distance / 10.0
            row[PRIVILEGED.requested_nearness] = max(0.0, 1.0 - distance / 2.0)
        if carrier != NOBODY:
            row[PRIVILEGED.is_carried] = 1.0
            row[PRIVILEGED.carrier_to_delivery] = to_delivery[carrier] / 10.0
            row[PRIVILEGED.carrier_delivers] = 1.0 if able.delivers[carrier] else 0.0


@kernel
def nearest_request(world: World, x: float, y: float) -> int:
    """Return the item that is asked for and lies nearest to (x, y) [m], or NOBODY."""
    nearest = NOBODY
    least = math.inf
    for item in world.progress.requested:
        if item != NOBODY:
            position = world.items.position[item]
            distance = length_of(position[0] - x, position[1] - y)
            if distance < least:
                nearest = item
                least = distance
    return nearest
