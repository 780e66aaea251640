"""The same key gives the same trajectory: in any process, and beside any other world."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, policies, swarm_logistics_v0
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize


def trajectory(with_another: bool) -> str:
    """Play 1,500 steps; every step's state and all that it returns go into the hash."""
    env: Any = swarm_logistics_v0.parallel_env(duration=150.0, restock=True, radio_loss=0.1)
    drawn: dict[str, Any] = {"onset": lambda rng: rng.uniform(10.0, 100.0, size=3)}
    env = FaultInjection(env, "motor_slow", robots=2, duration=40.0, **drawn)
    env = SwarmSize(env, [16, 20], leave=[(2, 60.0), (3, 90.0)])
    env = ParameterChange(env, "delivery_width", [1.0, 3.0], at=[50.0, 100.0])
    env, policy = FaultInjection(env, "FM1", robots=3, onset=60.0), policies.load("swarm-dt")
    rows = env.reset_arrays(0)
    policy.reset(len(rows), 0)
    other = Warehouse(Scenario(n_robots=9, n_items=30, n_obstacles=3, relay="gossip"))
    other_rows, state = other.reset(1), env.warehouse.state
    digest = hashlib.blake2b(rows.tobytes())
    while env.agents:
        rows, *outcome = env.step_arrays(policy.act(rows))
        for part in (
            rows, *outcome, state.robot_position, state.robot_velocity, state.robot_heading,
            state.robot_item, state.robot_memory, state.robot_timer, state.robot_told,
            state.robot_contact, state.item_position, state.item_status, state.item_carrier,
        ):  # fmt: skip
            digest.update(np.ascontiguousarray(part).tobytes())
        record = (env.agents, state.failure_modes, state.requested, state.delivery_times)
        digest.update(repr((*record, state.delivered_by)).encode())
        if with_another:
            other_rows = other.step(0.5 * other_rows[:, :4])
            if state.step % 500 == 499:
                other_rows = other.reset(state.step)
    return f"{digest.hexdigest()} {state.delivered} {state.step} {len(env.failed_robots)}"


@pytest.mark.daily
def test_a_trajectory_is_the_same_in_another_process_and_beside_another_world() -> None:
    first = trajectory(False)
    _, delivered, *counts = first.split()
    assert counts == ["1500", "3"]
    assert int(delivered) > 2
    script = "from tests.test_determinism import trajectory; print(trajectory(True))"
    paths = {"PYTHONHASHSEED": "20240229", "PYTHONPATH": os.pathsep.join(sys.path)}
    command, environment = [sys.executable, "-c", script], {**os.environ, **paths}
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert process.stdout.strip() == first
