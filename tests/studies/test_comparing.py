from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparing import answers
from swarm_logistics_env.studies.execution import Outcome
from swarm_logistics_env.studies.gate import Gate
from swarm_logistics_env.studies.judgement import Findings, judge
from swarm_logistics_env.studies.plan import Plan

SPREAD = (0, 2, -1, 1, 3, -2)


def findings(
    performance: dict[tuple[int, int], int], shifts: dict[int, int] | None = None, **fields: Any
) -> Findings:
    """Findings of a study of sizes 10 and 20 and one faulty robot of 10.

    Args:
        performance: mean P by (N, m); every seed adds its own, the same everywhere.
        shifts: added to P of N by a tenth of the seed's number, so that differences scatter.
    """
    plan = Study(
        **{
            "seeds": len(SPREAD),
            "scenario": {"n_robots": 10},
            "sizes": [{"values": [10, 20]}],
            "faults": [{"modes": ["FM1"], "robots": [1]}],
            **fields,
        }
    ).plan()
    return judge(plan, dict(outcomes(plan, performance)), len(SPREAD))


def outcomes(plan: Plan, performance: dict[tuple[int, int], int]) -> Any:
    for number, run in enumerate(plan.runs()):
        condition = run.condition
        removed = any(fault.mode == "removed" for fault in condition.faults)
        key = (condition.scenario.n_robots, -1 if removed else len(condition.faults))
        delivered = performance[key] + SPREAD[run.seed] + number % 3 % 2
        yield run.key, Outcome(run.key, untimed=delivered)


WELL = {(10, 0): 40, (20, 0): 70, (10, 1): 39, (10, -1): 36}
WORSE = {**WELL, (10, 1): 20}


def fails(text: str, old: Findings, new: Findings) -> bool:
    return any(answer.fails for answer in answers(Gate.parse(text), old, new))


def test_regression_is_found_and_nothing_else() -> None:
    well, worse = findings(WELL), findings(WORSE)
    assert fails("R < 0", well, worse)
    assert not fails("R < 0", worse, well)
    assert not fails("S < 0", well, worse)
    assert fails("change < -0.1", well, worse)
    assert fails("change < -0.1 at FM1", well, worse)
    assert not fails("change < -0.1 at N = 20", well, worse)
    assert not fails("possibly change < -0.1", well, well)
    # Whether P fell at all cannot be told from equal runs.
    (answer, *_) = answers(Gate.parse("change < 0"), well, well)
    assert answer.estimate is not None
    assert answer.estimate.value == 0


def test_every_shared_condition_is_compared_once() -> None:
    names = [a.name for a in answers(Gate.parse("change < 0"), findings(WELL), findings(WELL))]
    assert len(names) == 4


def test_comparisons_of_one_label_in_two_tables_are_all_judged() -> None:
    faults = [
        {"title": title, "modes": ["FM1"], "robots": [1], "scenario": {"n_robots": n}}
        for title, n in (("few", 10), ("many", 20))
    ]
    performance = {**WORSE, (20, 1): 69, (20, -1): 68}
    new = findings(performance, faults=faults)
    names = [answer.name for answer in answers(Gate.parse("R < 0"), new, new)]
    assert names == [f"swarm-dt: R, FM1, m = 1 ({table})" for table in ("few", "many")]
    assert fails("R < 0", new, new)
    assert not fails("R < 0 at many", new, new)


def test_an_indicator_asked_against_two_thresholds_is_judged_once() -> None:
    asked = findings(WELL, sizes=[{"values": [10, 20], "superlinear": [[10, 20]]}])
    (answer,) = answers(Gate.parse("S < 0.5"), asked, asked)
    assert answer.name == "swarm-dt: S, N 10 -> 20"


def test_other_seeds_and_another_policy_are_compared_where_they_can_be() -> None:
    old = findings(WELL, seeds=4)
    new = findings(WORSE, policies=["random-walk"])
    (answer,) = answers(Gate.parse("change < -0.1 at FM1"), old, new)
    assert answer.name.startswith("swarm-dt -> random-walk")
    assert answer.estimate is not None
    assert answer.estimate.n_seeds == 4


def test_what_cannot_be_judged_fails() -> None:
    plan = findings(WELL).plan
    failed = judge(plan, {run.key: Outcome(run.key, error="x") for run in plan.runs()}, 6)
    (answer,) = answers(Gate.parse("R < 0"), findings(WELL), failed)
    assert answer.fails
    assert "6 of 6 runs failed" in str(answer.problem)


@pytest.mark.parametrize("text", ["A < 0", "R < 0 at FM4", "change < 0 at N = 99"])
def test_gate_that_tests_nothing_is_refused(text: str) -> None:
    with pytest.raises(StudyError, match="tests nothing"):
        answers(Gate.parse(text), findings(WELL), findings(WELL))
