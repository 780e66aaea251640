"""What a reader has to know besides verdicts: P, what collapses, and what cannot be tested."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study.report.answer_notes import collapsed_in_words, untestable_in_words
from swarm_logistics_env.study.report.performances import performances
from swarm_logistics_env.study.verdicts.collapses import Collapse
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.made_up import limited


@pytest.fixture(scope="module")
def results() -> StudyResults:
    return limited()


def test_p_is_told_where_the_swarm_is_as_it_should_be(results: StudyResults) -> None:
    (p,) = performances(results).values()
    where = "N = 4, no fault"
    interval = "42.2 [39.0, 45.5]"
    assert tuple(p) == (f"P [95 %] = {interval} items in 500 s, {where}", interval, where)


def test_conditions_that_collapse_are_named_by_their_shares(results: StudyResults) -> None:
    breaks = np.array([50.0, 70.0, 130.0])
    conditions = [
        Collapse(cell, Interval(share, share - 0.05, share + 0.05), 10, times)
        for cell, share, times in zip(results.cells, (0.2, 0.4, 0.3), (breaks, breaks[:0], breaks))
    ]
    first, second, third = (f"at {collapse.cell.words} in" for collapse in conditions)
    times = "(of these 3 of 10 in mid-run, after 70 s (median))"
    words = f"{second} 40 % [35, 45], {third} 30 % [25, 35] {times}, {first} 20 % [15, 25] {times}"
    for most in (3, None):
        assert collapsed_in_words(conditions, names_policies=False, most=most) == words
    assert collapsed_in_words(conditions, names_policies=True, most=1) == (
        f"of homing {second} 40 % [35, 45] and 2 conditions more (--full)"
    )
    text = collapsed_in_words(conditions, names_policies=False, most=2)
    assert text.endswith(" and 1 condition more (--full)")


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
