from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.train.references import performances_of_study
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
        cell.mean
        for cell in rows_of(results.performance)
        if cell.arm.condition.scenario == OWN
        and not cell.arm.condition.faults
        and not cell.arm.condition.behaviour
    }
    assert told[plain] == no_fault


def test_studies_that_cannot_serve_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TrainingError, match="no study in"):
        performances_of_study(tmp_path, OWN)
    study(tmp_path / "two", "swarm-dt", "random-walk")
    with pytest.raises(TrainingError, match="is of random-walk, swarm-dt: should be of one policy"):
        performances_of_study(tmp_path / "two", OWN)
