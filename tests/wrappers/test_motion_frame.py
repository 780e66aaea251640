"""The frame of motion as a wrapper: what a learner of any library reads and says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, motion
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import CommandError
from swarm_logistics_env.motion.frame import INPUTS
from swarm_logistics_env.streams import row_keys
from swarm_logistics_env.wrappers import (
    FaultInjection,
    FixedAgents,
    MotionFrame,
    SwarmSize,
)


def small(**fields: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(**{"n_robots": 4, "n_items": 8, "duration": 2.0, **fields})


def test_it_reads_and_commands_as_the_frame_of_the_shipped_networks_does() -> None:
    env, inner = MotionFrame(small()), small()
    frame = motion.MotionFrame(Scenario())
    rng = np.random.default_rng(0)
    for seed in (3, 4):
        read, rows = env.reset_arrays(seed), inner.reset_arrays(seed)
        frame.begin(row_keys(seed, "motion frame", 4))
        while env.agents:
            np.testing.assert_array_equal(read, frame.read(rows))
            outputs = rng.uniform(-1.0, 1.0, (4, 3))
            rows, *others = inner.step_arrays(frame.command(outputs))
            read, *rest = env.step_arrays(outputs)
            assert all((one == other).all() for one, other in zip(rest, others))
        assert not inner.agents


def test_dicts_are_the_arrays_and_who_left_is_zeros() -> None:
    fields: dict[str, Any] = {"faults": [Fault("removed", 2, onset=0.5)]}
    env, arrays = MotionFrame(small(**fields)), MotionFrame(small(**fields))
    observations, _ = env.reset(seed=1)
    rows = arrays.reset_arrays(1)
    for _ in range(10):
        there = env.agents
        for agent in there:
            np.testing.assert_array_equal(observations[agent], rows[int(agent[6:])])
        assert set(observations) == {*env.agents}
        observations, *_ = env.step(dict.fromkeys(there, np.array([0.5, 0.1, 0.0])))
        observations = {agent: observations[agent] for agent in env.agents}
        rows, *_ = arrays.step_arrays(np.full((4, 3), [0.5, 0.1, 0.0]))
    assert len(env.agents) == 2
    left = ~arrays.warehouse.state.robot_present
    assert not rows[left].any()


@pytest.mark.parametrize("outputs", [np.zeros((4, 4)), np.full((4, 3), np.nan)])
def test_outputs_that_cannot_be_are_refused_before_anything_moves(outputs: Any) -> None:
    env = MotionFrame(small())
    env.reset_arrays(0)
    with pytest.raises(CommandError, match=r"should be \(4, 3\) finite numbers, along, aside"):
        env.step_arrays(outputs)
    assert env.warehouse.state.step == 0


def test_who_does_not_listen_reads_no_timer() -> None:
    rows = MotionFrame(small(n_robots=20), listens=False).reset_arrays(0)
    assert rows.shape == (20, len(INPUTS))
    assert not rows[:, motion.frame.LEAD].any()


def stacked(world: int = 0) -> FixedAgents:
    return FixedAgents(MotionFrame(SwarmSize(FaultInjection(small(), "FM1", 1), [2, 4])))


def test_it_stacks_in_a_vector_environment() -> None:
    pytest.importorskip("stable_baselines3")
    from swarm_logistics_env.adapters import SwarmVecEnv

    env = SwarmVecEnv(make_env=stacked, n_worlds=3, seed=0)
    assert env.reset().shape == (12, len(INPUTS))
    for _ in range(25):  # beyond the end of an episode
        rows, *_ = env.step(np.full((12, 3), 0.3))
    assert np.isfinite(rows).all()
