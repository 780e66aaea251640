"""What a reader has to know besides verdicts: warnings, notes, and sentences on what is limited."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.answer_notes import (
    collapsed_in_words,
    untestable_in_words,
    warnings,
)
from swarm_logistics_env.study.report.performances import performances
from swarm_logistics_env.study.report.sentences import sentence
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.collapses import Collapse
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.made_up import delivered, judged

CAPPED = (
    "† marks a P that is capped, because every item was delivered in at least one run, and the "
    "indicators that rest on it. A verdict that a larger P could turn is open."
)
INCOMPLETE = [
    "homing, Fault tolerance and robustness, FM4, m = 1 is incomplete: 1 of 4 runs failed.",
    "homing, R, FM4, m = 1 is undefined: FM4, m = 1: 1 of 4 runs failed.",
]
OTHER_SEEDS = (
    "The verdicts are exploratory: they are over other seeds or another P than the study declared "
    "before its first run, so they err more often than their level."
)
OTHER_MARGIN = (
    "The verdicts on the margin of equivalence are exploratory: another margin was declared before "
    "the first run."
)


@pytest.fixture(scope="module")
def results() -> StudyResults:
    """A failed run under FM4; under FM1 every item is delivered once."""
    fault = {"modes": ["FM1", "FM4"], "robots": [1]}
    study = Study(
        policies=["homing"], seeds=4, scenario={"n_robots": 4}, faults=[fault], indicators=["R"]
    )

    def play(_: str, setting: Setting, seed: int) -> Outcome:
        if (setting.name, seed) == ("FM4", 1):
            return Outcome(error="Traceback")
        is_full = (setting.name, seed) == ("FM1", 0)
        count = 40 + seed**2 % 5 + 3 * (setting.name == "FM1")
        return delivered(count, digest=f"{setting} {seed}", all_delivered=is_full)

    return judged(study, play)


def flagged(results: StudyResults) -> StudyResults:
    return replace(results, exploratory=True, late_margin=True, damage="3 rows are damaged")


def test_warnings_say_what_limits_a_study_each_in_a_sentence(results: StudyResults) -> None:
    assert [*warnings(results)] == [CAPPED, *INCOMPLETE]
    assert [*warnings(flagged(results))] == [
        *("3 rows are damaged.", CAPPED, OTHER_SEEDS, OTHER_MARGIN, *INCOMPLETE)
    ]


def test_notes_say_the_same_in_short(results: StudyResults) -> None:
    meaning, method, limited, modes = answer(results).notes
    assert meaning == (
        "R = P with m of N faulty / P of all sound - (1 - m/N); 0: P falls by the share m/N, m/N: "
        "not at all."
    )
    assert method == (
        "Verdicts are by Holm's method over all questions on an indicator of one policy."
    )
    undefined = (
        "Undefined: other questions on the indicator lack runs, FM4, m = 1: 1 of 4 runs failed; "
    )
    capped = "† P is capped: --clearing or --restock has no cap."
    assert limited == f"{undefined}{capped}"
    assert modes == (
        "A faulty robot: FM1: always tells timer 0, as if it were in the delivery area, so that "
        "others follow it; FM4: delivers nothing when it enters the delivery area."
    )
    assert answer(flagged(results)).notes[2] == (
        f"{undefined}3 rows are damaged; exploratory: other seeds or P than were declared, whose "
        f"report this replaces; equivalence is exploratory: another margin was declared; {capped}"
    )


def test_sentences_say_what_is_known_of_each_verdict(results: StudyResults) -> None:
    first, second = (sentence(results, verdict) for verdict in results.verdicts)
    assert (first.head, first.conclusion, first.word) == (
        "homing, robust? FM1, m = 1, N = 4.", "undefined", "undefined",
    )  # fmt: skip
    assert first.text == (
        "R† = 0.321, 95 % interval [0.316, 0.327] over 4 paired seeds (0 to 3). Alone: supported, "
        "p < 0.001; by Holm's method: undefined. P_F within 10 % of P_o? Change 0.071: open "
        "(undefined under Holm). The verdict is provisional, because fewer than ten seeds show too "
        "little of how they scatter."
    )
    assert second.text == "Undefined: FM4, m = 1: 1 of 4 runs failed."
    exploratory = sentence(flagged(results), results.verdicts[0]).text
    assert exploratory == f"{first.text} Exploratory."


def test_p_is_told_where_the_swarm_is_as_it_should_be(results: StudyResults) -> None:
    (p,) = performances(results).values()
    where = "N = 4, no fault"
    interval = "42.2 [39.0, 45.5]"
    assert tuple(p) == (f"P [95 %] = {interval} items in 500 s, {where}", interval, where)


def test_conditions_that_collapse_are_named_by_their_shares(results: StudyResults) -> None:
    breaks = np.array([50.0, 70.0, 130.0])
    named = [
        Collapse(cell, Interval(share, share - 0.05, share + 0.05), 10, times)
        for cell, share, times in zip(results.cells, (0.2, 0.4, 0.3), (breaks, breaks[:0], breaks))
    ]
    first, second, third = (f"at {collapse.cell.words} in" for collapse in named)
    times = "(of these 3 of 10 in mid-run, after 70 s (median))"
    words = f"{second} 40 % [35, 45], {third} 30 % [25, 35] {times}, {first} 20 % [15, 25] {times}"
    for most in (3, None):
        assert collapsed_in_words(named, names_policies=False, most=most) == words
    assert collapsed_in_words(named, names_policies=True, most=1) == (
        f"of homing {second} 40 % [35, 45] and 2 conditions more (--full)"
    )
    most_of_them = collapsed_in_words(named, names_policies=False, most=2)
    assert most_of_them.endswith(" and 1 condition more (--full)")


def test_conditions_that_cannot_be_tested_are_counted_by_the_reason(results: StudyResults) -> None:
    cells = results.cells
    words = [cell.words for cell in cells]
    by_reason = {"few": cells[:1], "small": cells[1:3], "capped": cells[:3]}
    assert untestable_in_words(by_reason, names_policies=False) == (
        f"{words[0]} (few), {words[1]} and 1 condition more (small), "
        f"{words[0]} and 2 conditions more (capped)"
    )
    assert untestable_in_words({"few": cells[:1]}, names_policies=True) == (
        f"of homing at {words[0]} (few)"
    )
