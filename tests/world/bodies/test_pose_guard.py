"""Robots whose poses freeze, jump or stay away are stopped, and go on when they answer again."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env.world.bodies import pose_guard
from swarm_logistics_env.world.bodies.pose_guard import PoseGuard

PERIOD, SPEED = 0.1, 0.3  # [s], [m/s]
WITHIN_A_SECOND = 10  # periods


class Watched:
    """A robot that drives along x, and what its guard hears; robot 1 never has any trouble."""

    def __init__(self) -> None:
        self.guard = PoseGuard(np.array([[0.0, 0.0], [0.0, 1.0]]), np.zeros(2), PERIOD, SPEED)
        self.x = 0.0
        self.other = 0.0

    def step(
        self,
        *,
        moves: bool = True,
        heard: bool = True,
        has_pose: bool = True,
        driven: bool = True,
        off: float = 0.0,
    ) -> float:
        """Report a period, its pose `off` by so much [m]; return the share of speed after it."""
        is_driven = driven and bool(self.guard.speed_share[0] > 0.0)
        if moves and is_driven:
            self.x += PERIOD * SPEED * float(self.guard.speed_share[0])
        self.other += PERIOD * SPEED
        position = np.array([[self.x + off, 0.0], [self.other, 1.0]])
        heading = np.zeros(2)
        if not (heard and has_pose):
            position[0], heading[0] = np.nan, np.nan
        self.guard.update(position, heading, np.array([heard, True]), np.array([is_driven, True]))
        assert self.guard.speed_share[1] == 1.0
        return float(self.guard.speed_share[0])


@pytest.fixture
def watched() -> Watched:
    robot = Watched()
    for _ in range(5):
        assert robot.step() == 1.0
    assert robot.guard.velocity == pytest.approx(np.array([[SPEED, 0.0], [SPEED, 0.0]]))
    return robot


def test_a_robot_whose_pose_freezes_though_it_is_driven_is_stopped(watched: Watched) -> None:
    shares = [watched.step(moves=False) for _ in range(WITHIN_A_SECOND)]
    assert shares[-1] == 0.0
    assert (watched.guard.velocity[0] == 0.0).all()


def test_a_frozen_robot_tries_slowly_and_goes_on_once_its_pose_changes(watched: Watched) -> None:
    shares = [watched.step(moves=False) for _ in range(40)]
    stopped = shares.index(0.0)
    assert set(shares[stopped:]) == {0.0, pose_guard.TRY_SHARE}
    assert np.mean(np.array(shares[stopped:]) > 0.0) < 0.4
    assert any(watched.step() == 1.0 for _ in range(25))


def test_a_robot_that_stands_undriven_is_not_frozen(watched: Watched) -> None:
    assert {watched.step(driven=False) for _ in range(50)} == {1.0}


def test_a_robot_that_jumps_is_stopped_at_once_and_its_pose_not_believed(
    watched: Watched,
) -> None:
    assert watched.step(off=1.0) == 0.0
    assert watched.guard.position[0, 0] < 0.3
    assert watched.step() == 1.0


def test_a_robot_that_jumps_to_and_fro_stays_stopped(watched: Watched) -> None:
    shares = [watched.step(off=1.0 + 0.5 * (step % 2)) for step in range(50)]
    assert set(shares) == {0.0}


def test_a_robot_that_a_hand_has_moved_goes_on_from_where_it_is(watched: Watched) -> None:
    shares = [watched.step(off=1.0) for _ in range(WITHIN_A_SECOND)]
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    assert watched.guard.position[0, 0] == pytest.approx(watched.x + 1.0)
    assert np.linalg.norm(watched.guard.velocity[0]) <= 1.01 * SPEED


def test_a_silent_robot_is_stopped_without_tries_and_a_late_answer_lets_it_go_on(
    watched: Watched,
) -> None:
    periods = round(pose_guard.LOST_AFTER / PERIOD) - 1
    shares = [watched.step(heard=False) for _ in range(periods)]
    assert set(shares[WITHIN_A_SECOND:]) == {0.0}
    assert not watched.guard.lost.any()
    assert watched.step() == 1.0


def test_a_robot_that_stays_silent_is_lost_for_good(watched: Watched) -> None:
    for _ in range(round(pose_guard.LOST_AFTER / PERIOD)):
        watched.step(heard=False)
    assert watched.guard.lost.tolist() == [True, False]
    watched.step()
    assert watched.guard.lost.tolist() == [True, False]


def test_a_lost_message_or_two_stops_nobody_and_velocity_is_over_all_the_time(
    watched: Watched,
) -> None:
    for _ in range(10):
        assert [watched.step(heard=False), watched.step(heard=False), watched.step()] == [1.0] * 3
        assert watched.guard.velocity[0, 0] == pytest.approx(SPEED)


def test_a_robot_that_answers_without_a_pose_is_stopped_and_tries(watched: Watched) -> None:
    shares = [watched.step(has_pose=False) for _ in range(40)]
    assert set(shares[WITHIN_A_SECOND:]) == {0.0, pose_guard.TRY_SHARE}
    assert not watched.guard.lost.any()
    assert watched.step() == 1.0


@pytest.mark.parametrize("turn", [0.2, -0.2, np.radians(0.6)])
def test_a_robot_that_turns_on_the_spot_to_either_side_is_not_taken_for_frozen(
    watched: Watched, turn: float
) -> None:
    guard = watched.guard
    position = guard.position.copy()
    heading = np.zeros(2)
    for _ in range(3 * WITHIN_A_SECOND):
        heading[0] += turn  # past half a turn, too
        position[1, 0] += PERIOD * SPEED
        both = np.array([True, True])
        guard.update(position.copy(), np.angle(np.exp(1j * heading)), both, both)
        assert guard.speed_share[0] == 1.0
