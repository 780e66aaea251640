"""Resets that are refused: nothing has changed then, and the episode goes on as if never asked."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import Fault
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.core.errors import SwarmLogisticsError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import FaultInjection, FixedAgents, SwarmSize

FIELDS: dict[str, Any] = {"n_robots": 4, "n_items": 6, "duration": 30.0}
BAD_SEEDS = ["x", 1.5, [1], object(), b"1", np.array([1, 2])]
BAD_OPTIONS: list[Any] = [
    {"scenario": {"n_robots": 40}}, {"scenario": {"n_robots": 0}}, {"scenario": {"n_robot": 2}},
    {"scenario": 3}, {"scenario": {"n_items": 10**6}}, {"faults": [Fault("removed", 4)]},
    {"faults": [Fault("FM1", 9)]}, {"faults": "FM1"}, {"faults": [3]}, {"fault": []}, [], "x",
]  # fmt: skip
MAKERS: dict[str, Callable[[], Any]] = {
    "plain": lambda: SwarmLogisticsEnv(**FIELDS),
    "faults": lambda: FaultInjection(SwarmLogisticsEnv(**FIELDS), "FM1", robots=1),
    "sizes": lambda: SwarmSize(SwarmLogisticsEnv(**FIELDS), [2, 4]),
    "fixed": lambda: FixedAgents(SwarmLogisticsEnv(**FIELDS)),
    "central": lambda: CentralEnv(**FIELDS),
}
requests = st.one_of(
    st.tuples(st.sampled_from(BAD_SEEDS), st.none()),
    st.tuples(st.sampled_from([None, 3]), st.sampled_from(BAD_OPTIONS)),
)


def later(env: Any, steps: int) -> list[Any]:
    """Return all that an environment tells in some steps and in the episode after them."""
    record: list[Any] = [env.state().tobytes(), list(getattr(env, "agents", ()))]
    world: Any = env.env if isinstance(env, CentralEnv) else env
    for step in range(steps):
        if isinstance(env, CentralEnv):
            seen, *_ = env.step(np.full(env.action_space.shape, 0.1 * step, np.float32))
            record.append(seen.tobytes())
        else:
            actions = {agent: np.full(4, 0.1 * step, np.float32) for agent in env.agents}
            seen, *_ = env.step(actions)
            record.append({agent: row.tobytes() for agent, row in seen.items()})
    record.append(world.next_seed)
    env.reset()
    return [*record, env.state().tobytes(), getattr(env, "np_random_seed", None)]


@pytest.mark.parametrize("kind", MAKERS)
@given(request=requests, begun=st.booleans(), steps=st.integers(0, 3))
@settings(max_examples=max(15, settings().max_examples // 10))
def test_a_reset_that_is_refused_changes_nothing(
    kind: str, request: tuple[Any, Any], begun: bool, steps: int
) -> None:
    env = MAKERS[kind]()
    env.reset(seed=5)
    if begun:
        later(env, steps)
    untouched = deepcopy(env)
    seed, options = request
    with pytest.raises(SwarmLogisticsError):
        env.reset(seed=seed, options=options)
    assert later(env, steps) == later(untouched, steps)


def test_a_seed_below_0_is_refused_where_gymnasium_has_no_generator_for_it() -> None:
    env = CentralEnv(**FIELDS)
    env.reset(seed=5)
    untouched = deepcopy(env)
    with pytest.raises(
        SwarmLogisticsError, match="seed = -1: should be a whole number of at least"
    ):
        env.reset(seed=-1)
    assert env.np_random_seed == 5
    assert later(env, 3) == later(untouched, 3)
