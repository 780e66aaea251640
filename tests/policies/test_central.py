"""The central controller."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse, run_episode
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.central import WaitingPlaces
from swarm_logistics_env.policies.policy import decide, start

SMALL = Scenario(
    n_robots=6, n_items=20, warehouse_width=6.0, warehouse_height=4.0, duration=60.0, restock=True
)


def delivered(scenario: Scenario, *faults: Fault, policy: str = "central", seed: int = 0) -> int:
    return run_episode(scenario, load(policy), seed, faults).delivered


def test_it_delivers_more_than_the_swarm() -> None:
    for seed in range(3):
        assert delivered(SMALL, seed=seed) > 1.5 * delivered(SMALL, policy="swarm-dt", seed=seed)


SURROUNDINGS: list[dict[str, Any]] = [
    {"n_robots": 1}, {"n_robots": 40}, {"n_items": 1, "restock": False}, {"n_obstacles": 3},
    {"drive": "differential"}, {"speed_mix": (1.0, 0.5)}, {"message_size": 2},
    {"delivery_width": 0.5},
]  # fmt: skip


@pytest.mark.parametrize("fields", SURROUNDINGS)
def test_it_delivers_in_other_surroundings(fields: dict[str, Any]) -> None:
    scenario = SMALL.replace(**fields)
    assert delivered(scenario) >= (10 if scenario.restock else 1)


# Two of six: without noticing who is of no use it would wait for ever for the first of them.
@pytest.mark.parametrize(
    "mode", ["FM1", "FM2", "FM3", "FM3_hear", "FM4", "motor_slow", "motor_dead", "dead", "removed"]
)
def test_it_gets_on_with_robots_that_fail(mode: str) -> None:
    assert delivered(SMALL, Fault(mode, 2)) >= 8


def test_it_needs_the_state_and_nothing_else() -> None:
    world, policy = Warehouse(SMALL), load("central")
    observations = world.reset(0)
    start(policy, SMALL, 0)
    first = decide(policy, np.full_like(observations, np.nan), world.state)
    start(policy, SMALL, 0)
    np.testing.assert_array_equal(first, decide(policy, observations, world.state))
    assert first.shape == (6, 4)
    assert (np.abs(first) <= 1.0).all()
    with pytest.raises(PolicyError, match="state = None"):
        policy.act(observations)
    policy.reset(5, 0)
    with pytest.raises(PolicyError, match="6 robots: reset was told 5"):
        decide(policy, observations, world.state)


def test_it_does_not_know_who_fails() -> None:
    """A robot that has failed is told the same as one that has not, until it shows."""
    sound, faulty = Warehouse(SMALL), Warehouse(SMALL)
    sound.reset(0)
    faulty.reset(0, [Fault("FM2", 2), Fault("FM4", (0,)), Fault("motor_dead", (1,))])
    policies = [load("central"), load("central")]
    told = []
    for world, policy in zip((sound, faulty), policies):
        start(policy, SMALL, 0)
        told.append(decide(policy, world.observe(), world.state))
    np.testing.assert_array_equal(told[0], told[1])


def test_the_nearest_robot_fetches_and_only_it_closes_its_gripper() -> None:
    world, policy = Warehouse(SMALL), load("central")
    world.reset(0)
    start(policy, SMALL, 0)
    lifted: list[int] = []
    while world.state.delivered < 5:
        item = world.state.requested
        world.step(decide(policy, world.observe(), world.state))
        carriers = np.flatnonzero(world.state.robot_item >= 0).tolist()
        assert len(carriers) <= 1
        if carriers and world.state.robot_item[carriers[0]] == item:
            lifted.append(item)
    assert len(set(lifted)) >= 5


def test_robots_that_have_nothing_to_do_wait_under_different_items() -> None:
    world, policy = Warehouse(SMALL), load("central")
    world.reset(0)
    start(policy, SMALL, 0)
    for _ in range(100):
        world.step(decide(policy, world.observe(), world.state))
    state = world.state
    away = np.linalg.norm(state.robot_position[:, None] - state.item_position, axis=2)
    away[:, state.item_status != 0] = np.inf
    assert (away.min(axis=1) < 0.05).sum() >= 3
    assert len(set(away.argmin(axis=1)[away.min(axis=1) < 0.05])) >= 3


def test_where_items_are_few_the_others_line_up_at_the_wall() -> None:
    scenario = SMALL.replace(n_robots=12, n_items=3)
    world = Warehouse(scenario)
    world.reset(0)
    places, has_item = WaitingPlaces(12).places(world.state, 4, scenario)
    assert has_item.sum() == 2  # the requested item is left out
    assert not has_item[4]
    assert (places[~has_item, 0] < 0.6).all()
    apart = np.linalg.norm(places[:, None] - places, axis=2)[~np.eye(12, dtype=bool)]
    assert apart.min() > 0.25
