"""The same key gives the same trajectory: in any process, and beside any other world."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import numpy as np

from swarm_logistics_env import Fault, Scenario, Warehouse, policies

# 5,000 steps at N = 25: every step's state and observations go into the hash.
SCRIPT = textwrap.dedent(
    """
    import hashlib, sys
    import numpy as np
    from swarm_logistics_env import Fault, Scenario, Warehouse, policies

    def begin(scenario, seed, faults=()):
        world, policy = Warehouse(scenario), policies.load("swarm-dt")
        policy.configure(scenario)
        policy.reset(scenario.n_robots, seed)
        return world, policy, [world.reset(seed, faults)]

    def advance(world, policy, rows):
        rows[0] = world.step(policy.act(rows[0]))

    def note(digest, world, rows):
        state = world.state
        for array in (
            rows[0], state.robot_position, state.robot_velocity, state.robot_heading,
            state.robot_item, state.robot_memory, state.robot_timer, state.robot_told,
            state.robot_contact, state.item_position, state.item_status, state.item_carrier,
        ):
            digest.update(np.ascontiguousarray(array).tobytes())
        digest.update(repr((state.requested, state.delivery_times, state.delivered_by)).encode())

    scenario = Scenario(restock=True)
    digest = hashlib.blake2b()
    main = begin(scenario, 0, [Fault("motor_slow", 2, onset=100.0, duration=50.0)])
    other = None
    if sys.argv[1] == "interleaved":
        other = begin(Scenario(n_robots=9, n_items=30, n_obstacles=3, relay="gossip"), 1)
    for step in range(5000):
        advance(*main)
        note(digest, main[0], main[2])
        if other:
            advance(*other)
            if step % 1000 == 999:
                other[2][0] = other[0].reset(step)
    print(digest.hexdigest(), main[0].state.delivered, main[0].state.step)
    """
)


def trajectory(hash_seed: str, how: str) -> str:
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed}
    command = [sys.executable, "-c", SCRIPT, how]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout


def test_a_trajectory_is_the_same_in_three_processes_and_beside_another_world() -> None:
    first = trajectory("0", "alone")
    _, delivered, steps = first.split()
    assert int(steps) == 5000
    assert int(delivered) > 10
    assert trajectory("1", "alone") == first
    assert trajectory("20240229", "interleaved") == first


def test_worlds_of_a_kind_that_step_side_by_side_do_not_touch_each_other() -> None:
    scenario = Scenario(n_robots=12, n_items=20, warehouse_width=5, warehouse_height=4)
    worlds = [Warehouse(scenario) for _ in range(3)]
    steered = [policies.load("swarm-dt") for _ in worlds]
    rows = []
    for world, policy in zip(worlds, steered):
        policy.reset(12, 0)
        rows.append(world.reset(0, [Fault("FM1", 2)]))
    for _ in range(100):
        for number, (world, policy) in enumerate(zip(worlds, steered)):
            rows[number] = world.step(policy.act(rows[number]))
        np.testing.assert_array_equal(rows[0], rows[1])
        np.testing.assert_array_equal(rows[0], rows[2])
