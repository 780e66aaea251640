"""Robots that come back work again, whichever policy steers them."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.policies.row_policy import RowPolicy
from swarm_logistics_env.world import observations as row

SMALL = Scenario(
    n_robots=8, n_items=14, warehouse_width=5.0, warehouse_height=4.0, duration=120.0, restock=True
)
STEERED = (
    "swarm-dt", "homing", "homing-stock", "site-fidelity", "central", "central-stock",
    "ppo-delivery", "ppo-robust",
)  # fmt: skip


@pytest.mark.parametrize("mode", ["dead", "away"])
@pytest.mark.parametrize("name", STEERED)
def test_a_swarm_that_comes_back_delivers_as_much_as_before(name: str, mode: str) -> None:
    fault = f"{mode}:8@40+20"
    times = run_episode(SMALL, policies.load(name), 0, [fault]).delivery_times
    before, meanwhile, after = np.histogram(times, [0.0, 40.0, 60.1, 120.0])[0]
    assert meanwhile <= 1  # as the fault begins
    assert after > 0.6 * before


@pytest.mark.parametrize("name", ["homing", "site-fidelity", "ppo-robust"])
def test_robots_that_are_out_forget_ways_sites_and_what_they_take_for_broken(name: str) -> None:
    policy = policies.load(name)
    assert isinstance(policy, RowPolicy)
    policy.configure(SMALL)
    policy.begin(np.arange(2, dtype=np.uint64))
    source = np.random.default_rng(1)
    ways = ["home_x", "home_y", "kept_x", "kept_y", "wall", "drift"]
    sites = ["trip_site_x", "trip_site_y"] if name == "site-fidelity" else []
    for _ in range(60):
        rows = source.uniform(0.0, 1.0, (2, row.N_COLUMNS)).astype(np.float32)
        policy.act(rows)
    before = {column: policy.memories()[column].copy() for column in ways + sites}
    assert all(numbers.all() for numbers in before.values())
    rows[1] = 0.0
    policy.act(rows)
    for column in before:
        is_known = policy.memories()[column] != 0.0
        assert is_known.tolist() == [True, False], column
