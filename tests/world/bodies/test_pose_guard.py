"""Robots whose poses freeze, jump or stay away are stopped, and go on when they answer again."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env.world.bodies.pose_guard import PoseGuard

PERIOD, SPEED = 0.1, 0.3  # [s], [m/s]
WITHIN_A_SECOND = 10  # periods
# Shares of speed of who gives no sign of motion for 4 s: half a second of each 2 s it tries.
TRIES = [1.0] * 4 + [0.0] * 14 + [0.3] * 5 + [0.0] * 15 + [0.3] * 2


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
    assert shares == [1.0] * 4 + [0.0] * 6  # after half a second
    assert (watched.guard.velocity[0] == 0.0).all()


def test_a_frozen_robot_tries_slowly_and_goes_on_once_its_pose_changes(watched: Watched) -> None:
    shares = [watched.step(moves=False) for _ in range(40)]
    assert shares == TRIES
    assert any(watched.step() == 1.0 for _ in range(25))


def test_a_robot_that_stands_undriven_is_not_frozen(watched: Watched) -> None:
    assert {watched.step(driven=False) for _ in range(50)} == {1.0}
    # What counts is for how long it is driven without motion.
    shares = [watched.step(moves=False, driven=step % 2 == 0) for step in range(10)]
    assert shares == [1.0] * 8 + [0.0] * 2


@pytest.mark.parametrize(("distance", "turn", "share"), [
    (0.0005, 0.0, 1.0), (0.0003, 0.0, 0.0), (0.0, 0.5, 1.0), (0.0, -0.5, 1.0), (0.0, 0.3, 0.0),
])  # fmt: skip
def test_less_than_two_millimetres_and_two_degrees_in_half_a_second_is_no_motion(
    distance: float, turn: float, share: float
) -> None:
    guard = PoseGuard(np.zeros((1, 2)), np.zeros(1), PERIOD, SPEED)
    yes = np.array([True])
    for step in range(1, 6):
        guard.update(np.array([[0.0, distance * step]]), np.radians([turn * step]), yes, yes)
    assert guard.speed_share[0] == share


@pytest.mark.parametrize(("periods", "reach"), [(1, 0.095), (3, 0.185), (6, 0.32), (9, 0.32)])
def test_a_pose_is_believed_as_far_as_a_robot_can_have_driven_since_the_last(
    periods: int, reach: float
) -> None:
    for off, is_believed in ((reach - 0.001, True), (reach + 0.001, False)):
        guard = PoseGuard(np.zeros((1, 2)), np.zeros(1), PERIOD, SPEED)
        for period in range(1, periods + 1):
            heard = np.array([period == periods])
            pose = np.array([[0.6 * off, -0.8 * off]]), np.array([1.0])
            guard.update(*pose, heard, np.array([False]))
        assert guard.position[0] == pytest.approx(
            [0.6 * off * is_believed, -0.8 * off * is_believed]
        )
        assert guard.heading[0] == float(is_believed)
        velocity = [0.6 * off / (0.1 * periods), -0.8 * off / (0.1 * periods)]
        assert guard.velocity[0] == pytest.approx(velocity if is_believed else [0.0, 0.0])
        assert guard.age[0] == pytest.approx(0.0 if is_believed else 0.1 * periods)
        assert guard.speed_share[0] == float(is_believed)


def test_a_robot_that_jumps_is_stopped_at_once_and_its_pose_not_believed(
    watched: Watched,
) -> None:
    assert watched.step(off=1.0) == 0.0
    assert watched.guard.position[0, 0] < 0.3
    assert watched.step() == 1.0


def test_a_robot_that_jumps_to_and_fro_stays_stopped(watched: Watched) -> None:
    shares = [watched.step(off=1.0 + 0.5 * (step % 2)) for step in range(50)]
    assert set(shares) == {0.0}


@pytest.mark.parametrize("way", [0.4, 1.0])
def test_a_robot_that_a_hand_has_moved_goes_on_from_where_it_is(
    watched: Watched, way: float
) -> None:
    shares, speeds = [], []
    for _ in range(5):
        shares.append(watched.step(off=way))
        speeds.append(float(watched.guard.velocity[0, 0]))
    assert shares == [0.0] * 3 + [1.0] * 2  # once three more poses agree
    assert speeds == pytest.approx([0.0] * 4 + [SPEED])  # a jump is no speed
    assert watched.guard.position[0, 0] == pytest.approx(watched.x + way)


def test_poses_agree_on_where_a_hand_put_a_robot_to_within_five_centimetres(
    watched: Watched,
) -> None:
    shares = [watched.step(off=1.0 + 0.051 * (step % 2)) for step in range(9)]
    assert shares == [0.0] * 9
    shares = [watched.step(off=2.0 + 0.03 * step) for step in range(9)]  # it is still on its way
    assert shares == [0.0] * 9
    shares = [watched.step(off=1.2 + 0.049 * (step % 2)) for step in range(5)]
    assert shares == [0.0] * 3 + [1.0] * 2


def test_a_silent_robot_is_stopped_without_tries_and_a_late_answer_lets_it_go_on(
    watched: Watched,
) -> None:
    shares = [watched.step(heard=False) for _ in range(99)]
    assert shares == [1.0] * 4 + [0.0] * 95
    assert not watched.guard.lost.any()
    assert watched.step() == 1.0


def test_a_robot_that_stays_silent_is_lost_for_good(watched: Watched) -> None:
    for _ in range(100):  # 10 s
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
    assert [watched.step(has_pose=False) for _ in range(40)] == TRIES
    assert watched.step() == 1.0
    assert [watched.step(has_pose=False, driven=False) for _ in range(40)] == TRIES
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
    for _ in range(5):  # then it does freeze
        position[1, 0] += PERIOD * SPEED
        guard.update(position.copy(), guard.heading.copy(), both, both)
    assert guard.speed_share.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("pose", [(np.nan, 0.0, 0.5), (0.01, np.nan, 0.5), (0.01, 0.0, np.nan)])
def test_a_pose_of_which_a_number_is_missing_is_none(pose: tuple[float, float, float]) -> None:
    guard = PoseGuard(np.zeros((1, 2)), np.zeros(1), PERIOD, SPEED)
    shares = []
    for _ in range(40):
        x, y, heading = pose
        guard.update(np.array([[x, y]]), np.array([heading]), np.array([True]), np.array([True]))
        shares.append(float(guard.speed_share[0]))
    assert shares == TRIES
    assert [*guard.position[0], guard.heading[0]] == [0.0, 0.0, 0.0]
    assert guard.age[0] == pytest.approx(4.0)
