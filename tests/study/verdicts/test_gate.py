"""Gates: how they read, on which verdicts they fail, and that what cannot be judged fails."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import judge as judge_trials
from swarm_logistics_env import spi
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.cell import same_runs
from swarm_logistics_env.study.verdicts.gate import Gate, answers, match
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from tests.made_up import delivered

SPREAD = (0, 2, -1, 1, 3, -2)
# Mean P by (N, m); m = -1: removed.
WELL = {(10, 0): 40, (20, 0): 70, (10, 1): 39, (10, -1): 36}
WORSE = {**WELL, (10, 1): 20}


def results(
    performance: dict[tuple[int, int], int], capped_at: int | None = None, **fields: Any
) -> StudyResults:
    """Sizes 10 and 20, one faulty robot of 10; it delivers every item at seed `capped_at`."""
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


def test_a_gate_names_the_verdicts_that_fail_or_is_refused() -> None:
    gate, above = Gate.parse("possibly R < 0"), Gate.parse("possibly  change>-1e-1 at N = 5")
    assert [gate.fails_on(v) for v in ("supported", "open", "refuted")] == [0, 1, 1]
    assert [above.fails_on(v) for v in ("supported", "open", "refuted")] == [1, 1, 0]
    assert gate == ("possibly R < 0", True, "R", True, 0.0, "")
    assert above[1:] == (True, "change", False, -0.1, "N = 5")
    assert Gate.parse(" FT > .5 ") == ("FT > .5", False, "FT", False, 0.5, "")
    assert [gate.holds_for(value) for value in (-0.1, 0.0, 0.1)] == [True, False, False]
    assert [above.holds_for(value) for value in (-0.2, -0.1, 0.1)] == [False, False, True]
    for text in ("", "R <", "R <= 0", "Q < 0", "R < 0 and S < 0", "R < nan"):
        with pytest.raises(StudyError) as refusal:
            Gate.parse(text)
        assert str(refusal.value) == (
            f"gate {text!r}: should be [possibly] S|FT|R|A|change <|> NUMBER [at TEXT], e.g. "
            '"R < 0" or "possibly change < -0.1 at N = 25"'
        )


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    ("text", "old", "new", "failing"),
    [
        ("R < 0", WELL, WORSE, True),
        ("R < 0", WORSE, WELL, False),
        ("S < 0", WELL, WORSE, False),
        ("change < -0.1 at FM1, m = 1", WELL, WORSE, True),
        ("change < -0.1 at N = 20", WELL, WORSE, False),
        ("change > 0.1 at FM1", WORSE, WELL, True),
        ("possibly change < -0.1", WELL, WELL, False),
    ],
)
def test_regression_is_found_and_nothing_else(text: str, old: Any, new: Any, failing: bool) -> None:
    assert fails(text, results(old), results(new)) == failing


@pytest.mark.daily
def test_a_gate_over_several_comparisons_keeps_its_error_over_all_of_them() -> None:
    faults = {"modes": ["FM1", "FM2", "FM4"], "robots": [1, 2]}
    plan = Study(seeds=8, scenario={"n_robots": 10}, faults=[faults]).plan()

    def drawn(mean: float, rng: np.random.Generator) -> StudyResults:
        runs = {(run.case.key, run.seed): rng.poisson(mean) for run in plan.runs}
        return judge(plan, {k: delivered(p, digest=f"{k} {p}") for k, p in runs.items()})

    softened = set()
    for number in (3, 4):  # of which Holm's method softens a verdict of every gate
        rng = np.random.default_rng(number)
        old = drawn(42, rng)
        new = drawn(38, rng)
        for gate in ("change < 0", "R > 0", "FT > 0"):
            gate_answers = answers(Gate.parse(gate), old, new)
            estimates = [answer.estimate for answer in gate_answers if answer.estimate]
            assert len(estimates) == len(gate_answers) >= 6
            adjusted = spi.adjust(estimates)
            assert tuple(answer.verdict for answer in gate_answers) == adjusted
            if tuple(estimate.verdict for estimate in estimates) != adjusted:
                softened.add(gate)
    assert len(softened) == 3


def test_a_capped_p_is_never_called_equivalent() -> None:
    base = results({**WELL, (10, 1): 60}, margin=0.9)
    outcomes = {key: replace(outcome, all_delivered=True) for key, outcome in base.outcomes.items()}
    for judged, verdict in ((base, "equivalent"), (judge(base.plan, outcomes), "open")):
        tests = [v.equivalence for v in judged.verdicts if v.compared.indicator == "R"]
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


def test_the_same_runs_answer_a_gate_exactly() -> None:
    plan = results(WELL).plan
    # If nothing is delivered, no change can be estimated.
    nothing = judge(plan, {(r.case.key, r.seed): Outcome(digest=r.key) for r in plan.runs})
    for unchanged in (results(WORSE, seeds=2), nothing):
        for text, failing in (("possibly change < 0", False), ("change > -0.1", True)):
            gate_answers = answers(Gate.parse(text), unchanged, unchanged)
            assert {(answer.fails, answer.exact) for answer in gate_answers} == {(failing, 0.0)}
    # Imported results have no digests: equal numbers do not show that runs are the same.
    recorded = [Outcome(digest="a"), Outcome()]
    assert not same_runs(recorded, recorded)


def test_runs_are_paired_by_their_seeds_and_not_by_their_place() -> None:
    old = results(WELL, first_seed=0)
    new = results({key: p // 2 for key, p in WELL.items()}, first_seed=2)
    for answer in answers(Gate.parse("change < 0"), old, new):
        assert answer.estimate is not None
        assert answer.estimate.n_seeds == 4
        assert (answer.estimate.pairing_correlation or 0.0) > 0.9
        assert answer.fails
    assert match(old, new).seeds == (2, 3, 4, 5)
    damaged, only_old, only_new = match(replace(old, damage="A row is damaged"), new).notes
    assert damaged == "A row is damaged."
    shared = "Runs are paired over the shared seeds, 2 to 5."
    assert only_old == f"Only in the old study, and left out: seeds 0 to 1. {shared}"
    assert only_new == f"Only in the new study, and left out: seeds 6 to 7. {shared}"
    (answer,) = answers(Gate.parse("change < 0 at N = 20"), old, results(WELL, first_seed=100))
    assert answer.fails
    assert answer.problem == (
        "the studies share no seed: the old one has 0 to 5, the new one 100 to 105; play one of "
        "them on the other's seeds"
    )


def test_an_ablation_s_policy_is_not_compared() -> None:
    # The random walk of the old study is judged in none.
    ablation: dict[str, Any] = {"ablations": [{"policy": "random-walk"}]}
    old, new = results(WELL, **ablation), results(WORSE, policies=["random-walk"], **ablation)
    gate_answers = answers(Gate.parse("change < 0"), old, new)
    assert {a.name.split(": ")[0] for a in gate_answers} == {"swarm-dt -> random-walk"}
    assert len(gate_answers) == 4
    assert gate_answers[0].name == "swarm-dt -> random-walk: change, N = 10 (Scalability)"
    assert any(answer.fails for answer in gate_answers)


def test_a_judged_policy_without_a_match_fails_and_is_named() -> None:
    single, both = results(WELL), results(WELL, policies=["swarm-dt", "random-walk"])
    for old, new in ((single, both), (both, single)):
        (failing,) = (a for a in answers(Gate.parse("change < 0"), old, new) if a.fails)
        assert failing.name == "random-walk: change"
        assert failing.problem == (
            "policy 'random-walk' is judged under no condition of both studies: the old one judges "
            f"{[*old.policies]}, the new one {[*new.policies]}"
        )
        # A gate on the other policy alone is answered.
        assert not fails("change < 0 at swarm-dt", old, new)
        assert fails("change < 0 at random-walk", old, new)


def test_conditions_of_one_study_alone_are_named() -> None:
    old = results(WELL)
    new = results(WELL, sizes=[])
    words = "study, and not compared: swarm-dt, N = 20 (Scalability)."
    assert match(old, new).notes == (f"Only in the old {words}",)
    assert match(new, old).notes == (f"Only in the new {words}",)


def test_what_cannot_be_judged_fails_and_a_gate_on_nothing_is_refused() -> None:
    old = results(WELL, scenario={"n_robots": 10, "n_items": 70})
    failed = judge(old.plan, {run_key: Outcome(error="x") for run_key in old.outcomes})
    for gate, new, words in (
        (
            "change < 0",
            results(WELL),
            "policy 'swarm-dt' is judged under no condition of both studies",
        ),
        ("R < 0", failed, "6 of 6 runs failed"),
    ):
        (answer,) = answers(Gate.parse(gate), old, new)
        assert answer.fails
        assert words in str(answer.problem)
        assert (answer.estimate, answer.verdict, answer.exact) == (None, None, None)
    assert answer.name == "swarm-dt: R, FM1, m = 1 (Fault tolerance and robustness)"
    for text in ("A < 0", "R < 0 at FM4"):
        with pytest.raises(StudyError) as refusal:
            answers(Gate.parse(text), old, old)
        assert str(refusal.value) == (
            f"gate {text!r}: the studies hold nothing that it names, so it tests nothing"
        )


def test_a_gate_on_what_cannot_be_passes() -> None:
    widths = {"name": "handling_time", "values": [1.0, 2.0]}
    judged = results({(10, 0): 40}, sizes=[], faults=[], parameters=[widths])
    (answer,) = answers(Gate.parse("possibly A < 0"), judged, judged)
    assert (answer.fails, answer.verdict) == (False, "open")
    (answer,) = answers(Gate.parse("possibly A < 0.5"), judged, judged)
    assert answer.estimate is not None
    assert not answer.estimate.untestable


def test_conditions_without_a_run_are_not_the_same_runs() -> None:
    outcome = Outcome(digest="1")
    assert same_runs([outcome], [outcome])
    assert not same_runs([], [])


def test_blocks_of_other_names_are_no_pairs() -> None:
    """Their numbers are those of other maps."""

    def trials(*names: str) -> StudyResults:
        rows = [(n, name, 2 * n + k) for n in (4, 8) for k, name in enumerate(names)]
        return judge_trials(pd.DataFrame(rows, columns=["robots", "map", "P"]))

    before = trials("hall", "roof", "yard")
    assert match(before, trials("yard", "hall", "roof")).seeds == (0, 1, 2)
    unmatched = match(before, trials("roof", "tower", "yard"))
    assert unmatched.seeds is None
    assert unmatched.notes == (
        "Their blocks have other names, so that runs are compared without pairs.",
    )
