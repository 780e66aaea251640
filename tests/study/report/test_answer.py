"""The answer: a line a question, with value, interval and verdict, on one screen."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from dataclasses import replace
from typing import Any

import pandas as pd
import pytest

from swarm_logistics_env import judge as judge_trials
from swarm_logistics_env import spi
from swarm_logistics_env.study.report.answer import MOST_LINES, Line, answer
from swarm_logistics_env.study.report.section import limits
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from swarm_logistics_env.study.verdicts.verdict import UNAFFECTED, Decision
from tests.made_up import decided, delivered, judged, paper


def test_every_question_has_a_line_with_its_numbers(few: StudyResults) -> None:
    lines = answer(few, most=None).lines
    numbers = [number for line in lines for number in line.numbers]
    assert sorted(numbers) == [*range(len(few.verdicts))]
    for line in lines:
        ((number,), (test,)) = line.numbers, line.verdicts
        assert test is few.verdicts[number]
        assert test.interval is not None
        value, low, high = test.interval
        assert low is not None
        assert high is not None
        assert line.value == f"{value:.2f}" + "†" * test.saturated
        # One of them is 0.0004, above its threshold 0.
        interval_text = limits(test.estimate or test.interval, 2)
        assert interval_text == f"[{low:.2f}, {high:.2f}]" or abs(low) < 0.005
        assert (line.interval(0.95), line.interval(0.9)) == (interval_text, f"{interval_text} 95 %")
        assert line.verdict_text.startswith(test.on_property.adjusted)
        assert line.question.startswith(test.compared.indicator)
        more = re.fullmatch(r"open; (\d+) more to tell -?0.1 from 0", line.verdict_text)
        if more:
            assert test.estimate is not None
            effect = test.compared.threshold + (0.1 if value > test.compared.threshold else -0.1)
            assert spi.seeds_for_power(test.estimate, effect) == 4 + int(more[1])


def test_what_is_alike_shares_a_line_and_no_question_is_lost(few: StudyResults) -> None:
    lines = answer(few).lines
    assert len(lines) <= MOST_LINES - 5
    assert sum(len(line.verdicts) for line in lines) == len(few.verdicts)
    for line in (line for line in lines if len(line.verdicts) > 1):
        assert len({test.compared.family for test in line.verdicts}) == 1
        counts = Counter(test.on_property.adjusted for test in line.verdicts)
        for word, count in counts.items():
            assert (word if len(counts) == 1 else f"{count} {word}") in line.verdict_text
    questions = [line.question for line in lines if "FM4" in line.question]
    assert questions == ["FT FM4, 1, 2, 3 of 25", "R FM4, 1, 2, 3 of 25"]


@pytest.mark.daily
def test_digest_fits_the_screen_and_nothing_is_cut(
    few: StudyResults, compared: StudyResults
) -> None:
    for results, width in itertools.product((few, compared), (60, 80)):
        lines = terminal_answer(answer(results), width).splitlines()
        assert len(lines) <= MOST_LINES
        assert not any("…" in line for line in lines if "N 5→" not in line)
        all_lines = terminal_answer(answer(results, most=None), width, most=None).splitlines()
        assert max(map(len, [*lines, *all_lines])) <= width
        assert len(all_lines) >= len(results.verdicts)
        # No line is folded within the values of a question, where there is room for them.
        values = "1, 2, 3 of 25"
        questions = [line.question for line in answer(results).lines]
        assert width < 80 or "\n".join(lines).count(values) == sum(
            values in text for text in questions
        )


def test_claims_are_counted_and_what_contradicts_the_paper_is_marked(few: StudyResults) -> None:
    claims = Counter(decided(test.on_claim).adjusted for test in few.verdicts if test.claim)
    # Two of them are not in the text: that P falls without taxis.
    count, supported = claims.total() - 2, claims["supported"] - 2
    last = answer(few).notes
    assert f"of {count} claims in the paper's text {supported} supported, " in last
    # The robots of a fleet that FM4 spares deliver all the same: the paper says they do not.
    tough = answer(paper(lambda _, at: 39.0 if at.name == "FM4" else 20.0), most=None)
    against = {line.question for line in tough.lines if line.contradicts}
    assert {"FT FM4, 3 of 25", "R FM4, 3 of 25"} <= against
    assert not any(line.contradicts for line in answer(few).lines)
    assert "provisional (below ten seeds" in last
    assert "† P is capped" in last


def test_a_row_that_is_open_beside_its_interval_says_why() -> None:
    of_twelve = answer(paper(seeds=12), most=None)
    still_open = [line for line in of_twelve.lines if line.verdicts[0].conclusion == "open"]
    reasons = {line.reason for line in still_open} - {""}
    assert reasons == {"stalls", "Holm"}
    for line in still_open:
        if line.reason:
            assert line.verdict_text == f"open ({line.reason})"
            assert line.verdicts[0].lies_above is not None
    assert set(re.findall(r"\((\w+)\): ", of_twelve.notes)) == reasons


def test_words_for_what_is_no_plain_verdict() -> None:
    nothing = answer(paper(lambda *_: 0.0, seeds=1), most=None)
    undefined = {line.verdict_text for line in nothing.lines if line.indicator == "S"}
    assert undefined == {"undefined: it delivers nothing"}
    assert "P is small: a longer duration tells more" in nothing.notes
    unaffected = answer(paper(unaffected=frozenset({"FM2"})), most=None)
    exact = {line.verdict_text for line in unaffected.lines if line.question.startswith("R FM2")}
    assert exact == {"unaffected, exact"}
    assert "provisional" not in unaffected.notes
    assert "P is small" not in unaffected.notes


def test_several_verdicts_share_the_interval_of_those_that_have_one(few: StudyResults) -> None:
    first, second = (verdict for verdict in few.verdicts[:2])
    assert first.interval is not None
    whole = Line("", "S", "", (first, second), (0, 1)).interval(0.95)
    assert re.fullmatch(r"in \[-?\d\.\d\d, -?\d\.\d\d\]", whole)
    exact = replace(second, on_threshold=Decision(UNAFFECTED, UNAFFECTED))
    text = Line("", "S", "", (first, exact), (0, 1)).interval(0.95)
    assert text == f"1 of 2 in {limits(first.interval, 2)}"


def test_a_decided_ratio_without_an_interval_says_why(few: StudyResults) -> None:
    verdict = few.verdicts[0]
    assert verdict.estimate is not None
    unbounded = replace(verdict.estimate, flags=(*verdict.estimate.flags, "unbounded"))
    supported = replace(
        verdict, estimate=unbounded, on_threshold=Decision("supported", "supported")
    )
    line = Line("", "S", "", (supported,), (0,))
    assert line.verdict_text == "supported by its test; P_o is too near 0 for an interval"


@pytest.mark.parametrize(("adjusted", "contradicts"), [("open", False), ("refuted", True)])
def test_a_claim_is_contradicted_by_what_holm_leaves(
    few: StudyResults, adjusted: Any, contradicts: bool
) -> None:
    decision = Decision("refuted", adjusted)
    verdict = replace(few.verdicts[0], on_threshold=decision, claimed=True)
    assert Line("", "S", "", (verdict,), (0,)).contradicts is contradicts


def test_p_of_no_delivery_has_the_limit_of_its_runs() -> None:
    study = Study(seeds=4, sizes=[{"values": [2, 3]}])
    nothing = judged(study, lambda *_: delivered(0))
    assert ": 0 (at most 0.75 at 95 %, as none of 4 runs delivered" in answer(nothing).performance


def test_p_of_a_policy_is_that_of_its_first_table() -> None:
    tables = [{"modes": ["FM1"]}, {"modes": ["FM4"], "scenario": {"n_items": 20}}]
    plan = Study(seeds=2, faults=tables, scenario={"n_items": 50}).plan()
    outcomes = {
        (run.case.key, run.seed): delivered(run.case.scenario.n_items + run.seed)  # type: ignore[attr-defined]
        for run in plan.runs
    }
    assert ": 50.5 [" in answer(judge(plan, outcomes)).performance


def test_policies_stand_one_below_the_other_each_with_its_p(compared: StudyResults) -> None:
    text = terminal_answer(answer(compared), 80)
    assert re.search(r"at N = 25, no fault: swarm-dt 39\.\d \[[\d., ]+\],\s+swarm-dt-follow", text)
    assert all(
        re.match(r"swarm-dt(-follow)?: ", question) for question in answer(compared).questions
    )
    assert re.search(r"swarm-dt-follow\s+20\.\d \[[\d., ]+\]\.", text)


def test_one_question_at_two_values_of_a_parameter_names_them() -> None:
    rows = [
        (robots, speed, 10 * robots + seed % 3)
        for robots in (4, 8)
        for speed in (0.5, 1.0)
        for seed in range(5 if speed == 0.5 else 4)
    ]
    frame = pd.DataFrame(rows, columns=["robots", "speed", "delivered"])
    questions = answer(judge_trials(frame), most=None).questions
    sizes = [question for question in questions if question.startswith("S ")]
    assert sizes == ["S N 4→8, speed = 0.5", "S N 4→8, speed = 1"]


def test_a_study_that_compares_policies_alone_says_p_of_each_in_its_first_table() -> None:
    small = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0}
    study = Study(
        policies=["swarm-dt", "homing"],
        seeds=2,
        scenario={**small, "n_robots": 4, "n_items": 6, "duration": 20.0, "restock": True},
        ablations=[{"title": title, "policy": "homing"} for title in ("as it is", "again")],
    )
    study.run()
    text = terminal_answer(answer(study.findings()), 80)
    assert re.search(r"at N = 4, as it is: swarm-dt [\d.]+ \[.*\], homing\s+[\d.]+ \[", text)
