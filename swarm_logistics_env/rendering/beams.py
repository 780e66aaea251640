"""The ends of one robot's sensor beams, by the scan that the world itself makes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.rangers import Pose, scan_disc, scan_walls
from swarm_logistics_env.warehouse.state import STORED, WarehouseState

N_BEAMS = 16


def ranges(state: WarehouseState, scenario: Scenario, robot: int) -> NDArray[np.float32]:
    """Return how far each beam of `robot` sees robots, walls and free items: (3, N_BEAMS) [m].

    Walls include obstacles. A beam that meets nothing reads the robot's ranger range, all of them
    read 0 for a robot that is blind.
    """
    reach = state.ranger_range[robot]
    scans = np.full((3, N_BEAMS), reach, np.float32)
    if reach == 0.0:
        return scans
    x, y = state.robot_position[robot].tolist()
    heading = float(state.robot_heading[robot])
    cosine, sine = math.cos(heading), math.sin(heading)
    others = state.robot_present.copy()
    others[robot] = False
    pose = Pose(x, y, cosine, sine)
    scan_walls(pose, scenario.warehouse_width, scenario.warehouse_height, scans[1])
    for scan, centres, radius in (
        (scans[0], state.robot_position[others], scenario.robot_radius),
        (scans[1], state.obstacle_position, scenario.obstacle_radius),
        (scans[2], state.item_position[state.item_status == STORED], scenario.item_radius),
    ):
        for centre_x, centre_y in centres.tolist():
            dx, dy = centre_x - x, centre_y - y
            square = dx * dx + dy * dy
            if square < (reach + radius) ** 2:
                scan_disc(dx * cosine + dy * sine, dy * cosine - dx * sine, square, radius, scan)
    return scans
