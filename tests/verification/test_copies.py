"""Copies of any world, taken at any moment, go on to the same bits for a thousand steps."""

from __future__ import annotations

import copy
import functools
import math
import pickle
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.world.scenario import ROLES
from swarm_logistics_env.world.warehouse import FAILURE_MODES
from verification.trajectories import GROUPS

EXAMPLES = 2000 if settings().max_examples >= 2000 else 5
STEPS = 1000  # beyond the rebuilding of bodies, which comes after 500 steps
KINDS = (
    "plain, other robot_radius=0.08 robot_mass=2.0 max_speed=0.7 max_acceleration=3.0 "
    "drive=differential lifts=false"
)
Change = tuple[int, Callable[[Warehouse], None]]
Copy = Callable[[Warehouse], Warehouse]


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    n_items = draw(st.integers(1, 20))
    return Scenario(
        n_robots=draw(st.integers(2, 25)),
        n_items=n_items,
        n_requests=draw(st.integers(1, min(n_items, 6))),
        n_obstacles=draw(st.integers(0, 4)),
        obstacle_radius=0.2,
        warehouse_width=draw(st.floats(4.0, 7.0)),
        warehouse_height=draw(st.floats(3.0, 6.0)),
        delivery_width=1.0,
        duration=1000.0,
        restock=draw(st.booleans()),
        drive=draw(st.sampled_from(["holonomic", "differential"])),
        relay=draw(st.sampled_from(["none", "gossip"])),
        demand=draw(st.sampled_from(["closed", "independent", "zipf"])),
        handling_time=draw(st.sampled_from([0.0, 0.3])),
        dock_capacity=draw(st.sampled_from([None, 0.5])),
        message_size=draw(st.sampled_from([0, 2])),
        battery=draw(st.sampled_from([None, 500.0])),
        ranger_noise=draw(st.sampled_from([0.0, 0.05])),
        radio_loss=draw(st.sampled_from([0.0, 0.3])),
        speed_mix=draw(st.sampled_from([(1.0,), (1.0, 0.5)])),
        robot_kinds=draw(st.sampled_from(["", KINDS])),
    )


@st.composite
def fault_lists(draw: st.DrawFn, n_robots: int) -> list[Fault]:
    faults = []
    for _ in range(draw(st.integers(0, 3))):
        mode = draw(st.sampled_from(["removed", "away", *FAILURE_MODES.keys() - {"cell_fades"}]))
        onset = draw(st.sampled_from([0.0, 0.1, 0.1, 20.0, 60.0]) | st.floats(0.0, 100.0))
        times = [5.0, 30.0] if mode == "away" else [None, 5.0, 30.0]
        lasts = None if mode == "removed" else draw(st.sampled_from(times))
        role = draw(st.sampled_from([None, *ROLES]))
        faults.append(Fault(mode, draw(st.integers(1, n_robots)), onset, lasts, role=role))
    return faults


@st.composite
def changes(draw: st.DrawFn, n_robots: int, last: int) -> list[Change]:
    fields: dict[str, st.SearchStrategy[Any]] = {
        "max_speed": st.floats(0.5, 2.0),
        "delivery_width": st.floats(0.5, 1.5),
        "restock": st.booleans(),
        "drive": st.sampled_from(["holonomic", "differential"]),
        "view_range": st.floats(0.3, 2.0),
        "radio_loss": st.floats(0.0, 0.5),
    }
    drawn_changes: list[Change] = []
    for _ in range(draw(st.integers(0, 2))):
        at = draw(st.integers(0, last))
        if draw(st.booleans()):
            name = draw(st.sampled_from(sorted(fields)))
            changed = {name: draw(fields[name])}
            drawn_changes.append((at, functools.partial(Warehouse.change, **changed)))
        else:
            faults = draw(fault_lists(n_robots))
            drawn_changes.append((at, functools.partial(Warehouse.set_faults, faults=faults)))
    return drawn_changes


def crowded(world: Warehouse, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return commands that crowd robots to one point after another and lift, drop and deliver."""
    state, scenario = world.state, world.scenario
    places = ((1.0, 0.5), (0.2, 0.2), (0.3, 0.8), (1.0, 1.0))
    point = np.array(places[state.step // 60 % len(places)])
    goal = point * (scenario.warehouse_width, scenario.warehouse_height)
    to_goal = goal - state.robot_position
    angle = np.arctan2(to_goal[:, 1], to_goal[:, 0]) - state.robot_heading
    n = state.n_robots
    commands = rng.uniform(-1.0, 1.0, (n, 4 + scenario.message_size))
    pushes = rng.random(n) < 0.8
    commands[pushes, 0] = np.cos(angle[pushes])
    commands[pushes, 1] = np.sin(angle[pushes])
    commands[:, 2] = np.clip(np.remainder(angle + math.pi, 2 * math.pi) - math.pi, -1.0, 1.0)
    commands[:, 3] = np.where(rng.random(n) < 0.9, 1.0, -1.0)
    return commands


def assert_goes_on(
    world: Warehouse,
    rng: np.random.Generator,
    copied_at: int,
    copied: Copy,
    events: Sequence[Change] = (),
) -> None:
    """Assert that a copy and its copy are the same bits as `world` in each of the next steps."""
    worlds = [world]
    for step in range(copied_at + STEPS):
        for at, change in events:
            if at == step:
                for each in worlds:
                    change(each)
        if step == copied_at:
            worlds.append(copied(world))
        if step == copied_at + 1:
            worlds.append(copied(worlds[1]))
        commands = crowded(world, rng)
        rows = [each.step(commands).tobytes() for each in worlds]
        assert set(rows) == {rows[0]}, f"rows differ {step - copied_at} steps after the copy"
    for name in [name for names in GROUPS.values() for name in names]:
        bits = [pickle.dumps(getattr(each.state, name)) for each in worlds]
        assert set(bits) == {bits[0]}, f"{name} differs"


def through_pickle(world: Warehouse) -> Warehouse:
    copied: Warehouse = pickle.loads(pickle.dumps(world))
    return copied


@settings(max_examples=EXAMPLES)
@given(data=st.data(), scenario=scenarios(), seed=st.integers(0, 2**32))
def test_a_copy_of_any_world_at_any_moment_goes_on_to_the_same_bits(
    data: st.DataObject, scenario: Scenario, seed: int
) -> None:
    world = Warehouse(scenario)
    try:
        world.reset(seed, data.draw(fault_lists(scenario.n_robots)))
    except ScenarioError:  # no room for so many
        return
    copied_at = data.draw(st.sampled_from([0, 1]) | st.integers(0, 700))
    events = data.draw(changes(scenario.n_robots, copied_at + 300))
    ways: list[Copy] = [through_pickle, copy.deepcopy]
    copied = data.draw(st.sampled_from(ways))
    assert_goes_on(world, np.random.default_rng(seed), copied_at, copied, events)


@pytest.mark.parametrize("copied_at", [0, 150, 499, 500, 5200])
def test_a_copy_of_a_world_with_removed_robots_goes_on_to_the_same_bits(copied_at: int) -> None:
    world = Warehouse(Scenario(n_robots=25, restock=True, warehouse_width=6.0))
    world.reset(1, ["removed:12", "removed:3:carrier@20"])
    assert_goes_on(world, np.random.default_rng(1), copied_at, through_pickle)
