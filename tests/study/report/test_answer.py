"""The answer: a line a question, with value, interval and verdict, on one screen."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from typing import Any

import pandas as pd
import pytest

from swarm_logistics_env import judge as judge_trials
from swarm_logistics_env import spi
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.answer_lines import Line
from swarm_logistics_env.study.report.more_seeds import more_seeds
from swarm_logistics_env.study.report.section import limits, percent
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Decision
from tests.made_up import decided, delivered, judged, paper

pytestmark = pytest.mark.unmeasured


def test_every_question_has_a_row_with_its_numbers_and_one_word(few: StudyResults) -> None:
    lines = answer(few).lines
    assert sorted(line.number for line in lines) == [*range(len(few.verdicts))]
    for line in lines:
        verdict = line.verdict
        assert verdict is few.verdicts[line.number]
        assert verdict.interval is not None
        value, low, high = verdict.interval
        assert low is not None
        assert high is not None
        assert line.value == f"{value:.2f}" + "†" * verdict.saturated
        # One of them is 0.0004, above its threshold 0.
        assert line.interval == limits(verdict.estimate or verdict.interval, 2)
        assert line.interval == f"[{low:.2f}, {high:.2f}]" or abs(low) < 0.005
        assert line.question.startswith(verdict.compared.indicator)
    words = {line.verdict.in_words for line in lines}
    assert words <= {
        *("supported, n < 10", "refuted, n < 10", "open", "open, stalls", "open, Holm"),
        *("P within 10 %", "untestable, never < 0", "untestable, equal P"),
    }


def test_the_head_says_p_and_each_indicator_with_its_worst_value(stopped: StudyResults) -> None:
    short, still_open, performance, robustness = answer(stopped).head
    assert short.startswith(
        "In short: faulty robots cost more than their share, in 2 of 3 questions, worst at FM4 no "
        "delivery, 1 of 25: P 3"
    )
    assert still_open == "1 of 3 questions is open."
    assert performance.startswith("swarm-dt: P [95 %] = ")
    assert " items in 500 s, N = 25, no fault; 60 paired seeds (0 to 59)." in performance
    lowest = min(stopped.verdicts, key=lambda verdict: verdict.value or 0.0)
    assert lowest.estimate is not None
    assert lowest.value is not None
    comparison = lowest.compared
    cells = [
        stopped.cells_by_key[comparison.policy, comparison.table, arm] for arm in comparison.arms
    ]
    # The value follows from the P beside it: other questions play these conditions further.
    n_seeds = lowest.estimate.n_seeds
    before, after = (cell.by_seed[:n_seeds].mean() for cell in cells)
    assert n_seeds < max(cell.n_seeds for cell in cells)
    assert lowest.value == pytest.approx(after / before - (1.0 - 1 / 25))
    p = f"P {before:.3g}→{after:.3g}"
    worst = "FM4 no delivery, 1 of 25"
    assert f"; lowest at {worst}: {p} ({n_seeds} seeds), R {lowest.value:.2f} [" in robustness
    assert robustness.startswith(
        f"Robustness R: 2 refuted (FM3 no radio, 1 of 25; {worst}), 1 open; "
    )
    level = percent(lowest.level or 0.0)
    assert answer(stopped).level != level
    assert robustness.endswith(f" at {level}, refuted.")


def test_what_is_open_is_told_how_many_seeds_it_needs(stopped: StudyResults) -> None:
    needs = more_seeds(stopped)
    assert f"{needs.words}." in answer(stopped).notes
    open_ones = [v for v in stopped.verdicts if v.conclusion == "open" and v.estimate]
    assert needs.words.startswith(f"{len(open_ones)} open: ")
    of_paper = paper(seeds=12)
    for verdict in of_paper.verdicts:
        assert verdict.estimate is not None
        n_seeds = spi.seeds_against_stalls(verdict.estimate)
        if n_seeds is not None:
            # What is proposed is no less than what the sentence on the question says.
            assert n_seeds <= (more_seeds(of_paper).n_seeds or 0) or n_seeds > 200


def test_claims_are_counted_and_what_contradicts_the_paper_is_marked(few: StudyResults) -> None:
    claims = Counter(decided(test.on_claim).adjusted for test in few.verdicts if test.claim)
    # Two of them are not in the text: that P falls without taxis.
    count, supported = claims.total() - 2, claims["supported"] - 2
    last = " ".join(answer(few).notes)
    assert f"of {count} claims in the paper's text {supported} supported, " in last
    # The robots of a fleet that FM4 spares deliver all the same: the paper says they do not.
    tough = answer(paper(lambda _, at: 39.0 if at.name == "FM4" else 20.0))
    against = {line.question for line in tough.lines if line.contradicts}
    assert {"FT FM4 no delivery, 3 of 25", "R FM4 no delivery, 3 of 25"} <= against
    assert not any(line.contradicts for line in answer(few).lines)
    assert "n < 10: provisional" in last
    assert "† P is capped" in last


def test_a_row_that_is_open_beside_its_interval_says_why() -> None:
    of_twelve = answer(paper(seeds=12))
    still_open = [line.verdict for line in of_twelve.lines if line.verdict.conclusion == "open"]
    reasons = {verdict.reason for verdict in still_open} - {""}
    assert reasons == {"stalls", "Holm"}
    for verdict in still_open:
        if verdict.reason:
            assert verdict.in_words == f"open, {verdict.reason}"
            assert verdict.lies_above is not None
    terms = {note.partition(":")[0] for note in of_twelve.notes}
    assert {term for term in terms if term.startswith("open, ")} == {
        *("open, and no more", "open, stalls", "open, Holm")
    }


def test_words_for_what_is_no_plain_verdict() -> None:
    nothing = answer(paper(lambda *_: 0.0, seeds=1))
    assert {line.verdict.in_words for line in nothing.lines} == {"undefined"}
    notes = " ".join(nothing.notes)
    assert "ndefined: it delivers nothing" in notes
    assert "P is small: a longer duration tells more" in notes
    unaffected = answer(paper(unaffected=frozenset({"FM2"})))
    exact = {
        (line.verdict.in_words, line.interval)
        for line in unaffected.lines
        if line.question.startswith("R FM2")
    }
    assert exact == {("unaffected", "")}
    assert "provisional" not in " ".join(unaffected.notes)
    assert "P is small" not in " ".join(unaffected.notes)


@pytest.mark.parametrize(("adjusted", "contradicts"), [("open", False), ("refuted", True)])
def test_a_claim_is_contradicted_by_what_holm_leaves(
    few: StudyResults, adjusted: Any, contradicts: bool
) -> None:
    decision = Decision("refuted", adjusted)
    verdict = replace(few.verdicts[0], on_threshold=decision, claimed=True)
    assert Line("", "S", verdict, 0).contradicts is contradicts


def test_policies_stand_one_below_the_other_each_with_its_p(compared: StudyResults) -> None:
    text = terminal_answer(answer(compared), 80)
    assert re.search(r"^swarm-dt: P \[95 %\] = 39\.\d \[", text, re.MULTILINE)
    assert all(
        re.match(r"swarm-dt(-follow)?: ", question) for question in answer(compared).questions
    )
    assert re.search(r"^swarm-dt-follow: P \[95 %\] = 20\.\d \[", text, re.MULTILINE)


def test_one_question_at_two_values_of_a_parameter_names_them() -> None:
    rows = [
        (robots, speed, 10 * robots + seed % 3)
        for robots in (4, 8)
        for speed in (0.5, 1.0)
        for seed in range(5 if speed == 0.5 else 4)
    ]
    frame = pd.DataFrame(rows, columns=["robots", "speed", "delivered"])
    questions = answer(judge_trials(frame)).questions
    sizes = [question for question in questions if question.startswith("S ")]
    assert sizes == ["S N 4→8, speed = 0.5", "S N 4→8, speed = 1"]


def test_a_small_change_has_the_same_words_in_the_sentence_and_its_row_below_ten_seeds() -> None:
    faults = [{"modes": ["FM2", "FM3"], "robots": [1]}]
    study = Study(policies=["homing"], seeds=8, faults=faults, indicators=["R"])
    few = judged(
        study, lambda _, setting, seed: delivered(400 + (seed * 7 + int(setting.value)) % 5)
    )
    lines = answer(few).lines
    assert {line.verdict.conclusion for line in lines} == {"equivalent"}
    assert {line.verdict.in_words for line in lines} == {"P within 10 %"}
    assert answer(few).head[-1].startswith("Robustness R: 2 with P within 10 %; lowest at ")
    assert not any("open" in note for note in answer(few).notes)


def test_modes_without_a_title_are_named_alone() -> None:
    study = Study(policies=["homing"], seeds=2, faults=[{"modes": ["late"]}], indicators=["R"])
    made = answer(judged(study, lambda *_: delivered(20)))
    assert [line.question for line in made.lines] == [f"R late, {m} of 25" for m in (1, 2, 3)]
    assert any("late: has not begun to work: stands as a dead" in note for note in made.notes)
