"""Invariants of every world, on random scenarios; `make soak` does the same at length."""

from __future__ import annotations

import random
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import verification
from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.scenario import LONGEST_STRIDE
from swarm_logistics_env.warehouse.state import DELIVERED, NOBODY, STORED
from verification.invariants import BrokenPromiseError, Watch
from verification.soak import Tally, play, towards

ROOT = Path(verification.__file__).parents[1]


# `python -m verification.soak --first NUMBER --worlds 1 --steps 80` plays a world again.
@given(number=st.integers(0, 2**32))
@settings(max_examples=max(40, settings().max_examples // 4))
def test_no_random_world_breaks_a_promise(number: int) -> None:
    play(random.Random(number), 80, Tally())


def test_the_watch_accuses_nobody_who_was_repaired_for_a_moment() -> None:
    world = Warehouse(Scenario(n_robots=1))
    world.reset(0, [Fault("dead", (0,))])
    watch, heading = Watch(world), float(world.state.robot_heading[0])
    watch.look()
    world.set_faults([Fault("dead", (0,), onset=0.5 * world.scenario.control_period)])
    watch.faults_changed()
    world.step([[0.0, 0.0, 1.0, 0.0]])
    assert world.state.robot_heading[0] != heading
    watch.look()
    # Without a change in between it may not turn.
    world.state.robot_heading[0] += 0.1
    with pytest.raises(BrokenPromiseError, match="turns"):
        watch.look()


@pytest.mark.parametrize("heavy", [False, True])
def test_a_crowd_presses_nobody_out_at_the_longest_stride(heavy: bool) -> None:
    scenario = Scenario(
        n_robots=34, n_items=2, warehouse_width=2.4, warehouse_height=3.6, delivery_width=0.25,
        restock=True, robot_radius=0.1, robot_mass=22.0 if heavy else 1.0, max_speed=4.0,
        physics_period=0.02, control_period=0.1, item_radius=0.04,
    )  # fmt: skip
    stride = scenario.max_speed * scenario.physics_period
    assert stride == pytest.approx(LONGEST_STRIDE * scenario.robot_radius)
    world = Warehouse(scenario)
    world.reset(0)
    watch, rng = Watch(world), np.random.default_rng(0)
    for step in range(150):
        if step % 10 == 0:
            commands = rng.uniform(-1.5, 1.5, (34, 4)) if step % 20 else np.full((34, 4), 1.0)
        world.step(commands)
        watch.look()


# The point that all robots drive to [m]; where it is NaN, each stays where it is.
@pytest.mark.parametrize("target", [(5.0, 5.0), (10.0, np.nan), (0.0, 0.0)], ids=str)
@pytest.mark.parametrize("n_robots", [25, 150])
def test_a_jam_keeps_bodies_apart(n_robots: int, target: tuple[float, float]) -> None:
    world = Warehouse(Scenario(n_robots=n_robots, n_items=1))
    world.reset(0)
    closing = world.scenario.max_speed * world.scenario.physics_period
    watch, deepest = Watch(world), []
    for _ in range(150):
        at = world.state.robot_position
        world.step(towards(world, np.where(np.isnan(target), at, target), 4))
        watch.look()  # 20 mm where it lasts a second
        robots, walls = (
            watch.depth[:, :n_robots].max(),
            watch.depth[:, n_robots : n_robots + 4].max(),
        )
        assert robots <= 2 * closing
        assert walls <= closing
        deepest.append(max(robots, walls))
    assert np.median(deepest) <= 0.002


Spoil = Callable[[Warehouse], None]


def crowd() -> Warehouse:
    """A world in which everybody carries something and half have failed."""
    scenario = Scenario(
        n_robots=8, n_items=20, warehouse_width=4.0, warehouse_height=3.0, pickup_range=1.0,
        delivery_width=1.0,
    )  # fmt: skip
    world = Warehouse(scenario)
    faults = [Fault("FM1", (0,)), Fault("FM2", (1,)), Fault("FM4", (2,)), Fault("FM3", (3,))]
    world.reset(0, [*faults, Fault("dead", (4,)), Fault("removed", (5,))])
    return world


def put(field: str, place: Any, value: Any) -> Spoil:
    """Return what puts a value into the state, or what a function of the world says."""

    def spoil(world: Warehouse) -> None:
        told = value(world) if callable(value) else value
        array = getattr(world.state, field)
        array[place(world) if callable(place) else place] = told

    return spoil


def request(item: int) -> Spoil:
    return lambda world: setattr(world.state, "requested", item)


def carriers(world: Warehouse) -> Any:
    return np.flatnonzero(world.state.robot_item != NOBODY)


def lifted_in_fm2(world: Warehouse) -> None:
    free = int(np.flatnonzero(world.state.item_status == STORED)[0])
    world.state.robot_item[1] = free
    world.state.item_status[free], world.state.item_carrier[free] = 1, 1


def delivered_in_fm4(world: Warehouse) -> None:
    state = world.state
    gone = state.requested
    carrier = state.item_carrier[gone]
    if carrier != NOBODY:
        state.robot_item[carrier] = NOBODY
    state.item_status[gone], state.item_carrier[gone] = DELIVERED, NOBODY
    state.requested = int(np.flatnonzero(state.item_status == STORED)[0])
    state.delivery_times.append(state.time)
    state.delivered_by.append(2)


def removed_robot_is_back(world: Warehouse) -> None:
    world.state.robot_present[5] = True
    world.state.robot_position[5] = (2.0, 1.5)


def deliveries_taken_back(world: Warehouse) -> None:
    delivered_in_fm4(world)
    world.state.delivery_times.clear()


def row_that_is_no_number(world: Warehouse) -> None:
    world.observe()[0, 3] = np.nan


SPOILT: dict[str, tuple[Spoil, str]] = {
    "item in two hands": (
        put("robot_item", lambda w: carriers(w)[1], lambda w: w.state.robot_item[carriers(w)[0]]),
        "two robots carry one item",
    ),
    "items lost": (
        put("item_status", lambda w: w.state.item_status == STORED, DELIVERED),
        "have left for 0 deliveries",
    ),
    "request of nothing": (request(NOBODY), "nothing is asked for"),
    "request of what is gone": (request(20), "is asked"),
    "robots in one place": (
        put("robot_position", 0, lambda w: w.state.robot_position[1]),
        "overlap by",
    ),
    "robot in the wall": (put("robot_position", (0, 0), 0.01), "overlap by"),
    "robot outside": (put("robot_position", 0, (-1.0, 1.0)), "overlap by"),
    "place that is no number": (put("robot_position", 0, np.nan), "overlap by nan"),
    "timer at its limit": (put("robot_timer", 0, 10.0), r"robot_timer leaves \[0, 10\)"),
    "timer from nowhere": (put("robot_heard", 7, -1.0), "robot_heard leaves"),
    "deaf robot hears": (put("robot_heard", 3, 5.0), "does not hear has heard"),
    "honest in FM1": (put("robot_told", 0, 3.0), "tells no 0"),
    "dead robot turns": (
        put("robot_heading", 4, lambda w: w.state.robot_heading[4] + 0.1),
        "robot 4 turns",
    ),
    "lifted in FM2": (lifted_in_fm2, "robot 1 lifts item"),
    "delivered in FM4": (delivered_in_fm4, "robot 2 delivers"),
    "removed robot is back": (removed_robot_is_back, "robot 5, removed, is there"),
    "deliveries taken back": (
        deliveries_taken_back,
        "have left for 0 deliveries|noted for 0 deliveries",
    ),
    "row that is no number": (row_that_is_no_number, "range_robots"),
}


@pytest.mark.parametrize("spoilt", SPOILT)
def test_the_watch_sees(spoilt: str) -> None:
    world, (spoil, words) = crowd(), SPOILT[spoilt]
    watch = Watch(world)
    for _ in range(3):
        world.step(np.tile([0.1, 0.0, 0.0, 1.0], (8, 1)))
        watch.look()
    spoil(world)
    with pytest.raises(BrokenPromiseError, match=words):
        watch.look()


MEMORY = """
import resource
import numpy as np
from swarm_logistics_env import Fault, Scenario, Warehouse

world = Warehouse(Scenario(n_robots=6, n_items=8, warehouse_width=4, warehouse_height=3,
                           delivery_width=1, restock=True, message_size=2))
rng, peaks = np.random.default_rng(0), []
for half in range(2):
    for episode in range(20):
        world.reset(episode, [Fault("motor_slow", 2, 5.0, 5.0)])
        for step in range(500):
            world.step(rng.uniform(-1, 1, (6, 6)))
    peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
print(*peaks)
"""


def test_the_peak_memory_of_a_world_is_flat_over_its_second_half() -> None:
    pytest.importorskip("resource")  # not on Windows
    done = subprocess.run(
        [sys.executable, "-c", MEMORY], cwd=ROOT, capture_output=True, text=True, check=True
    )
    half, whole = map(int, done.stdout.split())
    assert whole <= 1.01 * half
