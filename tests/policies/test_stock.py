"""The scripts that keep a stock beside the delivery area."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, run_episode
from swarm_logistics_env import observations as row
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies import load

SMALL = Scenario(
    n_robots=10, n_items=24, warehouse_width=7.0, warehouse_height=5.0, duration=60.0, restock=True
)
WITHOUT_STOCK = {"homing-stock": "homing", "central-stock": "central"}


@pytest.mark.parametrize("name", WITHOUT_STOCK)
def test_a_stock_brings_more_deliveries(name: str) -> None:
    scenario = SMALL.replace(duration=200.0)  # the stock is laid in first
    with_stock, without = (
        sum(run_episode(scenario, load(policy), seed).delivered for seed in range(3))
        for policy in (name, WITHOUT_STOCK[name])
    )
    assert with_stock > 1.1 * without


@pytest.mark.parametrize("name", WITHOUT_STOCK)
def test_the_same_seed_gives_the_same_bits(name: str) -> None:
    scenario, policy = SMALL.replace(duration=20.0), load(name)
    digests = [run_episode(scenario, policy, seed).digest for seed in (0, 1, 0)]
    assert digests[0] == digests[2] != digests[1]


@pytest.mark.parametrize("name", WITHOUT_STOCK)
@pytest.mark.parametrize("mode", ["FM1", "FM2", "FM3", "FM4", "motor_dead", "removed"])
def test_it_gets_on_with_robots_that_fail(name: str, mode: str) -> None:
    assert run_episode(SMALL, load(name), 0, (Fault(mode, 2),)).delivered >= 4


def rows_of(n_robots: int, velocity: tuple[float, float]) -> NDArray[np.float32]:
    rows = np.zeros((n_robots, row.N_COLUMNS), np.float32)
    rows[:, row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS] = 2.0
    rows[:, row.VELOCITY : row.VELOCITY + 2] = velocity
    return rows


@pytest.mark.parametrize(("holders", "drops"), [(0.0, True), (1.0, False)])
def test_who_holds_keeps_its_item_and_who_stocks_puts_it_down_before_the_area(
    holders: float, drops: bool
) -> None:
    policy = load("homing-stock", holders=holders, stockers=1.0 - holders)
    policy.reset(20, 0)
    entering = rows_of(20, (1.0, 0.0))
    policy.act(entering)
    entering[:, row.IN_DELIVERY_AREA] = 1.0
    policy.act(entering)
    leaving = rows_of(20, (-1.0, 0.0))
    leaving[:, row.CARRYING] = 1.0
    gripper = policy.act(leaving)[:, 3]
    assert (gripper == (-1.0 if drops else 0.0)).all()
    leaving[:, row.ITEMS : row.ITEMS + 3] = (1.0, 0.3, 0.3)  # no gap beside this item
    assert (policy.act(leaving)[:, 3] == 0.0).all()


@pytest.mark.parametrize(("holders", "stockers"), [(-0.1, 0.4), (0.7, 0.7)])
def test_shares_that_cannot_be_are_refused(holders: float, stockers: float) -> None:
    with pytest.raises(PolicyError, match="holders"):
        load("homing-stock", holders=holders, stockers=stockers)
