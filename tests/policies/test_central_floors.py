"""Central control in worlds with racks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, run_episode
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.ground import OpenGround
from swarm_logistics_env.policies.planned_ground import PlannedGround, ground_of
from swarm_logistics_env.policies.policy import decide, start
from swarm_logistics_env.world.warehouse.floor_cells import floor_map

POLICIES = ("central", "central-stock")
# Walls stand between storage and docks; straight ways end at them.
HALL = """
AA..#::::
AA..#::::
....#::::
BB....:::
BB..#::::
"""


def begun(policy_name: str, **fields: Any) -> tuple[Warehouse, Any]:
    scenario = Scenario(**{"restock": True, **fields})
    world, policy = Warehouse(scenario), load(policy_name)
    world.reset(0)
    start(policy, scenario, 0)
    return world, policy


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize(("floor", "least"), [("aisles", 9), ("two_docks", 22), (HALL.strip(), 14)])
def test_it_delivers_around_racks(policy: str, floor: str, least: int) -> None:
    size: dict[str, Any] = {} if floor.isidentifier() else {"n_robots": 6, "n_items": 12}
    scenario = Scenario(floor=floor, restock=True, duration=60.0, **size)
    assert run_episode(scenario, load(policy), seed=0).delivered >= least


@pytest.mark.daily
@pytest.mark.parametrize("policy_name", POLICIES)
def test_it_serves_every_dock_that_requests_name(policy_name: str) -> None:
    world, policy = begun(policy_name, floor="two_docks", request_docks="random")
    served: list[int] = []
    while world.state.time < 60.0:
        dock, before = int(world.state.requested_docks[0]), world.state.delivered
        world.step(decide(policy, world.observe(), world.state))
        served += [dock] * (world.state.delivered - before)
    assert min(served.count(0), served.count(1)) >= 4


def test_it_steps_over_items_that_close_an_aisle() -> None:
    # A corridor of half a metre, in which a laden robot gets past no item.
    scenario = Scenario(floor="A..::::", n_robots=4, n_items=6, restock=True, duration=60.0)
    for seed in (1, 2):
        assert run_episode(scenario, load("central"), seed).delivered >= 5


def test_each_episode_is_planned_around_its_own_obstacles() -> None:
    """One that was reset alone, as an environment does, plays as one that is new."""
    scenario = Scenario(floor="aisles", n_obstacles=8, duration=10.0)
    world = Warehouse(scenario)
    old, new = load("central"), load("central")
    for seed, players in ((0, [old]), (1, [old, new])):
        if players[-1] is not old or seed == 0:
            start(players[-1], scenario, seed)
        old.reset(scenario.n_robots, seed)
        rows = world.reset(seed)
        for _ in range(60):
            commands = [decide(player, rows, world.state) for player in players]
            np.testing.assert_array_equal(commands[0], commands[-1])
            rows = world.step(commands[0])


def test_places_to_rest_and_slots_are_free_and_outside_of_docks() -> None:
    for name in ("aisles", "two_docks"):
        scenario = Scenario(floor=name)
        ground, floor = ground_of(scenario), floor_map(scenario)
        for places in (ground.resting_places(25), ground.slots((0.35, 0.85), 0.6)):
            around = [[0.0, 0.0], *np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]) * 0.125]
            for shift in around:
                assert floor.is_free(places + shift).all()
            assert (floor.along(places) < 0.0).all()
            apart = np.linalg.norm(places[:, None] - places, axis=2)
            assert apart[~np.eye(len(places), dtype=bool)].min() > 0.5


def test_more_robots_than_places_to_rest_share_them() -> None:
    scenario = Scenario(floor="A:", n_robots=1, n_items=1)
    assert ground_of(scenario).resting_places(30).shape == (30, 2)


def test_where_no_cell_is_clear_of_walls_robots_rest_far_from_the_docks_all_the_same() -> None:
    corridor = "#####\nA..::\n#####"
    scenario = Scenario(floor=corridor, robot_radius=0.2, n_robots=1, n_items=1)
    places = ground_of(scenario).resting_places(2)
    floor = floor_map(scenario)
    assert floor.is_free(places).all()
    assert (floor.along(places) < 0.0).all()
    assert np.linalg.norm(places[0] - places[1]) > 0.5


def test_ways_lead_around_racks_and_obstacles() -> None:
    world, _ = begun("central", floor="aisles", n_obstacles=2)
    ground = ground_of(world.scenario)
    assert isinstance(ground, PlannedGround)
    state = world.state
    state.robot_position[0] = (2.0, 7.0)
    goal = np.array([0.5, 7.0])  # on the other side of a rack
    assert ground.ways_to(state, goal)[0] > 3.0
    assert OpenGround(world.scenario).ways_to(state, goal)[0] == 1.5
    assert abs(ground.point_to(state, 0, goal)[1] - 7.0) > 0.5
