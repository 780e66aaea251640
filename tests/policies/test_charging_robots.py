"""A policy whose robots go to charge in time, and the same policy where there are no batteries."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.policy import decide, identity, start
from swarm_logistics_env.world import observations as row
from tests.policies.test_row_policy import SMALL, Alone

DAY = Scenario(battery=3000.0, n_robots=12, restock=True, duration=300.0)


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "drive", ["holonomic", pytest.param("differential", marks=pytest.mark.daily)]
)
def test_robots_charge_and_hardly_any_runs_empty(drive: str) -> None:
    empty = {}
    scenario = DAY.replace(drive=drive)
    for name in ("homing", "homing+charging"):
        world = Warehouse(scenario)
        policy = policies.load(name)
        rows = world.reset(seed=1)
        start(policy, scenario, 1)
        for _ in range(scenario.n_steps):
            rows = world.step(decide(policy, rows, world.state))
        empty[name] = int(world.state.robot_is_empty.sum())
        assert sum(1 for share in world.state.robot_charge if share == 0.0) == empty[name]
    assert empty["homing"] == 12
    assert empty["homing+charging"] <= 1


def test_without_batteries_it_is_the_policy_itself() -> None:
    scenario = Scenario(**SMALL, duration=30.0)
    both = [
        run_episode(scenario, policies.load(name), seed=0).delivery_times
        for name in ("homing", "homing+charging")
    ]
    np.testing.assert_array_equal(both[0], both[1])


def test_one_robot_does_what_its_row_does_in_the_swarm() -> None:
    scenario = Scenario(**SMALL, duration=60.0, battery=400.0, idle_power=10.0)
    alone = Alone(policies.load("homing+charging"))
    both = [
        run_episode(scenario, policy, seed=3).delivery_times
        for policy in (policies.load("homing+charging"), alone)
    ]
    np.testing.assert_array_equal(both[0], both[1])


def test_its_identity_is_that_of_the_policy_and_of_the_shares() -> None:
    homing = policies.load("homing")
    assert identity(policies.charging(homing)) == identity(policies.load("homing+charging"))
    assert identity(policies.charging(homing)) != identity(policies.charging(homing, at=0.2))
    assert identity(policies.charging(homing)) != identity(
        policies.charging(policies.load("swarm-dt"))
    )


def test_what_cannot_go_to_charge_is_refused() -> None:
    with pytest.raises(PolicyError, match="policy = Central: should decide from rows alone"):
        policies.load("central+charging")
    with pytest.raises(PolicyError, match=r"at = 0\.9: should be less than until"):
        policies.charging(policies.load("homing"), at=0.9, until=0.5)


def test_a_robot_that_needs_charge_lets_go_of_what_nobody_asks_for() -> None:
    policy: Any = policies.load("homing+charging")
    start(policy, DAY.replace(n_robots=2), 0)
    rows = np.array(Warehouse(DAY.replace(n_robots=2)).reset(0))
    rows[:, row.CARRYING] = 1.0
    rows[1, row.CARRYING_REQUESTED] = 1.0
    rows[:, len(rows[0]) - row.N_BATTERY_COLUMNS] = 0.1
    assert policy.act(rows)[:, 3].tolist() == [-1.0, 0.0]
    rows[1, len(rows[0]) - row.N_BATTERY_COLUMNS] = 1.0
    policy.act(rows)
    memories = policy.memories()
    assert memories["needs_charge"].tolist() == [True, False]
    assert memories["side"].tolist() == [1.0, 1.0]
    assert not memories["was_inside"].any()
    assert not memories["in_vain"].any()
    assert memories.keys() > policy.policy.memories().keys()


def test_a_robot_leaves_a_station_that_does_not_charge_it() -> None:
    scenario = Scenario(battery=3000.0, n_robots=1, n_items=1, n_stations=2, dead_stations=2)
    policy = policies.load("homing+charging")
    start(policy, scenario, 0)
    rows = np.zeros((1, row.n_columns(scenario)), np.float32)
    rows[:, row.IN_DELIVERY_AREA] = 1.0
    battery = rows[:, -row.N_BATTERY_COLUMNS :]
    battery[:, row.BATTERY.charge] = 0.1
    battery[:, row.BATTERY.stations : row.BATTERY.stations + row.STATION_WIDTH] = (1.0, 0.01, 0.0)
    speeds = [float(np.hypot(*policy.act(rows)[0, :2])) for _ in range(15)]
    assert max(speeds[:10]) < 0.1
    assert speeds[-1] == pytest.approx(1.0)
