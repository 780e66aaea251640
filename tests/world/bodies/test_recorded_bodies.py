"""Where MuJoCo's bodies go, to the centimetre, as recorded: among each other, racks and items."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse
from tests.conftest import Check

mujoco = pytest.importorskip("mujoco")
RECORDED_WITH = "4.0.0"  # of mujoco, whose versions push otherwise
SMALL: dict[str, Any] = {
    "bodies": "mujoco", "n_robots": 7, "n_items": 9, "warehouse_width": 3.0, "restock": True,
    "warehouse_height": 2.5, "delivery_width": 0.8, "max_speed": 1.0, "max_acceleration": 2.0,
}  # fmt: skip
WORLDS = {
    "holonomic": Scenario(**SMALL),
    "differential": Scenario(**SMALL, drive="differential", n_obstacles=2),
    "among racks": Scenario(bodies="mujoco", n_robots=6, floor="aisles", max_speed=1.0),
    "of two sizes": Scenario(
        **SMALL
        | {"robot_kinds": "porter robot_mass=6.0 robot_radius=0.1, runner:3 drive=differential"}
    ),
}


@pytest.mark.skipif(mujoco.__version__ != RECORDED_WITH, reason="of another mujoco")
def test_bodies_go_as_recorded(check_recorded: Check) -> None:
    lines = []
    for name, scenario in WORLDS.items():
        world = Warehouse(scenario)
        world.reset(0, [Fault("dead", 1, onset=2.0), Fault("removed", 1, onset=1.0)])
        n = scenario.n_robots
        angles = 2.0 * np.pi * np.arange(n) / n
        for step in range(20):
            turn = np.sin(angles + step)
            grip = np.where((np.arange(n) + step // 8) % 2 == 0, 1.0, -1.0)
            towards = 1.3 * np.array([np.cos(angles + 0.1 * step), np.sin(angles + 0.1 * step)])
            world.step(np.column_stack([*towards, turn, grip]))
            if step % 5 == 4:
                state = world.state
                poses = np.column_stack(
                    [state.robot_position, np.cos(state.robot_heading), state.robot_velocity]
                )
                rounded = poses.round(2) + 0.0  # no -0
                texts = [" ".join(f"{number:.2f}" for number in pose) for pose in rounded]
                lines.append(f"{name}, {state.time:.1f} s: {', '.join(texts)}")
    check_recorded("bodies.txt", lines)
