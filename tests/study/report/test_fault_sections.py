"""Measures beyond the paper, from outcomes that are made up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from swarm_logistics_env.study.questions.comparison import NO_FAULT, OTHER_BEHAVIOUR, Setting
from swarm_logistics_env.study.report.curves import Curve, CurvePanel, curves
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.write import markdown
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.mid_run_faults import (
    Resilience,
    rate_curves,
    resiliences,
)
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from tests.made_up import delivered, judged

ONSET, END = 600.0, 2000.0
SEEDS = 8


def after_a_fault(share: float, back: float) -> StudyResults:
    """A fault that leaves a share of the deliveries, one in 2 s, until `back` [s]."""
    study = Study(
        seeds=SEEDS,
        scenario={"duration": END, "restock": True},
        faults=[{"modes": ["dead"], "robots": [3], "onsets": [ONSET]}],
    )
    kinds = {NO_FAULT: 1, OTHER_BEHAVIOUR: 2, Setting("fault", "removed", 3, ONSET): 3}

    def play(_: str, level: Setting, seed: int) -> Outcome:
        draw = np.random.default_rng([seed, kinds.get(level, 4)])
        times = np.sort(draw.uniform(0.0, END, 1000))
        if level.name == "dead":
            lost = (times > ONSET) & (times < back) & (draw.uniform(size=times.size) > share)
            times = times[~lost]
        return Outcome(times, END, anchoring_seconds=21.0 if level.name == "dead" else 0.0)

    return judged(study, play)


def only(results: StudyResults) -> Resilience:
    (resilience,) = resiliences(results)
    return resilience


def emptied(results: StudyResults, key: str) -> StudyResults:
    """Return the same study with every item delivered in the first run of a case."""
    full = replace(results.outcomes[key, 0], all_delivered=True)
    return judge(results.plan, {**results.outcomes, (key, 0): full})


def only_row(results: StudyResults, title: str) -> tuple[str, ...]:
    """The row of a table of the report, behind policy and fault."""
    (section,) = (part for part in document(results).summary if part.title == title)
    (row,) = section.rows
    assert len(row) == len(section.columns)
    assert row[:2] == ("swarm-dt", str(only(results).compared.changed.setting))
    return row[2:]


def times_back(results: StudyResults) -> tuple[str, ...]:
    return only_row(results, "Time until single runs are back")


@pytest.fixture(scope="module")
def repaired() -> StudyResults:
    return after_a_fault(0.4, back=1200.0)


def test_swarm_that_comes_back_has_a_time_and_its_null_a_shorter_one(
    repaired: StudyResults,
) -> None:
    fault, null = only(repaired).single
    assert len(fault.back) == len(null.back) == SEEDS
    median, nothing = fault.curve.median() or 0.0, null.curve.median() or 0.0
    assert nothing < 100 < 500 < median < 700
    shown, _, shown_null, _ = times_back(repaired)
    assert (shown, shown_null) == (f"{median:g}", f"{nothing:g}")


def test_swarm_that_never_comes_back_is_censored() -> None:
    results = after_a_fault(0.3, back=END)
    against = only(results).against_removed
    assert against is not None
    assert against.value == pytest.approx(0.3, abs=0.03)
    assert against.verdict == "refuted"
    assert times_back(results)[:2] == ("not reached", f"{SEEDS} of {SEEDS} runs")
    whole = only(results).against_whole
    assert whole is not None
    row = only_row(results, "Resilience: deliveries after the onset")
    assert row[0].startswith(f"{against.value:.3f} [{against.low:.3f}, ")
    assert row[2].startswith(f"{whole.value:.3f} [{whole.low:.3f}, ")
    assert row[1::2] == ("refuted", "refuted")


@pytest.mark.unmeasured
def test_no_loss_leaves_robustness_local_in_time_but_for_a_cap() -> None:
    unharmed = after_a_fault(1.0, back=END)
    (comparison,) = (c for c in unharmed.plan.comparisons if c.indicator == "FT")
    capped = emptied(unharmed, comparison.original.case.key)
    for results, verdict in ((unharmed, "supported"), (capped, "open")):
        against = only(results).against_whole
        assert against is not None
        assert against.threshold == pytest.approx(1 - 3 / 25)
        assert against.verdict == verdict
    assert "| open† |" in markdown(document(capped))


def test_a_null_that_is_missing_or_ran_out_of_items_is_none(repaired: StudyResults) -> None:
    (null,) = repaired.plan.nulls.values()
    outcomes = {where: o for where, o in repaired.outcomes.items() if where[0] != null.case.key}
    missing = judge(repaired.plan, outcomes)
    assert not only(missing).single
    assert "the runs of the no-fault null are missing" in markdown(document(missing))
    without_items = only(emptied(repaired, null.case.key))
    assert not without_items.single
    assert "the items ran out" in str(without_items.problem)


def test_deliveries_over_time_are_rates_of_the_window(repaired: StudyResults) -> None:
    (comparison,) = (c for c in repaired.plan.comparisons if c.indicator == "FT")
    rates = rate_curves(repaired, comparison)
    assert [curve.runs for curve in rates] == ["no fault", "removed", "fault"]
    # 0.5 deliveries a second, in 100 s.
    for number, second, expected in ((0, 900.0, 50), (2, 900.0, 20), (2, 1800.0, 50)):
        curve = rates[number]
        (n_deliveries,) = curve.deliveries[curve.seconds == second]
        assert n_deliveries == pytest.approx(expected, abs=6)
    # One scale holds the rates of all panels.
    canvas = Figure()
    few = [Curve(*rate) for rate in rates]
    many = [Curve(rate.runs, rate.seconds, *(10.0 * x for x in rate[2:])) for rate in rates]
    panels = [CurvePanel("few", "time [s]", few), CurvePanel("many", "time [s]", many)]
    curves(canvas, panels, "deliveries", onset=ONSET)
    for axes in canvas.axes:
        assert axes.get_ylim()[1] >= max(curve.high.max() for curve in many)


def test_the_figure_of_deliveries_has_a_panel_for_each_number_of_robots(
    repaired: StudyResults,
) -> None:
    (figure,) = (f for f in document(repaired).figures if f.name.startswith("deliveries"))
    assert figure.name == "deliveries-swarm-dt-Fault-tolerance-and-robustness-dead-600s"
    assert figure.caption == (
        "swarm-dt, Fault tolerance and robustness, N = 25: deliveries in the trailing 100 s around "
        "failure mode dead from 600 s."
    )
    assert figure.note == (
        "Mean over 8 paired seeds (0 to 7); bands: pointwise 95 % t-intervals; dotted: the fault "
        "begins."
    )
    columns = ["panel", "runs", "seconds", "deliveries", "low", "high", "confidence"]
    assert [*figure.data.columns] == columns
    rates = only(repaired).curves
    assert [*figure.data.iloc[0]] == [
        "m = 3",
        "no fault",
        *(part[0] for part in rates[0][1:]),
        0.95,
    ]
    assert len(figure.data) == sum(len(rate.seconds) for rate in rates)
    assert figure.height == pytest.approx(2.9)
    canvas = Figure()
    figure.draw(canvas)
    (axes,) = canvas.axes
    assert (axes.get_title(), axes.get_xlabel()) == ("swarm-dt, m = 3", "end of the window [s]")
    assert axes.get_ylabel() == "deliveries in 100 s"
    assert np.unique(axes.lines[-1].get_xdata()).tolist() == [ONSET]


def test_figures_have_files_and_numbers_of_their_own() -> None:
    sizes = [{"title": title, "values": [5, 10]} for title in ("My sizes", "my-sizes", "MY_sizes")]
    study = Study(seeds=4, sizes=sizes, ablations=[{"policy": "random-walk", "fall": 0.25}])
    results = judged(
        study, lambda _, at, s: delivered((20 if at.name == "random-walk" else 40) + s)
    )
    *first_figures, last = document(results).figures
    names = ["answer", "S-My-sizes", "S-my-sizes-2", "S-MY-sizes-3"]
    assert [figure.name for figure in first_figures] == names
    assert last.data["value"].tolist() == pytest.approx([21.5 / 41.5 - 1])
