"""Gates: how they read, on which verdicts they fail, and that what cannot be judged fails."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.gate import Gate, answers, match
from swarm_logistics_env.studies.results import StudyResults, judge
from swarm_logistics_env.studies.verdict import same_runs
from swarm_logistics_env.tasks.task import Outcome
from tests.studies.made_up import delivered


@pytest.mark.parametrize(
    ("text", "failing"),
    [
        ("R < 0", {"refuted"}),
        ("R > 0", {"supported"}),
        ("possibly R < 0", {"refuted", "inconclusive"}),
        ("possibly  change>-1e-1 at N = 5", {"supported", "inconclusive"}),
    ],
)
def test_which_verdicts_fail(text: str, failing: set[str]) -> None:
    gate = Gate.parse(text)
    assert {v for v in ("supported", "refuted", "inconclusive") if gate.fails_on(v)} == failing
    whole = Gate.parse(" possibly change > -0.1 at FM1, m = 2 ")
    assert (whole.possibly, whole.subject, whole.below) == (True, "change", False)
    assert (whole.number, whole.at) == (-0.1, "FM1, m = 2")


@pytest.mark.parametrize(
    "text", ["", "R", "R <", "R < x", "R <= 0", "Q < 0", "R < 0 and S < 0", "R < nan", "R < inf"]
)
def test_what_is_no_gate_is_refused(text: str) -> None:
    with pytest.raises(StudyError, match="should be"):
        Gate.parse(text)


SPREAD = (0, 2, -1, 1, 3, -2)


def results(performance: dict[tuple[int, int], int], **fields: Any) -> StudyResults:
    """Results of a study of sizes 10 and 20 and one faulty robot of 10.

    Args:
        performance: mean P by (N, m); every seed adds its own share.
        fields: of the study that differ.
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
    outcomes = {}
    for number, run in enumerate(plan.runs):
        removed = any(fault.mode == "removed" for fault in run.case.faults)
        mean = performance[run.case.scenario.n_robots, -1 if removed else len(run.case.faults)]
        # In proportion, so that differences scatter too.
        count = mean + SPREAD[run.seed % len(SPREAD)] * mean // 20 + number % 3 % 2
        outcomes[run.case.key, run.seed] = delivered(count, digest=f"{run.key} {count}")
    return judge(plan, outcomes)


WELL = {(10, 0): 40, (20, 0): 70, (10, 1): 39, (10, -1): 36}
WORSE = {**WELL, (10, 1): 20}


def fails(text: str, old: StudyResults, new: StudyResults) -> bool:
    return any(answer.fails for answer in answers(Gate.parse(text), old, new))


def test_regression_is_found_and_nothing_else() -> None:
    well, worse = results(WELL), results(WORSE)
    assert fails("R < 0", well, worse)
    assert not fails("R < 0", worse, well)
    assert not fails("S < 0", well, worse)
    assert fails("change < -0.1", well, worse)
    assert fails("change < -0.1 at FM1", well, worse)
    assert not fails("change < -0.1 at N = 20", well, worse)
    assert not fails("possibly change < -0.1", well, well)


@pytest.mark.parametrize("gate", ["change < 0", "R > 0", "FT > 0"])
def test_a_gate_over_several_comparisons_keeps_its_error_over_all_of_them(gate: str) -> None:
    softened = 0
    for number in range(8):
        rng = np.random.default_rng(number)

        def some(mean: float, rng: np.random.Generator = rng) -> StudyResults:
            asked = {"modes": ["FM1", "FM2", "FM4"], "robots": [1, 2]}
            plan = Study(seeds=8, scenario={"n_robots": 10}, faults=[asked]).plan()
            runs = {(run.case.key, run.seed): rng.poisson(mean) for run in plan.runs}
            return judge(plan, {k: delivered(p, digest=f"{k} {p}") for k, p in runs.items()})

        said = answers(Gate.parse(gate), some(42), some(38))
        estimates = [one.estimate for one in said if one.estimate]
        assert len(estimates) == len(said) >= 6
        assert tuple(one.verdict for one in said) == spi.adjust(estimates)
        softened += tuple(one.verdict for one in estimates) != spi.adjust(estimates)
    assert softened


