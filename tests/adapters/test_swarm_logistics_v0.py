"""The environment as PettingZoo's users make it."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.wrappers import MotionFrame


def test_a_view_of_motion_is_what_its_wrapper_shows() -> None:
    env = swarm_logistics_v0.parallel_env(n_robots=3, view="motion")
    wrapped = MotionFrame(swarm_logistics_v0.parallel_env(n_robots=3))
    assert np.array_equal(env.reset_arrays(seed=3), wrapped.reset_arrays(seed=3))
    outputs = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 3))
    for _ in range(20):
        rows, *_ = env.step_arrays(outputs)
        rows_of_wrapper, *_ = wrapped.step_arrays(outputs)
        assert np.array_equal(rows, rows_of_wrapper)


def test_agents_that_take_turns_have_that_view_too() -> None:
    env = swarm_logistics_v0.env(n_robots=2, view="motion")
    env.reset(seed=0)
    observation, *_ = env.last()
    assert observation in env.observation_space(env.agent_selection)
    assert env.action_space(env.agent_selection).shape == (3,)


def test_another_view_is_refused() -> None:
    with pytest.raises(SetupError, match='view = \'map\': should be "body" or "motion"'):
        swarm_logistics_v0.parallel_env(view="map")  # type: ignore[call-overload]
