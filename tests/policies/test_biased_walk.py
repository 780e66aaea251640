"""The biased walk, row by row: it goes as its source describes, with a compass and without."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse, run_episode
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.world import observations as row

STEP = Scenario(n_robots=11, max_speed=2.0, control_period=0.01, physics_period=0.01)
SMALL = Scenario(
    n_robots=10, n_items=24, warehouse_width=7.0, warehouse_height=5.0, duration=60.0, restock=True
)


def rows_of(n_robots: int, *things: tuple[int, list[float]]) -> NDArray[np.float32]:
    """Rows of robots that sense these things alone: from a column on, its values."""
    rows = np.zeros((n_robots, row.N_COLUMNS), np.float32)
    rows[:, row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS] = 2.0
    for column, values in things:
        rows[:, column : column + len(values)] = values
    return rows


def walkers(n_robots: int, **parameters: Any) -> Any:
    policy = load("biased-walk", **parameters)
    start(policy, STEP.replace(n_items=1, n_robots=11), seed=0)
    policy.reset(n_robots, 0)
    return policy


LADEN, DELIVERING = (row.CARRYING, [1.0, 0.0]), (row.CARRYING, [1.0, 1.0])
IN_FRONT = [1.0, 0.25, 0.0]
# Of ten others, a quarter of a metre away: 9375 / 10 x 0.25 exp(-4) unit vectors.
PUSH = 937.5 * 0.25 * math.exp(-4.0)


def test_a_step_turns_the_heading_by_half_a_radian_at_most_and_drops_three_in_a_hundred() -> None:
    policy = walkers(4000)
    headings = []
    for _ in range(2):
        commands = policy.act(rows_of(4000, LADEN))
        headings.append(np.arctan2(commands[:, 1], commands[:, 0]))
    turns = (headings[1] - headings[0] + math.pi) % math.tau - math.pi
    assert 0.49 < np.abs(turns).max() <= 0.5 + 1e-9
    assert (commands[:, 3] < 0.0).mean() == pytest.approx(0.03, abs=0.01)
    np.testing.assert_allclose(np.hypot(*commands[:, :2].T), 1.0)


@pytest.mark.parametrize(
    ("things", "push"),
    [
        (((row.NEIGHBOURS, IN_FRONT),), PUSH),
        (((row.ITEMS, IN_FRONT),), 0.0),
        (((row.ITEMS, IN_FRONT), LADEN), PUSH),
        (((row.RANGE_WALLS, [0.13]),), 13.0 / math.e),
    ],
)
def test_pushes_are_as_large_as_published_and_turn_no_stored_heading(
    things: tuple[tuple[int, list[float]], ...], push: float
) -> None:
    policy = walkers(8, diffusion=0.0)
    plain = policy.act(rows_of(8))[:, :2]
    pushed = policy.act(rows_of(8, *things))[:, :2]
    expected = plain - np.array([push, 0.0])
    expected /= np.hypot(*expected.T)[:, np.newaxis]
    np.testing.assert_allclose(pushed, expected, atol=1e-5)
    np.testing.assert_allclose(policy.act(rows_of(8))[:, :2], plain, atol=1e-9)


def test_only_who_delivers_tends_to_where_it_entered() -> None:
    policy = walkers(8, diffusion=0.0)
    moving = row.VELOCITY, [0.0, 2.0]
    plain = policy.act(rows_of(8, moving))[:, :2]
    np.testing.assert_allclose(policy.act(rows_of(8, DELIVERING))[:, :2], plain, atol=1e-9)
    policy.act(rows_of(8, moving, (row.IN_DELIVERY_AREA, [1.0])))  # enters to its left
    policy.act(rows_of(8))
    np.testing.assert_allclose(policy.act(rows_of(8, LADEN))[:, :2], plain, atol=1e-9)
    biased = policy.act(rows_of(8, DELIVERING))[:, :2]
    expected = plain + np.array([0.0, 1.0])
    expected /= np.hypot(*expected.T)[:, np.newaxis]
    np.testing.assert_allclose(biased, expected, atol=1e-6)


def test_a_compass_shows_the_delivery_area_whatever_the_robot_faces() -> None:
    world = Warehouse(STEP)
    world.reset(0)
    policy = load("biased-walk-compass", diffusion=0.0, bias=1e6)
    start(policy, STEP, seed=0)
    commands = policy.act(rows_of(11, DELIVERING), world.state)  # type: ignore[call-arg]
    heading = world.state.robot_heading
    assert np.ptp(heading) > 1.0
    ahead, aside = commands[:, 0], commands[:, 1]
    eastwards = np.cos(heading) * ahead - np.sin(heading) * aside
    np.testing.assert_allclose(eastwards, 1.0, atol=1e-5)


@pytest.mark.compiled
def test_with_a_compass_it_delivers_more_than_without_a_bias() -> None:
    def delivered(name: str, **parameters: Any) -> int:
        episodes = (run_episode(SMALL, load(name, **parameters), seed) for seed in range(3))
        return sum(episode.delivered for episode in episodes)

    assert delivered("biased-walk-compass") > 2 * delivered("biased-walk", bias=0.0)