def test_a_capped_p_is_never_called_equivalent() -> None:
    same = results({**WELL, (10, 1): 60}, margin=0.9)
    outcomes = {key: replace(one, all_delivered=True) for key, one in same.outcomes.items()}

    def said(found: StudyResults) -> set[str]:
        tests = [v.equivalence for v in found.verdicts if v.compared.indicator == "R"]
        return {test.verdict for test in tests if test}

    assert said(same) == {"equivalent"}
    assert said(judge(same.plan, outcomes)) == {"inconclusive"}


def capped(found: StudyResults, m: int, seed: int) -> StudyResults:
    """Return the same study with every item delivered in one run at m faulty robots of ten."""
    changed = dict(found.outcomes)
    for run in found.plan.runs:
        modes = [fault.mode for fault in run.case.faults]
        size = run.case.scenario.n_robots
        if (size, modes, run.seed) == (10, ["FM1"] * m, seed):
            key = run.case.key, run.seed
            changed[key] = replace(changed[key], all_delivered=True)
    return judge(found.plan, changed)


def test_a_capped_p_fails_a_change_gate_only_where_a_larger_p_would_too() -> None:
    well, worse = results(WELL), results(WORSE)
    # The true P of the new study may be as large as that of the old one.
    assert not fails("change < -0.1 at FM1", well, capped(worse, 1, seed=2))
    # A larger P of the old one only makes the fall larger.
    assert fails("change < -0.1 at FM1", capped(well, 1, seed=2), worse)
    assert fails("change > 0.1 at FM1", worse, well)
    assert not fails("change > 0.1 at FM1", capped(worse, 1, seed=2), well)


def test_a_cap_counts_in_the_seeds_that_are_compared() -> None:
    more = capped(results(WORSE, seeds=8), 1, seed=7)
    assert fails("change < -0.1 at FM1", results(WELL), more)
    assert not fails("change < -0.1 at FM1", results(WELL, seeds=8), more)


def test_comparisons_of_one_label_in_two_tables_are_all_judged() -> None:
    faults = [
        {"title": title, "modes": ["FM1"], "robots": [1], "scenario": {"n_robots": n}}
        for title, n in (("few", 10), ("many", 20))
    ]
    performance = {**WORSE, (20, 1): 69, (20, -1): 68}
    new = results(performance, faults=faults)
    names = [answer.name for answer in answers(Gate.parse("R < 0"), new, new)]
    assert names == [f"swarm-dt: R, FM1, m = 1 ({table})" for table in ("few", "many")]
    assert fails("R < 0", new, new)
    assert not fails("R < 0 at many", new, new)
    # An indicator that is asked against two thresholds is judged once.
    asked = results(WELL, sizes=[{"values": [10, 20], "superlinear": [[10, 20]]}])
    (answer,) = answers(Gate.parse("S < 0.5"), asked, asked)
    assert answer.name == "swarm-dt: S, N 10 -> 20"


@pytest.mark.parametrize(
    ("text", "failing"),
    [
        ("change < 0", False),
        ("possibly change < 0", False),
        ("possibly change > 0", False),
        ("possibly change < -0.1", False),
        ("change < 0.1", True),
        ("possibly change < 0.1", True),
        ("change > -0.1", True),
    ],
)
def test_the_same_runs_answer_a_gate_exactly(text: str, failing: bool) -> None:
    plan = results(WELL).plan
    # If nothing is delivered, no change can be estimated.
    nothing = judge(plan, {(r.case.key, r.seed): Outcome(digest=r.key) for r in plan.runs})
    for same in (results(WELL), results(WORSE, seeds=2), nothing):
        said = answers(Gate.parse(text), same, same)
        assert {(answer.fails, answer.exact) for answer in said} == {(failing, 0.0)}


