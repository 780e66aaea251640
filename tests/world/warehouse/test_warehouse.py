"""Reset, step and observe. `tests/verification/test_invariants.py` plays random worlds."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.core.errors import CommandError, FaultError, ScenarioError, SetupError
from swarm_logistics_env.world.observations import unflatten
from tests.world.warehouse.conftest import EAST, FAR, SMALL, STAY, Build, steps

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
    with pytest.raises(SetupError, match="before reset"):
        ask(world)
    assert (world.struck_robots, world.n_removed, world.is_over_time) == ((), 0, False)


@pytest.mark.parametrize(
    ("make", "error", "complaint"),
    [
        (lambda world: type(world)(dict), ScenarioError, "scenario = <class 'dict'>: should be"),
        (lambda world: world.reset(0, (), {}), ScenarioError, "scenario = {}: should be a Scen"),
        (lambda world: world.reset(0, [3]), FaultError, r"faults = \[3\]: should be a list of"),
        (lambda world: world.reset(1, ["FM1:3"]), FaultError, "at most n_robots = 2"),
        (lambda world: world.reset(1, [Fault("FM1", (0, 2))]), FaultError, "numbered 0 to 1"),
        (lambda world: world.set_faults(None), FaultError, "faults = None"),
        (lambda world: world.change(n_items=2), ScenarioError, "n_items cannot change during a"),
        (lambda world: world.step(np.zeros((3, 4))), CommandError, r"\(3, 4\): should be \(2, 4\)"),
        (lambda world: world.step([["1"] * 4] * 2), CommandError, "real ones, not <U1"),
        (lambda world: world.step([[0] * 4, [0] * 2]), CommandError, "numbers"),
        (lambda world: world.step([[0, 0, 0, -np.inf], [0] * 4]), CommandError, r"\[0, 3\] = -inf"),
    ],
)
def test_what_is_no_scenario_fault_or_command_is_refused_and_changes_nothing(
    make: Callable[[Any], object], error: type[Exception], complaint: str
) -> None:
    world, undisturbed = Warehouse(TWO), Warehouse(TWO)
    for each in (world, undisturbed):
        each.reset(0)
        first = steps(each, EAST, STAY)
    with pytest.raises(error, match=complaint):
        make(world)
    np.testing.assert_array_equal(world.observe(), first)
    np.testing.assert_array_equal(steps(world, EAST, STAY), steps(undisturbed, EAST, STAY))


def test_the_rows_of_removed_and_dead_robots_are_ignored_whatever_they_hold() -> None:
    worlds = [Warehouse(Scenario(n_robots=3, n_items=3)) for _ in range(2)]
    commands = [np.full((3, 4), 3.0) for _ in worlds]
    commands[1][1:] = np.nan
    for world in worlds:
        world.reset(0, [Fault("removed", (1,)), Fault("dead", (2,))])
    for _ in range(5):
        plain, nan = (world.step(rows) for world, rows in zip(worlds, commands))
        np.testing.assert_array_equal(plain, nan)
        assert not plain[1].any()
    assert (commands[0] == 3.0).all()  # they are left as they were given


def test_a_seed_decides_the_episode_whatever_came_before() -> None:
    used, fresh = Warehouse(Scenario(n_robots=5)), Warehouse(SMALL)
    used.reset(5)
    start = used.reset(5, [Fault("removed", 2), Fault("dead", (0,), onset=0.5)], SMALL)
    copied = start.copy()
    rng = np.random.default_rng(0)
    for _ in range(60):
        used.step(rng.uniform([0, -1, -1, 0], 1, (8, 4)))
    np.testing.assert_array_equal(start, copied)  # what was observed stays as it was
    np.testing.assert_array_equal(used.reset(3), fresh.reset(3))
    assert not np.array_equal(used.observe(), start)
    for _ in range(30):
        commands = rng.uniform(-1, 1, (8, 4))
        np.testing.assert_array_equal(used.step(commands), fresh.step(commands))
    np.testing.assert_array_equal(used.reset(), fresh.reset(0))


def test_what_is_assigned_to_the_state_is_what_the_next_step_works_on() -> None:
    world = Warehouse(Scenario(n_robots=1, n_items=2))
    world.reset(0)
    before = world.state.item_position
    world.state.item_position = world.state.robot_position[[0, 0]] + [[0.5, 0.0], [0.0, 0.5]]
    assert world.state.item_position is before
    columns = unflatten(steps(world, STAY), world.scenario)
    np.testing.assert_allclose(columns["item_present"][0, :2], 1.0)
    assert not columns["item_present"][0, 2:].any()


def test_a_change_of_the_top_speed_holds_from_the_next_step_on(build: Build) -> None:
    world = build([(2.0, 2.0)], [FAR])
    steps(world, EAST, times=5)
    world.change(max_speed=0.5)
    steps(world, EAST, times=5)
    assert world.state.max_speed[0] == 0.5
    assert world.state.robot_velocity[0, 0] == pytest.approx(0.5)


@pytest.mark.unmeasured
@pytest.mark.parametrize("copied", [copy.deepcopy, lambda world: pickle.loads(pickle.dumps(world))])
@pytest.mark.parametrize(("moment", "is_changed"), [(20, True), (520, False), (520, True)])
def test_a_copy_goes_on_alike_after_many_steps_and_after_a_change(
    copied: Callable[[Warehouse], Warehouse], moment: int, is_changed: bool
) -> None:
    world = Warehouse(SMALL.replace(restock=True, n_requests=3))
    world.reset(0, [Fault("motor_wear", 2, intermittent=(3.0, 2.0))])
    rng = np.random.default_rng(0)
    for _ in range(moment):
        world.step(rng.uniform(-1.0, 1.0, (8, 4)))
    if is_changed:
        world.change(max_speed=1.0, view_range=0.6)
    other = copied(world)
    for _ in range(60):
        commands = rng.uniform(-1.0, 1.0, (8, 4))
        np.testing.assert_array_equal(other.step(commands), world.step(commands))
    assert other.scenario == world.scenario
