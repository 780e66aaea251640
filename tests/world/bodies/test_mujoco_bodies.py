"""MuJoCo's robots: they go where the package's own go, touch, slip and carry."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, run_episode
from swarm_logistics_env.core.errors import BodiesError
from swarm_logistics_env.policies import load
from swarm_logistics_env.world.bodies import Orders, Placement

pytest.importorskip("mujoco")
DRIVES = ("holonomic", "differential")


@pytest.mark.parametrize("name", ["wgl", "osmesa", "nothing"])
def test_bodies_need_nothing_that_draws(name: str) -> None:
    """A cluster may name in MUJOCO_GL what the machine does not have."""
    script = (
        "import os\nfrom swarm_logistics_env.world.bodies import load_bodies\n"
        "print(load_bodies('mujoco'), os.environ['MUJOCO_GL'])"
    )
    printed = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "MUJOCO_GL": name},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "MujocoBodies" in printed
    assert printed.split()[-1] == name


def placed(drive: Any, positions: Any, heading: float = 0.0, kinds: Any = ()) -> Any:
    """Return bodies of robots that look in one direction, in a room of 10 m x 10 m."""
    from swarm_logistics_env.world.bodies.mujoco_bodies import MujocoBodies

    position = np.array(positions, float)
    n = len(position)
    scenario = Scenario(
        bodies="mujoco",
        drive=drive,
        n_robots=n,
        max_acceleration=2.0,
        max_speed=1.0,
        robot_kinds=kinds,
    )
    bodies = MujocoBodies()
    nothing = np.zeros((0, 2)), np.zeros((0, 4))
    bodies.place(Placement(scenario, 0, position, np.full(n, heading), *nothing))
    return bodies


def orders(*motions: tuple[float, float, float], laden: bool = False) -> Orders:
    n = len(motions)
    return Orders(np.array(motions, float), np.full(n, laden), np.ones(n, np.bool_))


@pytest.mark.parametrize("drive", DRIVES)
def test_a_single_robot_goes_as_far_as_in_the_packages_own_engine(drive: str) -> None:
    ways, starts = {}, {}
    for bodies in ("chipmunk", "mujoco"):
        scenario = Scenario.preset("dots").replace(
            drive=drive, bodies=bodies, n_robots=1, n_items=1, warehouse_width=30.0,
            warehouse_height=30.0,
        )  # fmt: skip
        world = Warehouse(scenario)
        world.reset(seed=1)
        start = world.state.robot_position[0].copy()
        for step, forward in enumerate([1.0] * 30 + [0.0] * 15):
            world.step([[forward, 0.0, 0.0, 0.0]])
            if step == 3:
                starts[bodies] = np.linalg.norm(world.state.robot_velocity[0])
        ways[bodies] = np.linalg.norm(world.state.robot_position[0] - start)
        assert np.linalg.norm(world.state.robot_velocity[0]) < 0.05
    assert ways["mujoco"] == pytest.approx(ways["chipmunk"], rel=0.05)
    assert starts["mujoco"] == pytest.approx(starts["chipmunk"], rel=0.15)


@pytest.mark.parametrize(("drive", "left"), [("holonomic", 0.3), ("differential", 0.0)])
def test_a_robot_goes_whither_it_wants_in_its_own_frame(drive: str, left: float) -> None:
    bodies = placed(drive, [[5.0, 5.0]], heading=0.7)
    for _ in range(20):
        poses = bodies.move(orders((0.6, 0.3, 0.0)))
    ahead = np.array([np.cos(0.7), np.sin(0.7)])
    aside = np.array([-np.sin(0.7), np.cos(0.7)])
    assert poses.velocity[0] == pytest.approx(0.6 * ahead + left * aside, abs=0.01)


def test_kinds_of_either_drive_go_side_by_side_each_as_its_own_motors_can() -> None:
    kinds = "slides, wheels drive=differential, slow max_acceleration=0.5"
    positions = [(2.0, 2.0), (2.0, 4.0), (2.0, 6.0)]
    bodies = placed("holonomic", positions, kinds=kinds)
    for _ in range(10):
        poses = bodies.move(orders(*[(0.8, 0.3, 0.0)] * 3))
    way = poses.position - positions
    assert way[0, 0] > way[2, 0] > 0.1
    assert way[0, 1] > 0.1
    assert abs(way[1, 1]) < 0.01 < way[1, 0]
    assert poses.heading == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("drive", DRIVES)
def test_a_robot_turns_at_the_rate_that_it_wants(drive: str) -> None:
    bodies = placed(drive, [[5.0, 5.0]])
    headings = [float(bodies.move(orders((0.0, 0.0, 1.5))).heading[0]) for _ in range(10)]
    assert headings[-1] - headings[4] == pytest.approx(5 * 0.1 * 1.5, rel=0.05)


def test_a_simulation_that_explodes_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log there
    bodies = placed("holonomic", [[5.0, 5.0]])
    bodies._data.qvel[:] = 1e30
    with pytest.raises(BodiesError, match=r"unstable after .* should have a smaller max_acc"):
        bodies.move(orders((0.0, 0.0, 0.0)))


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize(
    ("kinds", "apart"), [("", 0.25), ("plain, small robot_radius=0.06", 0.185)]
)
def test_two_robots_that_press_together_do_not_enter_each_other(
    drive: str, kinds: str, apart: float
) -> None:
    bodies = placed(drive, [[4.0, 5.0], [5.0, 5.02]], kinds=kinds)
    for _ in range(40):
        poses = bodies.move(orders((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)))
    gap = float(np.linalg.norm(poses.position[0] - poses.position[1]))
    assert apart - 0.01 < gap < apart + 0.01


@pytest.mark.parametrize("drive", DRIVES)
def test_walls_stop_and_removed_robots_do_not(drive: str) -> None:
    bodies = placed(drive, [[8.5, 5.0], [9.2, 5.0]])
    both = orders((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    alone = both._replace(present=np.array([True, False]))
    for _ in range(40):
        poses = bodies.move(alone)
    assert poses.position[0, 0] == pytest.approx(10.0 - Scenario().robot_radius, abs=0.02)


def test_a_load_makes_a_wheeled_robot_slower_to_start() -> None:
    ways = []
    for laden in (False, True):
        bodies = placed("differential", [[2.0, 5.0]])
        for _ in range(3):
            poses = bodies.move(orders((1.0, 0.0, 0.0), laden=laden))
        ways.append(float(poses.position[0, 0]) - 2.0)
    assert 0.6 * ways[0] < ways[1] < 0.9 * ways[0]


def fast_robot(x: float, heading: float) -> Any:
    """Return the bodies of a robot with wheels of which 20 m/s2 are wanted."""
    from swarm_logistics_env.world.bodies.mujoco_bodies import MujocoBodies

    scenario = Scenario(bodies="mujoco", drive="differential", n_robots=1)
    bodies = MujocoBodies()
    start = np.array([[x, 5.0]]), np.array([heading])
    bodies.place(Placement(scenario, 0, *start, np.zeros((0, 2)), np.zeros((0, 4))))
    return bodies


def test_no_motor_is_stronger_than_what_rubber_holds() -> None:
    speed = float(fast_robot(2.0, 0.0).move(orders((2.0, 0.0, 0.0))).velocity[0, 0])
    assert 0.3 < speed <= 0.1 * 5.0


@pytest.mark.parametrize("heading", [0.0, 0.6])
def test_a_robot_that_presses_on_a_wall_still_turns(heading: float) -> None:
    bodies = fast_robot(10.0 - Scenario().robot_radius, heading)
    for _ in range(10):
        pressing = float(bodies.move(orders((2.0, 0.0, 0.0))).heading[0])
    assert abs(pressing - heading) < 0.1
    for _ in range(6):
        poses = bodies.move(orders((2.0, 0.0, 2.0)))
    assert float(poses.heading[0]) - heading > 0.4 * (6 * 0.1 * 2.0)


@pytest.mark.unmeasured
def test_an_episode_is_the_same_twice_and_no_item_vanishes() -> None:
    scenario = Scenario.preset("realistic").replace(
        bodies="mujoco", n_robots=6, n_items=12, duration=20.0
    )
    first, second = (run_episode(scenario, load("homing"), 0, ["FM1:1"]) for _ in range(2))
    assert first.digest == second.digest
    world = Warehouse(scenario)
    rows = world.reset(seed=0)
    for _ in range(50):
        rows = world.step(np.tile([0.5, 0.0, 0.2, 1.0], (6, 1)))
    assert np.isfinite(rows).all()
    assert len(world.state.item_status) == 12
    carried = world.state.robot_item[world.state.robot_item >= 0]
    assert len(set(carried.tolist())) == len(carried)


def test_robots_stay_outside_of_racks() -> None:
    scenario = Scenario(floor="aisles", bodies="mujoco", n_robots=8, duration=10.0)
    world = Warehouse(scenario)
    world.reset(seed=0)
    commands = np.tile([1.0, 0.3, 0.1, 0.0], (8, 1))
    for _ in range(100):
        world.step(commands)
        assert world.floor.is_free(world.state.robot_position).all()
