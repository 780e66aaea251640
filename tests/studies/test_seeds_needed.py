from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.results import StudyResults, demands, judge
from swarm_logistics_env.tasks.task import Outcome


def pilot(preset: str = "", seeds: int = 5, **fields: Any) -> StudyResults:
    given = {"sizes": [{"values": [5, 10]}], **fields}
    study = Study.preset(preset, seeds=seeds) if preset else Study(seeds=seeds, **given)
    plan = study.plan()
    outcomes = {
        run.key: Outcome(run.key, untimed=run.condition.scenario.n_robots + (7 * number) % 5)
        for number, run in enumerate(plan.runs())
    }
    return judge(plan, outcomes)


def test_named_effect_decides_the_number() -> None:
    far, near = (demands(pilot(), effect)[0] for effect in (1.0, 0.3))
    assert far.seeds is not None
    assert near.seeds is not None
    assert far.seeds < near.seeds
    estimate = far.test.estimate
    assert estimate is not None
    assert far.seeds == spi.seeds_for_power(estimate, 1.0, 0.8)
    assert far.detectable == pytest.approx(spi.minimum_detectable_effect(estimate, 0.8))


def test_observed_effect_is_never_taken() -> None:
    (demand,) = demands(pilot())
    assert demand.effect is None
    assert demand.seeds is None
    assert demand.problem == "no effect is named"
    assert demand.detectable is not None


def test_published_effect_is_taken_where_there_is_one() -> None:
    by_step = {d.test.comparison: d for d in demands(pilot("paper"))}
    assert by_step["N 10 -> 20"].effect == pytest.approx(0.611, abs=1e-3)
    assert by_step["FM4, m = 2"].effect is not None


def test_threshold_as_effect_has_no_number() -> None:
    (demand,) = demands(pilot(), effect=0.0)
    assert demand.seeds is None
    assert "lies at the threshold" in str(demand.problem)


def test_blocked_comparison_says_why() -> None:
    plan = pilot().plan
    (demand,) = demands(judge(plan, {}), effect=1.0)
    assert "5 of 5 runs missing" in str(demand.problem)
