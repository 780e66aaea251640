"""A recipe that was trained several times: all of its networks are one policy of a study."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode, spi
from swarm_logistics_env.core.errors import PolicyError, StudyError
from swarm_logistics_env.policies.spec import WEIGHTS, trainings_of
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts.gate import Gate, answers
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from tests.made_up import delivered

SHIPPED = [*trainings_of("ppo-robust@all")[:2], "ppo-delivery"]
SMALL = Scenario(n_robots=4, n_items=6, restock=True, duration=60.0)


@pytest.fixture
def recipe(tmp_path: Path) -> str:
    """A recipe of five trainings; the shipped networks stand for them."""
    for number in (1, 2, 3, 4, 10):
        source = WEIGHTS / f"{SHIPPED[number % 3]}.safetensors"
        shutil.copy(source, tmp_path / f"mine@{number}.safetensors")
    return str(tmp_path / "mine@all.safetensors")


def test_a_study_judges_all_trainings_together(recipe: str, tmp_path: Path) -> None:
    asked: dict[str, Any] = {"policies": [recipe], "scenario": SMALL, "indicators": ["R"]}
    asked["faults"] = [{"modes": ["FM4"], "robots": [2]}]
    study = Study(out=tmp_path / "out", seeds=3, **asked)
    study.run()
    found = study.findings()
    (verdict,) = found.verdicts
    assert verdict.estimate is not None
    assert (verdict.estimate.n_trainings, verdict.estimate.n_seeds) == (5, 3)
    p_o, p_f = (
        [
            [run_episode(SMALL, policies.load(one), s, faults).delivered for s in range(3)]
            for one in trainings_of(recipe)
        ]
        for faults in ([], ["FM4:2"])
    )
    same = spi.robustness(p_o, p_f, n=4, m=2)
    assert (verdict.estimate.value, verdict.estimate.low) == (same.value, same.low)
    means = [cell.mean.value for cell in found.cells]
    assert means == pytest.approx([np.mean(p_o), np.mean(p_f)], rel=1e-12)
    (page,) = (path.read_text() for path in study.report() if path.suffix == ".html")
    assert "mine, 5 trainings" in page
    # How many collapsed stands beside the value, in the table and in the notes of the answer.
    collapsed = verdict.estimate.collapsed
    assert collapsed is not None
    assert collapsed.of == 5
    assert f"[{same.low:.3f}, {same.high:.3f}] ({collapsed})" in page
    assert f"of the trainings at worst {collapsed}" in page
    with pytest.raises(StudyError, match="--all-seeds"):
        Study(until_clear=True, **asked).plan()


def test_trainings_count_in_order_and_are_no_policy_to_play(recipe: str) -> None:
    assert [Path(one).stem for one in trainings_of(recipe)[-2:]] == ["mine@4", "mine@10"]
    with pytest.raises(PolicyError, match="is 5 trainings: should name one of"):
        policies.load(recipe)
    for name in ("ppo-nobody@all", "nowhere/mine@all.safetensors"):
        with pytest.raises(PolicyError, match=r"two trainings or more.* found 0"):
            policies.load(name)


def test_a_gate_on_changes_judges_the_runs_of_all_trainings(recipe: str) -> None:
    faults = [{"modes": ["FM4"], "robots": [2]}]
    plan = Study(policies=[recipe], seeds=6, scenario=SMALL, faults=faults, indicators=["R"]).plan()

    def results(mean: int, spread: int) -> StudyResults:
        """Trainings and seeds differ from each other."""
        places = {case.key: place for place, case in enumerate(plan.cases)}
        counts = {
            (run.case.key, run.seed): mean + spread * (places[run.case.key] % 5) + run.seed % 3
            for run in plan.runs
        }
        return judge(plan, {k: delivered(n, digest=f"{k} {n}") for k, n in counts.items()})

    gate, old = Gate.parse("change < -0.1"), results(40, 1)
    found = answers(gate, old, results(6, 1))
    assert [one.fails for one in found] == [True, True]
    assert {one.estimate and (one.estimate.n_trainings, one.estimate.n_seeds) for one in found} == {
        (5, 6)
    }
    assert [(one.fails, one.exact) for one in answers(gate, old, old)] == [(False, 0.0)] * 2
