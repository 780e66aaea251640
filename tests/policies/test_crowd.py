"""Robots of central control without a request: where they wait, and how they get there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.policies.crowd import approach, drift, share_items
from swarm_logistics_env.world.warehouse.state import CARRIED, NOBODY, STORED


def velocities(position: Any, goals: Any, worker: int = NOBODY, **changed: Any) -> Any:
    """Return what `drift` does, of robots that wait under no item and drive 0.2 m a period.

    They stop in 0.1 m.
    """
    position, goals = np.array(position, float), np.array(goals, float)
    fields = {
        "present": np.ones(len(position), np.bool_),
        "waits_under": np.full(len(position), NOBODY),
    } | changed
    return drift(position, fields["present"], goals, fields["waits_under"], worker, 0.2, 0.1)


def test_a_robot_alone_drives_to_its_goal_and_is_there_in_one_period_if_it_can() -> None:
    np.testing.assert_allclose(velocities([[1, 1]], [[1, 3]]), [[0, 1]])
    np.testing.assert_allclose(velocities([[1, 1]], [[1.05, 1]]), [[0.25, 0]])


def test_a_robot_slows_down_as_its_brakes_need_it() -> None:
    speeds = [approach(0.0, distance, 0.2, 4.0)[1] for distance in (9.0, 4.0, 1.0, 0.25)]
    assert speeds == pytest.approx([1.0, 1.0, 0.5, 0.25])
    assert approach(0.01, 0.0, 0.2, 4.0) == (0.05, 0.0)  # it is there in one period


def test_near_robots_push_each_other_aside_and_pass_on_the_right() -> None:
    places = [[1.0, 1.0], [1.3, 1.0]]
    left, right = velocities(places, places)
    assert left == pytest.approx(-right)
    assert left[0] < 0.0  # away from the other, half a metre to the right of it
    assert left[1] == pytest.approx(-0.5 * left[0])
    far = [[1.0, 1.0], [1.7, 1.0]]
    assert not velocities(far, far).any()


def test_all_give_way_to_the_worker_but_who_waits_under_an_item_or_is_not_there() -> None:
    places = [[1.0, 1.0], [1.5, 1.0]]
    usual, given_way = (velocities(places, places, worker)[0, 0] for worker in (NOBODY, 1))
    assert given_way == pytest.approx(3 * usual)
    under = np.array([4, NOBODY])
    assert not velocities(places, places, 1, waits_under=under)[0].any()
    present = np.array([True, False])
    assert not velocities(places, places, 1, present=present)[0].any()


ITEMS = np.array([[1.0, 1.0], [2.0, 1.0], [9.0, 1.0]])


def shared(
    n_robots: int, waits_under: list[int], is_free: list[bool] | None = None, waits: Any = True
) -> tuple[list[int], NDArray[np.float64]]:
    """Return the items of robots at (0, 1), and their goals."""
    position, goals = np.tile([0.0, 1.0], (n_robots, 1)), np.full((n_robots, 2), -1.0)
    items = np.array(waits_under)
    status = np.where(is_free or [True] * len(ITEMS), STORED, CARRIED)
    share_items(position, ITEMS, status, NOBODY, np.full(n_robots, waits), items, goals)
    return items.tolist(), goals


def test_the_first_waits_under_the_nearest_item_and_the_next_far_from_it() -> None:
    items, goals = shared(2, [NOBODY, NOBODY])
    assert items == [0, 2]  # 8 m from the first item, less half of 9 m, is more than 1 less 1
    np.testing.assert_array_equal(goals, ITEMS[items])


def test_nobody_waits_under_the_requested_item() -> None:
    items, goals = np.array([0]), np.zeros((1, 2))
    share_items(ITEMS[:1], ITEMS, np.full(3, STORED), 0, np.array([True]), items, goals)
    assert items.tolist() == [1]


def test_an_item_is_kept_while_it_is_free_and_nobody_waits_under_one_that_is_not() -> None:
    assert shared(1, [1])[0] == [1]
    assert shared(1, [1], [True, False, True])[0] == [0]
    items, goals = shared(3, [NOBODY] * 3, [True, False, False])
    assert items == [0, NOBODY, NOBODY]
    assert (goals[1:] == -1.0).all()
    assert shared(2, [0, 1], waits=False)[0] == [NOBODY, NOBODY]
