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
from swarm_logistics_env.world.scenario.checks import LONGEST_STRIDE
from swarm_logistics_env.world.warehouse.state import DELIVERED, NOBODY, STORED
from verification.invariants import BrokenPromiseError, Watch
from verification.soak import Tally, play, towards


# `python -m verification.soak --first NUMBER --worlds 1 --steps 80` plays a world again.
@given(number=st.integers(0, 2**32))
@settings(max_examples=settings().max_examples // 8)
def test_no_random_world_breaks_a_promise(number: int) -> None:
    play(random.Random(number), 80, Tally())


@pytest.mark.parametrize("mass", [1.0, 22.0])
def test_a_crowd_presses_nobody_out_at_the_longest_stride(mass: float) -> None:
    scenario = Scenario(
        n_robots=34, n_items=2, warehouse_width=2.4, warehouse_height=3.6, delivery_width=0.25,
        restock=True, robot_radius=0.1, robot_mass=mass, max_speed=4.0, physics_period=0.02,
        control_period=0.1, item_radius=0.04,
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
@pytest.mark.daily
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
        robots = watch.depth[:, :n_robots].max()
        walls = watch.depth[:, n_robots : n_robots + 4].max()
        assert robots <= 2 * closing
        assert walls <= closing
        deepest.append(max(robots, walls))
    assert np.median(deepest) <= 0.002


Spoil = Callable[[Any], None]


def put(field: str, index: Any, value: Any) -> Spoil:
    """Return what puts a value into the state."""
    return lambda state: getattr(state, field).__setitem__(index, value)


def two_hands(state: Any) -> None:
    first, second = np.flatnonzero(state.robot_item != NOBODY)[:2]
    state.robot_item[second] = state.robot_item[first]


def lifted_in_fm2(state: Any) -> None:
    free = np.flatnonzero(state.item_status == STORED)[0]
    state.robot_item[1], state.item_status[free], state.item_carrier[free] = free, 1, 1


def asked_less(state: Any) -> None:
    state.orders.n_asked[...] -= 1


SPOILT: list[tuple[str, Spoil]] = [
    ("two robots carry one item", two_hands),
    ("an item is carried by nobody", put("item_status", slice(None), DELIVERED)),
    ("nothing is asked for", put("open_requests", 0, NOBODY)),
    ("a request is lost", asked_less),
    ("overlap by", put("robot_position", (0, 0), 0.01)),
    ("overlap by nan", put("robot_position", 0, np.nan)),
    (r"robot_timer leaves \[0, 10\)", put("robot_timer", 0, 10.0)),
    ("does not hear has heard", put("robot_heard", 3, 5.0)),
    ("tells no 0", put("robot_told", 0, 3.0)),
    ("robot 4 turns", put("robot_heading", 4, 9.0)),
    ("robot 1 lifts item", lifted_in_fm2),
]


@pytest.mark.parametrize(("words", "spoil"), SPOILT, ids=[words for words, _ in SPOILT])
def test_the_watch_sees(words: str, spoil: Spoil) -> None:
    world = Warehouse(Scenario(n_robots=8, n_items=99, warehouse_width=4.0, pickup_range=1.0))
    modes = ("FM1", "FM2", "FM4", "FM3", "dead", "removed")
    world.reset(0, [Fault(mode, (robot,)) for robot, mode in enumerate(modes)])
    watch = Watch(world)
    for _ in range(3):
        world.step(np.tile([0.1, 0.0, 0.0, 1.0], (8, 1)))
        watch.look()
    spoil(world.state)
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


@pytest.mark.daily
def test_the_peak_memory_of_a_world_is_flat_over_its_second_half() -> None:
    pytest.importorskip("resource")  # not on Windows
    root = Path(verification.__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-c", MEMORY], cwd=root, capture_output=True, text=True, check=True
    )
    at_half, at_end = map(int, done.stdout.split())
    assert at_end <= 1.01 * at_half
