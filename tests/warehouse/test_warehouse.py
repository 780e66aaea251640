"""Reset, step and observe. `tests/verification/test_invariants.py` plays random worlds."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.errors import (
    CommandError,
    FaultError,
    ScenarioError,
    SetupError,
    SwarmLogisticsError,
)
from swarm_logistics_env.observations import unflatten
from swarm_logistics_env.warehouse import stepping
from tests.warehouse.conftest import EAST, SMALL, STAY, steps

TWO = Scenario(n_robots=2, n_items=3)


@pytest.mark.parametrize(
    "ask",
    [
        lambda world: world.step(np.zeros((2, 4))),
        lambda world: world.observe(),
        lambda world: world.change(view_range=0.5),
        lambda world: world.set_faults([Fault("FM1")]),
    ],
)
def test_what_needs_an_episode_is_refused_before_the_first_reset(
    ask: Callable[[Warehouse], object],
) -> None:
    world = Warehouse(TWO)
    with pytest.raises(SetupError, match=r"before reset: call reset\(seed\) first"):
        ask(world)
    assert (world.struck_robots, world.n_removed, world.is_over_time) == ((), 0, False)


@pytest.mark.parametrize(
    ("make", "error", "complaint"),
    [
        (lambda world: world.reset(0, None), FaultError, "faults = None: should be a list of"),
        (lambda world: world.reset(0, "FM1"), FaultError, "should be a list of faults"),
        (lambda world: world.reset(0, (), {}), ScenarioError, "scenario = {}: should be a Scen"),
        (lambda world: world.reset(1, [Fault("FM1", 3)]), FaultError, "at most n_robots = 2"),
        (lambda world: world.reset(1, ["FM1:3"]), FaultError, "at most n_robots = 2"),
        (lambda world: world.reset(1, [Fault("FM1", (0, 2))]), FaultError, "numbered 0 to 1"),
        (lambda world: world.reset(0, [3]), FaultError, r"faults = \[3\]: should be a list of"),
        (lambda world: world.set_faults(None), FaultError, "faults = None"),
        (lambda world: type(world)(dict), ScenarioError, "scenario = <class 'dict'>: should be"),
    ],
)
def test_what_is_no_scenario_or_fault_is_refused_and_the_world_goes_on(
    make: Callable[[Any], object], error: type[SwarmLogisticsError], complaint: str
) -> None:
    world, undisturbed = Warehouse(TWO), Warehouse(TWO)
    first = world.reset(0)
    undisturbed.reset(0)
    with pytest.raises(error, match=complaint):
        make(world)
    np.testing.assert_array_equal(world.observe(), first)
    np.testing.assert_array_equal(steps(world, EAST, STAY), steps(undisturbed, EAST, STAY))


@pytest.mark.parametrize(
    ("commands", "complaint"),
    [
        (np.zeros((3, 4)), r"\(3, 4\): should be \(2, 4\)"),
        (np.zeros((2, 3)), r"\(2, 3\): should be \(2, 4\)"),
        (np.zeros(8), r"\(8,\): should be \(2, 4\)"),
        ([["a"] * 4] * 2, "numbers"),
        ([["1"] * 4] * 2, "numbers: real ones, not <U1"),
        (np.ones((2, 4), "m8[s]"), "numbers: real ones, not timedelta64"),
        (np.full((2, 4), "1", dtype=object), "numbers: real ones, not object"),
        (np.ones((2, 4), complex), "numbers: real ones, not complex128"),
        ([[0, 0, 0, 0], [0, 0]], "numbers"),
        (np.array([[0, 0, 0, 0], [0, np.nan, 0, 0]]), r"\[1, 1\] = nan: should be finite"),
        (np.array([[0, 0, 0, -np.inf], [0, 0, 0, 0]]), r"\[0, 3\] = -inf: should be finite"),
    ],
)
def test_impossible_commands_are_refused_and_change_nothing(commands: Any, complaint: str) -> None:
    world, undisturbed = Warehouse(TWO), Warehouse(TWO)
    drive = np.array([[1.0, 0.0, 0.5, 1.0], [0.3, -0.4, 0.0, 1.0]])
    for each in (world, undisturbed):
        each.reset(1)
        each.step(drive)
    with pytest.raises(CommandError, match=complaint):
        world.step(commands)
    for _ in range(5):
        np.testing.assert_array_equal(world.step(drive), undisturbed.step(drive))
    np.testing.assert_array_equal(world.state.robot_heading, undisturbed.state.robot_heading)
    assert world.state.time == undisturbed.state.time


def test_the_rows_of_removed_and_dead_robots_are_ignored_whatever_they_hold() -> None:
    worlds = [Warehouse(Scenario(n_robots=3, n_items=3)) for _ in range(3)]
    commands = [np.full((3, 4), 3.0) for _ in worlds]
    commands[1][1:] = [-1.0, 1.0, 1.0, -1.0]
    commands[2][1:] = np.nan
    for world in worlds:
        world.reset(0, [Fault("removed", (1,)), Fault("dead", (2,))])
    for _ in range(5):
        plain, other, nan = (world.step(given) for world, given in zip(worlds, commands))
        np.testing.assert_array_equal(plain, other)
        np.testing.assert_array_equal(plain, nan)
        assert not plain[1].any()
    assert (commands[0] == 3.0).all()  # they are left as they were given


def test_what_was_observed_stays_as_it_was() -> None:
    world = Warehouse(TWO)
    first = world.reset(0)
    kept = first.copy()
    second = steps(world, EAST, EAST)
    np.testing.assert_array_equal(first, kept)
    assert not np.array_equal(first, second)
    np.testing.assert_array_equal(second, world.observe())


def test_a_seed_decides_the_episode_whatever_came_before() -> None:
    used, fresh = Warehouse(SMALL), Warehouse(SMALL)
    start = used.reset(5, [Fault("removed", 2), Fault("dead", (0,), onset=0.5)])
    rng = np.random.default_rng(0)
    for _ in range(60):
        used.step(rng.uniform([0, -1, -1, 0], 1, (8, 4)))
    np.testing.assert_array_equal(used.reset(3), fresh.reset(3))
    assert not np.array_equal(used.observe(), start)
    for _ in range(30):
        commands = rng.uniform(-1, 1, (8, 4))
        np.testing.assert_array_equal(used.step(commands), fresh.step(commands))


def test_reset_takes_another_scenario_from_then_on() -> None:
    world = Warehouse(TWO)
    assert world.reset(0, scenario=Scenario(n_robots=5)).shape[0] == 5
    assert steps(world, *[STAY] * 5).shape[0] == 5
    assert world.reset(0).shape[0] == 5


def test_what_is_assigned_to_the_state_is_what_the_next_step_works_on() -> None:
    world = Warehouse(Scenario(n_robots=1, n_items=2))
    world.reset(0)
    before = world.state.item_position
    world.state.item_position = world.state.robot_position[[0, 0]] + [[0.5, 0.0], [0.0, 0.5]]
    assert world.state.item_position is before
    columns = unflatten(steps(world, STAY), world.scenario)
    np.testing.assert_allclose(columns["item_present"][0, :2], 1.0)
    assert not columns["item_present"][0, 2:].any()


def test_a_full_log_that_nobody_took_over_is_told_again_and_grows_no_further() -> None:
    world = Warehouse(Scenario(n_robots=2, n_items=4))
    world.reset(0)
    commands, rows = world._world.commands, world.observe().copy()
    longest = len(commands.log) // 2
    told = [stepping.step(world.address, rows) for _ in range(longest + 2)]
    assert told[1 : longest - 1] == [False] * (longest - 2)
    assert told[longest - 1 :] == [True] * 3
    assert commands.n_logged[0] == longest
    steps(world, STAY, STAY)
    copied = copy.deepcopy(world)
    np.testing.assert_array_equal(steps(copied, EAST, EAST), steps(world, EAST, EAST))
