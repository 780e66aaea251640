"""Conditions of two phases: which share of their runs collapsed, and when."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binomtest

from swarm_logistics_env import judge
from swarm_logistics_env.spi import Interval, Phases
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.answer_notes import collapsed_in_words
from swarm_logistics_env.study.report.tables import critical_size_in_words, further_tables
from swarm_logistics_env.study.verdicts.collapses import Edge, collapses, edges

WITHOUT_INTERVAL = (
    "Half of the runs collapse at about N = 8, without interval: the sizes do not show both that "
    "few and that nearly all runs collapse"
)


def test_runs_that_break_off_are_told_from_those_that_never_began() -> None:
    """20 runs of 500 s with a delivery in 5 s; of seven more three stop at 100 s, four are slow.

    Two of these stop, too, so that their rate changes, but it never was that of the 20.
    """
    rng = np.random.default_rng(0)
    rows = []
    for run, (rate, end) in enumerate(
        [(0.2, 500.0)] * 20 + [(0.2, 100.0)] * 3 + [(0.04, 500.0)] * 2 + [(0.05, 180.0)] * 2
    ):
        for robots in (4, 8):
            times = np.sort(rng.uniform(0.0, end, rng.poisson(rate * end)))
            rows += [(robots, run, time, 500.0) for time in times]
    frame = pd.DataFrame(rows, columns=["robots", "run", "time", "duration"])
    conditions = judge(frame).collapses
    assert [collapse.cell.words for collapse in conditions] == ["N = 4", "N = 8"]
    for collapse in conditions:
        assert collapse.n_collapsed == 7
        np.testing.assert_allclose(collapse.breaks, 100.0, atol=20.0)
    words = collapsed_in_words(conditions, names_policies=False)
    assert "26 % [11, 46] (of these 3 of 7 in mid-run, after 9" in words


def test_a_run_breaks_off_at_its_last_delivery_if_it_was_as_fast_as_others() -> None:
    """Runs deliver in steps [s] from the first time on; two stop, two are slow, one is late."""
    steady = [np.arange(5.0, 500.0, 500.0 / (95 + run)) for run in range(20)]
    stopping = [np.arange(4.0, 101.0, 4.0), np.arange(4.0, 61.0, 4.0)]
    slow = [np.arange(10.0, 500.0, 25.0), np.arange(20.0, 181.0, 20.0)]
    late = [np.arange(402.0, 500.0, 4.0)]
    rows = [
        (robots, run, time, 500.0)
        for run, times in enumerate([*steady, *stopping, *slow, *late])
        for robots in (4, 8)
        for time in times
    ]
    frame = pd.DataFrame(rows, columns=["robots", "run", "time", "duration"])
    for collapse in judge(frame).collapses:
        assert (collapse.n_collapsed, collapse.share.value) == (5, 0.2)
        assert collapse.breaks.tolist() == [60.0, 100.0]
        words = collapsed_in_words([collapse], names_policies=False)
        assert words.endswith(" in 20 % [7, 41] (of these 2 of 5 in mid-run, after 80 s (median))")


@pytest.mark.parametrize(
    ("p_values", "n_named"), [((0.03, 0.04), 0), ((0.06, 0.02), 1), ((0.04, 0.02), 2)]
)
def test_conditions_are_named_by_holm(
    monkeypatch: pytest.MonkeyPatch, p_values: tuple[float, float], n_named: int
) -> None:
    frame = pd.DataFrame({"robots": [4, 8] * 25, "delivered": np.repeat(np.arange(25), 2)})
    cells = judge(frame).cells
    for cell, p_value in zip(cells, p_values):
        monkeypatch.setitem(vars(cell), "phases", Phases(p_value, 5.0))
    assert len(collapses(cells)) == n_named


def test_without_times_nothing_is_said_of_mid_run() -> None:
    p = np.repeat([*range(90, 110), 3, 4, 5, 6, 7], 2)
    frame = pd.DataFrame({"robots": [4, 8] * 25, "delivered": p})
    collapse, _ = judge(frame).collapses
    assert len(collapse.breaks) == 0
    assert "mid-run" not in collapsed_in_words([collapse], names_policies=False)


def test_collapses_name_their_policies_where_there_are_several() -> None:
    p = np.repeat([*range(90, 110), 3, 4, 5, 6, 7], 2)
    frame = pd.DataFrame({"robots": [4, 8] * 25, "delivered": p})
    assert "Runs collapse at N = 4 in 20 % [7, 41]" in " ".join(answer(judge(frame)).notes)
    policies = pd.concat([frame.assign(policy=name) for name in ("A", "B")])
    assert "uns collapse of A at N = 4 in 20 % [7, 41]" in " ".join(answer(judge(policies)).notes)


def test_shares_of_collapsed_runs_have_exact_intervals_by_size() -> None:
    good = [*range(90, 110)]
    bad = [3, 4, 5, 6, 7] * 4
    p = good + good[:10] + bad[:10] + bad
    frame = pd.DataFrame({"robots": np.repeat([4, 8, 16], 20), "P": p})
    (edge,) = edges(judge(frame).cells)
    for share, count in zip(edge.shares, (0, 10, 20), strict=True):
        interval = binomtest(count, 20).proportion_ci(method="exact")
        assert (share.low, share.high) == pytest.approx((interval.low, interval.high))
        assert share.value == count / 20
    assert [runs.tolist() for runs in edge.good_runs] == [good, good[:10], []]
    assert edge.size.value == pytest.approx(8.0)
    (edge_of_two,) = edges(judge(frame[frame.robots < 16]).cells)
    assert edge_of_two.shares == edge.shares[:2]
    # S of 5 robots and of 99.5 items beside a part of these, and beside none of them.
    assert [*edge.scalabilities(edge.good_runs)] == [None, 94.5 / 99.5 - 1.0, None]
    all_runs = [cell.by_seed for cell in edge.cells]
    assert [*edge.scalabilities(all_runs)] == [None, 49.75 / 99.5 - 1.0, 5.0 / 49.75 - 1.0]
    assert [*edge.scalabilities([np.zeros(2), np.ones(2), 4.0 * np.ones(2)])] == [None, None, 3.0]


def test_the_critical_size_is_said_with_its_interval() -> None:
    good = [*range(90, 120)]
    bad = [3, 4, 5, 6, 7] * 6
    p = good * 2 + good[:15] + bad[:15] + bad * 2
    frame = pd.DataFrame({"robots": np.repeat([10, 14, 20, 28, 40], 30), "P": p})
    results = judge(frame)
    (edge,) = edges(results.cells)
    assert critical_size_in_words(edge) == "Half of the runs collapse at N = 20 [17, 23]"
    (table,) = (t for t in further_tables(results) if "near the edge" in t.title)
    assert table.title == "data frame: how near the edge, Scalability"
    assert table.columns == (
        "N", "runs collapsed, 95 %", "S of all runs", "S of the runs that did not",
    )  # fmt: skip
    assert [" | ".join(row) for row in table.rows] == [
        "N = 10 | 0 % [0, 12] | – | –",
        "N = 14 | 0 % [0, 12] | 0.000 | 0.000",
        "N = 20 | 50 % [31, 69] | -1.195 | -0.167",
        "N = 28 | 100 % [88, 100] | -2.255 | –",
        "N = 40 | 100 % [88, 100] | 0.000 | –",
    ]
    (line,) = table.lines
    assert line == (
        f"{critical_size_in_words(edge)} (logistic in log N, quasi-likelihood). Two phases are "
        "named where a test with 5 % of error over the sizes says so; the other sizes are told by "
        "the one that shows them most clearly."
    )


@pytest.mark.parametrize(
    ("size", "words"),
    [
        (Interval(9.0, 0.0, math.inf), "Less than half of the runs collapse up to N = 8"),
        (Interval(8.0, 5.5, 9.5), "Half of the runs collapse at N = 8 [6, 10]"),
        (Interval(8.0, 0.0, 9.0), "Half of the runs collapse at N = 8 [0, 9]"),
        (Interval(7.6, 0.0, math.inf), WITHOUT_INTERVAL),
    ],
)
def test_no_critical_size_is_told_beyond_the_largest(size: Interval, words: str) -> None:
    frame = pd.DataFrame({"robots": [4, 8] * 5, "P": range(10)})
    cells = judge(frame).cells
    assert critical_size_in_words(Edge(cells, (), (), size)) == words


def test_counts_too_small_for_phases_are_untestable_in_answer_and_table() -> None:
    p = [0] * 24 + [1] * 11 + [2] * 5
    frame = pd.DataFrame({"robots": [4, 8] * 20, "delivered": p})
    results = judge(frame)
    reason = "counts are too small: fewer than 5 steps from least to most"
    words = f"hether runs collapsed cannot be tested: N = 4 and 1 condition more ({reason})"
    assert words in " ".join(answer(results).notes)
    assert {*results.cell_table["phases_untestable"]} == {reason}
    assert results.collapses == ()
