"""A recipe that was trained several times: all of its networks are one policy of a study."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode, spi
from swarm_logistics_env.core.errors import PolicyError, StudyError
from swarm_logistics_env.policies.catalogue import WEIGHTS, trainings_of
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
    fields: dict[str, Any] = {"policies": [recipe], "scenario": SMALL, "indicators": ["R"]}
    fields["faults"] = [{"modes": ["FM4"], "robots": [2]}]
    study = Study(out=tmp_path / "out", seeds=3, **fields)
    study.run()
    results = study.findings()
    (verdict,) = results.verdicts
    assert verdict.estimate is not None
    assert (verdict.estimate.n_trainings, verdict.estimate.n_seeds) == (5, 3)
    p_o, p_f = (
        [
            [run_episode(SMALL, policies.load(training), s, faults).delivered for s in range(3)]
            for training in trainings_of(recipe)
        ]
        for faults in ([], ["FM4:2"])
    )
    expected = spi.robustness(p_o, p_f, n=4, m=2)
    assert (verdict.estimate.value, verdict.estimate.low) == (expected.value, expected.low)
    means = [cell.mean.value for cell in results.cells]
    assert means == pytest.approx([np.mean(p_o), np.mean(p_f)], rel=1e-12)
    (page,) = (path.read_text() for path in study.report() if path.suffix == ".html")
    assert "mine, 5 trainings" in page
    # How many collapsed stands beside the value, in the table and in the notes of the answer.
    collapsed = verdict.estimate.collapsed
    assert collapsed is not None
    assert collapsed.of == 5
    assert f"[{expected.low:.3f}, {expected.high:.3f}] ({collapsed})" in page
    assert f"f the trainings at worst {collapsed}" in page
    with pytest.raises(StudyError, match="--all-seeds"):
        Study(until_clear=True, **fields).plan()


def test_trainings_count_in_order_and_are_no_policy_to_play(recipe: str) -> None:
    assert [Path(training).stem for training in trainings_of(recipe)[-2:]] == ["mine@4", "mine@10"]
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
        indices = {case.key: index for index, case in enumerate(plan.cases)}
        counts = {
            (run.case.key, run.seed): mean + spread * (indices[run.case.key] % 5) + run.seed % 3
            for run in plan.runs
        }
        return judge(plan, {k: delivered(n, digest=f"{k} {n}") for k, n in counts.items()})

    gate, old = Gate.parse("change < -0.1"), results(40, 1)
    gate_answers = answers(gate, old, results(6, 1))
    assert [answer.fails for answer in gate_answers] == [True, True]
    assert {
        answer.estimate and (answer.estimate.n_trainings, answer.estimate.n_seeds)
        for answer in gate_answers
    } == {(5, 6)}
    assert [(answer.fails, answer.exact) for answer in answers(gate, old, old)] == [
        (False, 0.0)
    ] * 2
