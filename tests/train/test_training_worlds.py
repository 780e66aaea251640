from __future__ import annotations

from collections import Counter

import pytest

pytest.importorskip("stable_baselines3")

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.train.settings import Conditions
from swarm_logistics_env.train.training import (
    EpisodeMix,
)
from swarm_logistics_env.warehouse import Fault


def mixed(*kinds: Conditions) -> EpisodeMix:
    env = SwarmLogisticsEnv(n_robots=4, n_items=5, duration=1.0)
    return EpisodeMix(env, kinds)


def test_episodes_are_drawn_by_weight_and_seed() -> None:
    kinds = (
        Conditions(weight=3.0),
        Conditions(weight=1.0, modes=("FM1", "FM4"), robots=(1, 3), onset=(0.0, 0.5)),
    )
    env = mixed(*kinds)
    met: Counter[tuple[str, object]] = Counter()
    onsets = set()
    for seed in range(200):
        env.reset_arrays(seed)
        faults = env.warehouse.faults
        met[(faults[0].mode, faults[0].robots) if faults else ("none", 0)] += 1
        onsets |= {fault.onset for fault in faults}
    assert 0.0 <= min(onsets) < 0.1 < 0.4 < max(onsets) <= 0.5
    assert 130 <= met["none", 0] <= 170
    assert set(met) == {("none", 0), ("FM1", 1), ("FM1", 3), ("FM4", 1), ("FM4", 3)}
    env.reset_arrays(7)
    first = env.warehouse.faults
    other = mixed(*kinds)
    other.reset_arrays(7)
    assert other.warehouse.faults == first


def test_scenarios_are_drawn_and_options_come_first() -> None:
    env = mixed(Conditions(scenario={"delivery_width": [1.0, 3.0]}))
    widths = set()
    for seed in range(20):
        env.reset_arrays(seed)
        widths.add(env.warehouse.scenario.delivery_width)
    assert widths == {1.0, 3.0}
    env.reset_arrays(0, {"scenario": {"delivery_width": 2.5}, "faults": [Fault("FM2", 1)]})
    assert env.warehouse.scenario.delivery_width == 2.5
    assert [fault.mode for fault in env.warehouse.faults] == ["FM2"]
