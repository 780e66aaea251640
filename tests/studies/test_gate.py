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

SPREAD = (0, 2, -1, 1, 3, -2)
# Mean P by (N, m); m = -1: removed.
WELL = {(10, 0): 40, (20, 0): 70, (10, 1): 39, (10, -1): 36}
WORSE = {**WELL, (10, 1): 20}
ABLATION: dict[str, Any] = {"ablations": [{"policy": "random-walk"}]}


def results(
    performance: dict[tuple[int, int], int], capped_at: int | None = None, **fields: Any
) -> StudyResults:
    """Results of a study of sizes 10 and 20 and one faulty robot of 10.

    Args:
        performance: mean P by (N, m); every seed adds its own share.
        capped_at: the seed at which the faulty swarm delivers every item.
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
        modes = [fault.mode for fault in run.case.faults]
        m = -1 if "removed" in modes else len(modes)
        mean = performance[run.case.scenario.n_robots, m]
        # In proportion, so that differences scatter too.
        count = mean + SPREAD[run.seed % len(SPREAD)] * mean // 20 + number % 3 % 2
        full = (m, run.seed) == (1, capped_at)
        outcomes[run.case.key, run.seed] = delivered(
            count, digest=f"{run.key} {count}", all_delivered=full
        )
    return judge(plan, outcomes)


def fails(text: str, old: StudyResults, new: StudyResults) -> bool:
    return any(answer.fails for answer in answers(Gate.parse(text), old, new))


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


@pytest.mark.parametrize(
    "text", ["", "R", "R <", "R < x", "R <= 0", "Q < 0", "R < 0 and S < 0", "R < nan", "R < inf"]
)
def test_what_is_no_gate_is_refused(text: str) -> None:
    with pytest.raises(StudyError, match="should be"):
        Gate.parse(text)


@pytest.mark.parametrize(
    ("text", "old", "new", "failing"),
    [
        ("R < 0", WELL, WORSE, True),
        ("R < 0", WORSE, WELL, False),
        ("S < 0", WELL, WORSE, False),
        ("change < -0.1", WELL, WORSE, True),
        ("change < -0.1 at FM1, m = 1", WELL, WORSE, True),
        ("change < -0.1 at N = 20", WELL, WORSE, False),
        ("change > 0.1 at FM1", WORSE, WELL, True),
        ("possibly change < -0.1", WELL, WELL, False),
    ],
)
def test_regression_is_found_and_nothing_else(text: str, old: Any, new: Any, failing: bool) -> None:
    assert fails(text, results(old), results(new)) == failing


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
    for found, verdict in ((same, "equivalent"), (judge(same.plan, outcomes), "inconclusive")):
        tests = [v.equivalence for v in found.verdicts if v.compared.indicator == "R"]
        assert {test.verdict for test in tests if test} == {verdict}


def test_a_capped_p_fails_a_change_gate_only_where_a_larger_p_would_too() -> None:
    fall, rise = "change < -0.1 at FM1", "change > 0.1 at FM1"
    # The true P of the new study may be as large as that of the old one.
    assert not fails(fall, results(WELL), results(WORSE, capped_at=2))
    # A larger P of the old one only makes the fall larger.
    assert fails(fall, results(WELL, capped_at=2), results(WORSE))
    assert not fails(rise, results(WORSE, capped_at=2), results(WELL))
    # A cap counts in the seeds that are compared.
    more = results(WORSE, capped_at=7, seeds=8)
    assert fails(fall, results(WELL), more)
    assert not fails(fall, results(WELL, seeds=8), more)


def test_comparisons_of_one_label_in_two_tables_are_all_judged() -> None:
    faults = [
        {"title": title, "modes": ["FM1"], "robots": [1], "scenario": {"n_robots": n}}
        for title, n in (("few", 10), ("many", 20))
    ]
    new = results({**WORSE, (20, 1): 69, (20, -1): 68}, faults=faults)
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
        ("possibly change < 0", False),
        ("possibly change > 0", False),
        ("change < 0.1", True),
        ("possibly change < 0.1", True),
        ("change > -0.1", True),
    ],
)
def test_the_same_runs_answer_a_gate_exactly(text: str, failing: bool) -> None:
    plan = results(WELL).plan
    # If nothing is delivered, no change can be estimated.
    nothing = judge(plan, {(r.case.key, r.seed): Outcome(digest=r.key) for r in plan.runs})
    for same in (results(WORSE, seeds=2), nothing):
        said = answers(Gate.parse(text), same, same)
        assert {(answer.fails, answer.exact) for answer in said} == {(failing, 0.0)}


@pytest.mark.parametrize(
    ("before", "after", "same"),
    [
        (["a", "b"], ["a", "b"], True),
        (["a", "b"], ["a", "c"], False),
        (["a"], ["a", "b"], False),
        # Imported results have no digests: equal numbers do not show that runs are the same.
        (["a", None], ["a", None], False),
    ],
)
def test_runs_are_the_same_where_their_digests_are(before: Any, after: Any, same: bool) -> None:
    assert same_runs(before, after) == same


def test_runs_are_paired_by_their_seeds_and_not_by_their_place() -> None:
    old = results(WELL, seeds=6, first_seed=0)
    new = results({key: p - 4 for key, p in WELL.items()}, seeds=6, first_seed=2)
    for answer in answers(Gate.parse("change < 0"), old, new):
        assert answer.estimate is not None
        assert answer.estimate.n_seeds == 4
        assert (answer.estimate.pairing_correlation or 0.0) > 0.9
        assert answer.fails
    paired = "Runs are paired over the shared seeds, 2 to 5."
    assert match(old, new).notes == (
        f"Only in the old study, and left out: seeds 0 to 1. {paired}",
        f"Only in the new study, and left out: seeds 6 to 7. {paired}",
    )
    apart = results(WELL, first_seed=100)
    (answer,) = answers(Gate.parse("change < 0 at N = 20"), old, apart)
    assert answer.fails
    assert "share no seed" in str(answer.problem)


@pytest.mark.parametrize("policy", ["swarm-dt-follow", "random-walk"])
def test_an_ablation_s_policy_is_not_compared(policy: str) -> None:
    # The random walk of the old study is judged in none.
    old = results(WELL, **ABLATION)
    new = results(WORSE, policies=[policy], **ABLATION)
    said = answers(Gate.parse("change < 0"), old, new)
    assert {a.name.split(": ")[0] for a in said} == {f"swarm-dt -> {policy}"}
    assert len(said) == 4
    assert any(answer.fails for answer in said)


def test_a_judged_policy_without_a_match_fails_and_is_named() -> None:
    one = results(WELL)
    two = results(WELL, policies=["swarm-dt", "random-walk"])
    for old, new, study, other in ((one, two, "new", "old"), (two, one, "old", "new")):
        (failing,) = (a for a in answers(Gate.parse("change < 0"), old, new) if a.fails)
        assert failing.problem == (
            f"policy 'random-walk' of the {study} study has no match: the {other} study judges "
            "'swarm-dt'"
        )
        # A gate on the other policy alone is answered.
        assert not fails("change < 0 at swarm-dt", old, new)
        assert fails("change < 0 at random-walk", old, new)


def test_conditions_of_one_study_alone_are_listed() -> None:
    old = results(WELL)
    new = results({**WELL, (30, 0): 90}, sizes=[{"values": [10, 30]}])
    assert len(answers(Gate.parse("change < 0"), old, new)) == 3
    assert match(old, new).notes == (
        "Only in the old study, and not compared: swarm-dt, N = 20 (Scalability).",
        "Only in the new study, and not compared: swarm-dt, N = 30 (Scalability).",
    )


def test_what_cannot_be_judged_fails_and_a_gate_on_nothing_is_refused() -> None:
    old = results(WELL, scenario={"n_robots": 10, "n_items": 70})
    failed = {place: Outcome(error="x") for place in old.outcomes}
    for gate, one, other, words in (
        ("change < 0", old, results(WELL), "judged in both studies, but under no common condition"),
        ("R < 0", old, judge(old.plan, failed), "6 of 6 runs failed"),
    ):
        (answer,) = answers(Gate.parse(gate), one, other)
        assert answer.fails
        assert words in str(answer.problem)
    for text in ("A < 0", "R < 0 at FM4", "change < 0 at N = 99"):
        with pytest.raises(StudyError, match="tests nothing"):
            answers(Gate.parse(text), results(WELL), results(WELL))
