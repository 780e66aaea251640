"""DotBots in their simulator: they go where they are sent; who cannot be followed is stopped."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, run_episode
from swarm_logistics_env.core.errors import BodiesError
from swarm_logistics_env.policies import load
from swarm_logistics_env.world.bodies import Orders, Placement, Poses, load_bodies

pytest.importorskip("dotbot", reason="needs the extra dotbots")
ROOM = Scenario.preset("dotbots").replace(bodies="dotbots", n_robots=2, n_items=2, n_requests=1)


def placed(
    positions: Any = ((1.0, 0.5), (1.0, 1.5)),
    headings: Any = (0.0, 0.5),
    scenario: Scenario = ROOM,
    boxes: Any = None,
) -> Any:
    bodies = load_bodies("dotbots")
    assert bodies is not None
    position, heading = np.array(positions), np.array(headings)
    boxes = np.zeros((0, 4)) if boxes is None else np.array(boxes)
    bodies.place(Placement(scenario, 3, position, heading, np.zeros((0, 2)), boxes))
    return bodies


def drive(bodies: Any, seconds: float, *motions: tuple[float, float]) -> Poses:
    """Drive each robot forward [m/s] and around [rad/s]; return the last poses."""
    motion = np.array([(forward, 0.0, turn_rate) for forward, turn_rate in motions])
    flags = np.zeros(len(motion), np.bool_)
    for _ in range(round(10 * seconds)):
        poses: Poses = bodies.move(Orders(motion, flags, ~flags))
    return poses


def test_robots_drive_along_their_headings_and_report_where_they_are() -> None:
    bodies = placed()
    poses = drive(bodies, 1.5, (0.2, 0.0), (0.2, 0.0))
    assert poses.velocity[0] == pytest.approx([0.2, 0.0], abs=0.1)
    poses = drive(bodies, 1.0, (0.0, 0.0), (0.0, 0.0))
    expected = [[1.3, 0.5], [1.0 + 0.3 * np.cos(0.5), 1.5 + 0.3 * np.sin(0.5)]]
    assert poses.position == pytest.approx(np.array(expected), abs=0.05)
    assert poses.heading == pytest.approx([0.0, 0.5], abs=0.15)


def test_a_robot_turns_to_the_left_at_the_rate_that_it_wants() -> None:
    bodies = placed()
    drive(bodies, 2.0, (0.0, 1.0), (0.0, -1.0))
    heading = drive(bodies, 1.0, (0.0, 0.0), (0.0, 0.0)).heading
    turned = np.angle(np.exp(1j * (heading - [0.0, 0.5])))
    assert turned == pytest.approx([2.0, -2.0], abs=0.3)


@pytest.mark.unmeasured
def test_a_fence_stops_robots_at_the_walls_that_the_simulator_has_not() -> None:
    bodies = placed(headings=(0.0, np.pi))
    poses = drive(bodies, 10.0, (0.3, 0.0), (0.3, 0.0))
    assert 1.8 < poses.position[0, 0] < 2.0
    assert 0.0 < poses.position[1, 0] < 0.2
    poses = drive(bodies, 2.0, (-0.3, 0.0), (-0.3, 0.0))
    assert poses.position[0, 0] < 1.6


def test_robots_block_each_other_and_a_removed_one_nobody() -> None:
    bodies = placed(((0.5, 1.0), (1.0, 1.0)), (0.0, 0.0))
    assert drive(bodies, 4.0, (0.3, 0.0), (0.0, 0.0)).position[0, 0] < 0.95
    motion = np.array([(0.3, 0.0, 0.0), (0.0, 0.0, 0.0)])
    for _ in range(60):
        orders = Orders(motion, np.zeros(2, np.bool_), np.array([True, False]))
        poses = bodies.move(orders)
    assert poses.position[0, 0] > 1.2


def test_a_robot_that_lighthouses_do_not_see_is_stopped_until_they_do() -> None:
    bodies = placed(headings=(np.pi / 2, 0.0))
    robot = bodies._simulator.dotbots[0]
    drive(bodies, 1.0, (0.1, 0.0), (0.0, 0.0))
    robot.lh2_visible = False
    drive(bodies, 2.0, (0.1, 0.0), (0.0, 0.0))
    assert robot.v_left == 0.0
    robot.lh2_visible = True
    poses = drive(bodies, 6.0, (0.1, 0.0), (0.0, 0.0))
    assert not poses.lost.any()
    assert robot.v_left > 50.0


def test_a_robot_that_a_hand_holds_is_stopped_and_goes_on_when_it_is_let_go() -> None:
    bodies = placed()
    robot = bodies._simulator.dotbots[0]
    robot.held = True
    drive(bodies, 1.0, (0.2, 0.0), (0.0, 0.0))
    assert bodies._guard.speed_share.tolist() == [0.0, 1.0]
    robot.held = False
    drive(bodies, 3.0, (0.2, 0.0), (0.0, 0.0))
    assert bodies._guard.speed_share.tolist() == [1.0, 1.0]
    assert robot.v_left > 100.0


def test_a_robot_that_falls_silent_is_lost() -> None:
    bodies = placed()
    silent, receive = int(bodies._simulator.addresses[0], 16), bodies._receive

    def receive_others(frame: Any) -> None:
        if int(frame.header.source) != silent:
            receive(frame)

    bodies._simulator.on_frame_received = receive_others
    assert drive(bodies, 11.0, (0.1, 0.0), (0.0, 0.0)).lost.tolist() == [True, False]
    assert bodies._simulator.dotbots[0].v_left == 0.0


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"drive": "holonomic"}, "should be differential"),
        ({"control_period": 0.035, "physics_period": 0.005}, "should be a multiple of 0.01 s"),
        ({"max_speed": 0.6}, "wheel would run at 0.80 m/s; should be at most 0.7"),
        ({"robot_kinds": "plain, ball drive=holonomic"}, "should be differential"),
        ({"robot_kinds": "plain, fast max_speed=0.6"}, "wheel would run at 0.80 m/s"),
        ({"robot_radius": 0.06}, "DotBots have 0.05 m"),
        ({"robot_kinds": "plain, tiny robot_radius=0.04"}, "robot_radius = 0.04 m: DotBots have"),
        ({"warehouse_width": 70.0}, "should be at most 60.0 m"),
    ],
)
def test_what_dotbots_have_not_is_refused(changed: dict[str, Any], message: str) -> None:
    with pytest.raises(BodiesError, match=message):
        placed(scenario=ROOM.replace(**changed))


def test_racks_and_obstacles_are_refused() -> None:
    with pytest.raises(BodiesError, match="should be an empty room"):
        placed(boxes=[[0.5, 0.5, 0.6, 0.6]])
    with pytest.raises(BodiesError, match=r"n_obstacles: .* should be an empty room"):
        Warehouse(ROOM.replace(n_obstacles=1, obstacle_radius=0.05)).reset(seed=0)


@pytest.mark.daily
def test_twenty_dotbots_deliver_and_equal_seeds_give_equal_bits(
    capsys: pytest.CaptureFixture[str],
) -> None:
    scenario = Scenario.preset("dotbots").replace(bodies="dotbots", duration=20.0)
    policy = load("ppo-robust")
    assert run_episode(scenario, policy, seed=0).delivered > 0
    short = scenario.replace(duration=5.0)
    digests = [run_episode(short, policy, seed).digest for seed in (0, 0, 1)]
    assert digests[0] == digests[1] != digests[2]
    assert "DotBot" not in capsys.readouterr().out
