from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3")

from swarm_logistics_env import Scenario
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.train.settings import Conditions
from swarm_logistics_env.train.training import (
    EpisodeMix,
    follow_progress,
    make_worlds,
    performances_of_study,
)
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.wrappers import Condition

OWN = Scenario(warehouse_width=4.0, warehouse_height=3.0, n_robots=3, n_items=5, duration=20.0)


def study(out: Path, *policies: str) -> Study:
    made = Study(
        out=out,
        policies=policies,
        seeds=2,
        scenario=OWN,
        faults=[{"modes": ["FM4"], "robots": [1]}],
        parameters=[{"name": "delivery_width", "values": [2.0, 1.0]}],
    )
    made.run()
    return made


def test_a_study_tells_the_performance_under_each_condition(tmp_path: Path) -> None:
    results = study(tmp_path, "swarm-dt-follow").findings()
    told = performances_of_study(tmp_path, OWN)
    plain = Condition(3)
    expected = {
        plain,
        Condition(3, ("FM4",), n_failed=1),
        Condition(3, n_removed=1),
        Condition(3, changes=(("delivery_width", 1.0),)),
    }
    assert set(told) == expected
    (no_fault,) = {
        cell.mean.value
        for cell in results.cells
        if cell.arm.case.scenario == OWN
        and not cell.arm.case.faults
        and not cell.arm.case.behaviour
    }
    assert told[plain] == no_fault


def test_studies_that_cannot_serve_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="no study in"):
        performances_of_study(tmp_path, OWN)
    study(tmp_path / "two", "swarm-dt", "random-walk")
    with pytest.raises(TrainingError, match="is of random-walk, swarm-dt: should be of one policy"):
        performances_of_study(tmp_path / "two", OWN)


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


def test_weights_follow_the_progress_of_the_training(small: Any) -> None:
    easy = Conditions(weight=1.0, final_weight=0.0)
    hard = Conditions(weight=0.0, final_weight=1.0, modes=("FM4",), robots=(1,))
    worlds = make_worlds(small(conditions=(easy, hard)))
    hit = []
    for done in (0.0, 0.5, 1.0):
        follow_progress(worlds, done)
        met = 0
        for seed in range(100):
            worlds.worlds[1].reset_arrays(seed)
            met += bool(worlds.worlds[1].unwrapped.warehouse.faults)
        hit.append(met)
    worlds.close()
    assert hit[0] == 0
    assert 35 <= hit[1] <= 65
    assert hit[2] == 100


def test_a_training_without_episodes_at_its_end_is_refused(small: Any) -> None:
    with pytest.raises(TrainingError, match=r"conditions\.final_weight: .* worlds of 3 robots"):
        small(conditions=(Conditions(final_weight=0.0),))
    with pytest.raises(TrainingError, match=r"conditions\.weight: should be above 0 for one kind"):
        small(conditions=(Conditions(weight=0.0, final_weight=1.0),))
    with pytest.raises(TrainingError, match="weight: should be above 0, or `final_weight` should"):
        Conditions(weight=0.0)


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
