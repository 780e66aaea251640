"""The central-place forager: its trip, from leaving the area to coming back to a site."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import poisson

from swarm_logistics_env import Fault, Scenario, Warehouse, run_episode
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.policies.site_fidelity import (
    GIVES_UP,
    GOES_TO_SITE,
    LEAVES,
    SEARCHES,
    SEARCHES_SITE,
    TRIP,
    poisson_at_most,
)
from swarm_logistics_env.world import observations as row
from tests.policies.test_biased_walk import SMALL, rows_of

N = 1000
LADEN = row.CARRYING, [1.0, 1.0]
INSIDE = row.IN_DELIVERY_AREA, [1.0]
EASTWARDS = row.VELOCITY, [1.0, 0.0]


def foragers(**parameters: Any) -> Any:
    policy = load("site-fidelity", **parameters)
    start(policy, Scenario(max_speed=0.8), seed=0)  # a period is a step
    policy.reset(N, 0)
    return policy


def modes(policy: Any) -> NDArray[np.float64]:
    return np.array(policy._trips[:, TRIP.mode])


def bring_home(policy: Any, n_around: int) -> None:
    """Let all lift an item with others around it, drive two metres east, and deliver it."""
    others = [(row.ITEMS + row.ITEM_WIDTH * item, [1.0, 0.3, 0.0]) for item in range(n_around)]
    policy.act(rows_of(N, LADEN, *others))
    for _ in range(20):
        policy.act(rows_of(N, LADEN, EASTWARDS))
    policy.act(rows_of(N, LADEN, INSIDE, EASTWARDS))
    policy.act(rows_of(N, INSIDE))


def test_it_leaves_then_searches_then_gives_up_at_the_published_rates() -> None:
    policy = foragers(give_up_rate=0.2)
    policy.act(rows_of(N))
    assert (modes(policy) == SEARCHES).mean() == pytest.approx(0.504, abs=0.05)
    for _ in range(20):
        policy.act(rows_of(N))
    assert set(modes(policy)) <= {SEARCHES, GIVES_UP}
    assert (modes(policy) == GIVES_UP).mean() > 0.9
    policy.act(rows_of(N, INSIDE))
    assert (modes(policy) == LEAVES).mean() > 0.9


def test_a_search_turns_by_seven_degrees_a_step() -> None:
    policy = foragers(search_rate=0.999999, give_up_rate=0.0)
    for _ in range(2):
        before = policy.act(rows_of(N))[:, :2]
    after = policy.act(rows_of(N))[:, :2]
    turns = np.arctan2(
        before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1)
    )
    assert np.degrees(turns.std()) == pytest.approx(7.0, rel=0.1)


@pytest.mark.parametrize("n_around", [0, 3])
def test_it_comes_back_to_a_site_the_more_often_the_more_lies_there(n_around: int) -> None:
    policy = foragers()
    bring_home(policy, n_around)
    share = poisson.cdf(1 + n_around, 4.27)
    assert poisson_at_most(1.0 + n_around, 4.27) == pytest.approx(share)
    assert (modes(policy) == GOES_TO_SITE).mean() == pytest.approx(share, abs=0.05)


def test_it_finds_its_site_by_odometry_and_searches_there_in_wide_turns() -> None:
    policy = foragers(site_rate=0.0, give_up_rate=0.0)  # it always returns
    bring_home(policy, 0)
    assert (modes(policy) == GOES_TO_SITE).all()
    commands = policy.act(rows_of(N))
    np.testing.assert_allclose(commands[:, :2], [[-1.0, 0.0]] * N, atol=1e-6)
    for _ in range(21):
        policy.act(rows_of(N, (row.VELOCITY, [-1.0, 0.0])))
    assert (modes(policy) == SEARCHES_SITE).all()
    commands = policy.act(rows_of(N))
    assert np.hypot(*commands[:, :2].mean(axis=0)) < 0.1  # to all sides


@pytest.mark.compiled
def test_nobody_lifts_what_is_not_requested() -> None:
    world = Warehouse(SMALL)
    policy = load("site-fidelity")
    start(policy, SMALL, seed=0)
    world.reset(0)
    n_laden = 0
    for _ in range(SMALL.n_steps):
        world.step(policy.act(world.observe()))
        carried = {item for item in world.state.robot_item.tolist() if item >= 0}
        assert len(carried) <= 1
        n_laden += len(carried)
    assert n_laden > 0
    assert len(world.state.delivery_times) > 0


@pytest.mark.compiled
@pytest.mark.parametrize("mode", ["FM1", "FM3", "FM4", "removed"])
def test_it_goes_on_with_robots_that_fail(mode: str) -> None:
    assert run_episode(SMALL, load("site-fidelity"), 0, (Fault(mode, 2),)).delivered >= 4
