"""Errors of sensors: noise, dropped beams, and what is missed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.world import observations as row
from tests.world.warehouse.conftest import Build


def beams(**fields: Any) -> NDArray[np.float32]:
    scenario = Scenario(n_robots=4, n_items=3, ranger_range=1.4, sensing_mix=(1.0, 0.5), **fields)
    return Warehouse(scenario).reset(0)[:, row.RANGE_WALLS : row.ITEMS]


def test_a_dropped_beam_reports_how_far_the_robot_itself_can_see() -> None:
    seen = beams(sensor_dropout=1.0)
    assert sorted(seen[:, 0]) == pytest.approx([0.7, 0.7, 1.4, 1.4])
    assert (seen == seen[:, :1]).all()


def test_noise_leaves_beams_that_meet_nothing_as_they_are() -> None:
    true, noisy = beams(), beams(ranger_noise=0.05)
    meets_nothing = true == true.max(axis=1, keepdims=True)
    np.testing.assert_array_equal(noisy[meets_nothing], true[meets_nothing])
    assert (noisy[~meets_nothing] != true[~meets_nothing]).any()
    assert (noisy <= true.max(axis=1, keepdims=True)).all()
    assert (noisy >= 0.0).all()


def test_what_is_not_there_has_no_noise(build: Build) -> None:
    rows = build([(5.0, 5.0)], [(1.0, 1.0)], position_noise=0.1).step(np.zeros((1, 4)))
    assert not rows[0, row.ITEMS : row.LOWEST_TIMER].any()


def test_what_is_missed_is_drawn_for_each_robot_thing_and_sense_alone(build: Build) -> None:
    positions = np.array([(1.0, 5.0), (1.4, 5.0), (2.0, 5.0)])
    world = build(
        positions, [(1.2, 5.5)], radio_loss=0.5, sensor_dropout=0.5, message_size=1, view_range=2.0
    )
    n, distance = len(positions), np.abs(positions[:, :1] - positions[:, 0])
    missed = []
    for _ in range(250):
        rows = world.step(np.hstack([np.zeros((n, 4)), np.ones((n, 1))]))
        heard, seen = np.zeros((n, n), bool), np.zeros((n, n), bool)
        for me in range(n):
            for rank in range(n - 1):
                column = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * rank
                if rows[me, column]:
                    other = np.abs(
                        distance[me] - np.hypot(*rows[me, column + 1 : column + 3])
                    ).argmin()
                    seen[me, other], heard[me, other] = True, rows[me, row.MESSAGES + rank]
        items = rows[:, row.ITEMS] > 0.5
        pairs = ~np.eye(n, dtype=bool)
        missed.append([*heard[pairs], *items, (seen & ~heard)[0, 2], (seen & ~heard)[2, 0]])
    shares = np.mean(missed, axis=0)
    assert shares[:9] == pytest.approx(np.full(9, 0.5), abs=0.12)
    assert shares[9:] == pytest.approx(np.full(2, 0.25), abs=0.1), "seen, though not heard"
    series = np.array(missed)[:, :9].T
    assert np.abs(np.corrcoef(series) - np.eye(9)).max() < 0.3
    for lag in (1, 2):  # what is missed tells nothing of what is missed later
        later = np.corrcoef(series[:, :-lag], series[:, lag:])[:9, 9:]
        assert np.abs(later).max() < 0.3


def test_every_error_is_drawn_by_itself(build: Build) -> None:
    positions = [(1.0, 1.0), (1.4, 1.0), (1.0, 1.4), (1.4, 1.4)]
    items = [(x + 0.2, y + 0.2) for x, y in positions] + [(0.6, 1.2), (1.2, 0.6)]
    exact, noisy = (
        build(positions, items, warehouse_width=3.0, warehouse_height=2.0, delivery_width=1.0,
              ranger_noise=noise, position_noise=noise)
        for noise in (0.0, 0.01)
    )  # fmt: skip
    stay = np.zeros((len(positions), 4))
    errors = np.array([(noisy.step(stay) - exact.step(stay)).ravel() for _ in range(60)])
    errors = errors[:, errors.std(axis=0) > 1e-4]
    assert errors.shape[1] > 100
    assert errors.std() == pytest.approx(0.01, rel=0.1)
    alike = np.corrcoef(errors.T) - np.eye(errors.shape[1])
    # The nearest teller of a timer stands in a row twice, each time with an error of its own.
    assert np.abs(alike).max() < 0.8
