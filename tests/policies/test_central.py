from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, run_episode
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.policy import decide, mask_unreachable_commands, start
from swarm_logistics_env.world.warehouse.state import NOBODY

SMALL = Scenario(
    n_robots=6, n_items=20, warehouse_width=6.0, warehouse_height=4.0, duration=60.0, restock=True
)


def delivered(scenario: Scenario, *faults: Fault, policy: str = "central", seed: int = 0) -> int:
    return run_episode(scenario, load(policy), seed, faults).delivered


def begun(*faults: Fault) -> tuple[Warehouse, Any]:
    world, policy = Warehouse(SMALL), load("central")
    world.reset(0, faults)
    start(policy, SMALL, 0)
    return world, policy


def test_it_delivers_more_than_the_swarm() -> None:
    for seed in range(3):
        assert delivered(SMALL, seed=seed) > 1.5 * delivered(SMALL, policy="swarm-dt", seed=seed)


SURROUNDINGS: list[dict[str, Any]] = [
    {"n_robots": 1}, {"n_robots": 40}, {"n_items": 1, "restock": False}, {"n_obstacles": 3},
    {"drive": "differential"}, {"message_size": 2}, {"delivery_width": 0.5},
]  # fmt: skip


@pytest.mark.parametrize("fields", SURROUNDINGS)
def test_it_delivers_in_other_surroundings(fields: dict[str, Any]) -> None:
    scenario = SMALL.replace(**fields)
    assert delivered(scenario) >= (10 if scenario.restock else 1)


# Two of six: without noticing who is of no use it would wait for ever for the first of them.
@pytest.mark.parametrize("mode", ["FM1", "FM2", "FM3", "FM4", "motor_dead", "removed"])
def test_it_gets_on_with_robots_that_fail(mode: str) -> None:
    assert delivered(SMALL, Fault(mode, 2)) >= 8


def test_it_needs_the_state_alone_and_does_not_know_who_fails() -> None:
    world, policy = begun()
    observations = world.observe()
    commands = decide(policy, observations, world.state)
    assert commands.shape == (6, 4)
    assert (np.abs(commands) <= 1.0).all()
    # A robot that has failed is told the same as one that has not, until it shows.
    faulty, other = begun(Fault("FM2", 2), Fault("FM4", (0,)), Fault("motor_dead", (1,)))
    commands_with_faults = decide(other, np.full_like(observations, np.nan), faulty.state)
    np.testing.assert_array_equal(commands_with_faults, commands)
    with pytest.raises(PolicyError, match="state = None"):
        policy.act(observations)
    policy.reset(5, 0)
    with pytest.raises(PolicyError, match="6 robots: reset was told 5"):
        decide(policy, observations, world.state)


def test_one_robot_fetches_and_the_others_wait_under_different_items() -> None:
    world, policy = begun()
    lifted: set[int] = set()
    state = world.state
    while state.delivered < 5:
        item = state.requested
        world.step(decide(policy, world.observe(), state))
        carried = state.robot_item[state.robot_item >= 0].tolist()
        assert len(carried) <= 1
        lifted.update({item}.intersection(carried))
    assert len(lifted) >= 5
    away = np.linalg.norm(state.robot_position[:, None] - state.item_position, axis=2)
    away[:, state.item_status != 0] = np.inf
    is_under = away.min(axis=1) < 0.05
    assert len(set(away.argmin(axis=1)[is_under])) == is_under.sum() >= 3


def test_the_nearest_is_sent_and_stays_unless_another_is_half_a_metre_nearer() -> None:
    world, policy = begun()
    state: Any = world.state
    state.item_position[state.requested] = 3.0, 2.0
    sent = []
    for x in (4.3, 3.8, 3.3):
        state.robot_position[:] = [[4.0, 2.0], *[[5.5, 2.0]] * 4, [x, 2.0]]
        decide(policy, world.observe(), state)
        sent.append(policy._worker)
    assert sent == [0, 0, 5]


def test_where_items_are_few_the_others_line_up_at_the_wall() -> None:
    scenario = SMALL.replace(n_robots=12, n_items=3)
    world = Warehouse(scenario)
    world.reset(0)
    policy: Any = load("central")
    start(policy, scenario, 0)
    places = policy._waiting_places(world.state, np.arange(12) != 4)
    has_item = policy._waits_under != NOBODY
    assert has_item.sum() == 2  # the requested item is left out
    assert not has_item[4]
    assert (places[~has_item, 0] < 0.6).all()
    apart = np.linalg.norm(places[:, None] - places, axis=2)[~np.eye(12, dtype=bool)]
    assert apart.min() > 0.25


class Everywhere:
    """Sends every robot the same command."""

    def __init__(self, *command: float, needs_state: bool = True) -> None:
        self.command, self.needs_state = np.array(command), needs_state

    def reset(self, n_robots: int, seed: int) -> None: ...

    def act(self, observations: NDArray[np.float32], state: Any = None) -> NDArray[np.float64]:
        return np.tile(self.command, (len(observations), 1))


@pytest.mark.parametrize(
    ("mode", "needs_state", "arrives"),
    [
        *((mode, True, False) for mode in ("FM3", "FM3_hear", "dead")),
        *((mode, True, True) for mode in ("FM1", "FM2", "FM3_send", "FM4", "motor_dead")),
        ("FM3", False, True),  # decided by the robots
    ],
)
def test_only_who_hears_gets_the_command_of_others(
    mode: str, needs_state: bool, arrives: bool
) -> None:
    world = Warehouse(SMALL)
    rows = world.reset(0, [Fault(mode, (1, 3))])
    sender = Everywhere(1.0, 0.0, 0.5, 1.0, needs_state=needs_state)
    commands = decide(sender, rows, world.state)
    np.testing.assert_array_equal(commands[[0, 2, 4, 5]], [sender.command] * 4)
    np.testing.assert_array_equal(commands[[1, 3]], [sender.command * arrives] * 2)
    ones = np.ones((6, 6))
    mask_unreachable_commands(ones, world.state)
    assert ones.all()