def test_runs_are_the_same_where_their_digests_are() -> None:
    assert same_runs(["a", "b"], ["a", "b"])
    assert not same_runs(["a", "b"], ["a", "c"])
    assert not same_runs(["a"], ["a", "b"])
    # Imported results have no digests, so that equal numbers do not show that runs are the same.
    assert not same_runs(["a", None], ["a", None])


def test_runs_are_paired_by_their_seeds_and_not_by_their_place() -> None:
    old = results(WELL, seeds=6, first_seed=0)
    new = results({key: p - 4 for key, p in WELL.items()}, seeds=6, first_seed=2)
    said = answers(Gate.parse("change < 0"), old, new)
    for answer in said:
        assert answer.estimate is not None
        assert answer.estimate.n_seeds == 4
        assert answer.estimate.pairing_correlation is not None
        assert answer.estimate.pairing_correlation > 0.9
        assert answer.fails
    paired = "Runs are paired over the shared seeds, 2 to 5."
    assert match(old, new).notes == (
        f"Only in the old study, and left out: seeds 0 to 1. {paired}",
        f"Only in the new study, and left out: seeds 6 to 7. {paired}",
    )


ABLATION: dict[str, Any] = {"ablations": [{"policy": "random-walk"}]}


def test_an_ablation_s_policy_is_not_compared() -> None:
    # The random walk of both studies is the same, and judged in neither.
    old = results(WELL, **ABLATION)
    new = results(WORSE, policies=["swarm-dt-follow"], **ABLATION)
    said = answers(Gate.parse("change < 0"), old, new)
    assert len(said) == 4
    assert all(answer.name.startswith("swarm-dt -> swarm-dt-follow: ") for answer in said)
    assert any(answer.fails for answer in said)
    # Judged, it is compared with what was judged, and not with the old ablation.
    judged = results(WORSE, policies=["random-walk"], **ABLATION)
    said = answers(Gate.parse("change < 0"), old, judged)
    assert {a.name.split(": ")[0] for a in said} == {"swarm-dt -> random-walk"}
    assert len(said) == 4


def test_a_judged_policy_without_a_match_fails_and_is_named() -> None:
    one = results(WELL)
    two = results(WELL, policies=["swarm-dt", "random-walk"])
    for old, new, study, other in ((one, two, "new", "old"), (two, one, "old", "new")):
        said = answers(Gate.parse("change < 0"), old, new)
        (failing,) = (answer for answer in said if answer.fails)
        assert failing.problem == (
            f"policy 'random-walk' of the {study} study has no match: the {other} study judges "
            "'swarm-dt'"
        )
        # A gate on the other policy alone is answered.
        assert not fails("change < 0 at swarm-dt", old, new)
        assert fails("change < 0 at random-walk", old, new)
        assert fails("change < 0 at FM1", old, new)


def test_conditions_of_one_study_alone_are_listed() -> None:
    old = results(WELL)
    new = results({**WELL, (30, 0): 90}, sizes=[{"values": [10, 30]}])
    assert len(answers(Gate.parse("change < 0"), old, new)) == 3
    assert match(old, new).notes == (
        "Only in the old study, and not compared: swarm-dt, N = 20 (Scalability).",
        "Only in the new study, and not compared: swarm-dt, N = 30 (Scalability).",
    )


def test_what_cannot_be_judged_fails() -> None:
    old = results(WELL, scenario={"n_robots": 10, "n_items": 70})
    failed = {place: Outcome(error="x") for place in old.outcomes}
    for gate, one, other, words in (
        ("change < 0", old, results(WELL), "judged in both studies, but under no common condition"),
        ("R < 0", old, judge(old.plan, failed), "6 of 6 runs failed"),
    ):
        (answer,) = answers(Gate.parse(gate), one, other)
        assert answer.fails
        assert words in str(answer.problem)


@pytest.mark.parametrize("text", ["A < 0", "R < 0 at FM4", "change < 0 at N = 99"])
def test_gate_that_tests_nothing_is_refused(text: str) -> None:
    with pytest.raises(StudyError, match="tests nothing"):
        answers(Gate.parse(text), results(WELL), results(WELL))
