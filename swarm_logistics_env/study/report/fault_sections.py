"""Faults in mid-run: what they cost, how fast it is back, and deliveries around them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from more_itertools import map_reduce

from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.verdicts.mid_run_faults import (
    RUNS_ARE_MISSING,
    RateCurve,
    RepairCurve,
    Resilience,
    window_of,
)
from swarm_logistics_env.study.verdicts.verdict import UNAFFECTED

from . import section
from .curves import Curve, CurvePanel, curves
from .section import NOTHING, P_LEVEL, Figure, Section, Texts, slug

_SINGLE_TEXT = (
    "Until the first window in which a run delivers as much again as the paired run with the "
    "robots removed; those that never do are censored (Kaplan and Meier). Deliveries scatter, so "
    "what counts is the distance from the null: pairs without a fault that differ in behaviour."
)


def fault_sections(all_measures: Sequence[Resilience], seeds: str) -> Iterator[Section]:
    """Yield the measures of faults in mid-run, and the curves of what is delivered around them.

    Args:
        all_measures: those of every fault.
        seeds: over which they are, in words.
    """
    measures = [measure for measure in all_measures if measure.problem != RUNS_ARE_MISSING]
    if not measures:
        return
    faults = [
        (measure.compared.policy, str(measure.compared.changed.setting)) for measure in measures
    ]
    yield _resilience_table(faults, measures, seeds)
    figures = tuple(_rate_figures(all_measures, seeds))
    if figures:
        yield Section("", figures=figures)
    columns = ("policy", "fault", "median [s]", "not back", "null's median [s]", "null not back")
    rows = tuple(
        (*fault, *_back(measure.single[0]), *_back(measure.single[1]))
        for fault, measure in zip(faults, measures)
        if measure.single
    )
    problems = [
        f"{policy}, {fault}: no time to come back: {measure.problem}."
        for (policy, fault), measure in zip(faults, measures)
        if measure.problem
    ]
    yield Section("Time until single runs are back", columns, rows, (_SINGLE_TEXT, *problems))


def _resilience_table(
    faults: Sequence[tuple[str, str]], measures: Sequence[Resilience], seeds: str
) -> Section:
    indices = [
        index
        for measure in measures
        for index in (measure.against_removed, measure.against_whole)
        if index
    ]
    level = section.percent(indices[0].confidence if indices else CONFIDENCE)
    columns = (
        "policy", "fault", f"over the removed robots' [{level}]", "above 1",
        f"over the whole swarm's [{level}]", "above 1 - m/N",
    )  # fmt: skip
    rows = tuple(
        (*fault, *_index(measure.against_removed), *_index(measure.against_whole))
        for fault, measure in zip(faults, measures)
    )
    line = (
        "Deliveries after the onset over those of the paired reference. Reference with the robots "
        "removed at the onset: fault tolerance local in time; whole swarm: robustness local in "
        f"time. Verdicts unadjusted; {seeds}."
    )
    return Section("Resilience: deliveries after the onset", columns, rows, (line,))


def _index(estimate: Estimate | None) -> Texts:
    """Return an index with its interval, and its decision."""
    if estimate is None:
        return NOTHING, "undefined"
    word = UNAFFECTED if estimate.identical else estimate.verdict
    mark = section.SATURATED if "capped" in estimate.flags else ""
    return section.bracketed(estimate, 3), word + mark


def _back(curve: RepairCurve) -> Texts:
    """Return the median time until runs are back, and how many never are."""
    median = curve.curve.median()
    time = "not reached" if median is None else f"{median:g}"
    return time, f"{np.count_nonzero(~curve.back)} of {curve.back.size} runs"


def _rate_figures(measures: Sequence[Resilience], seeds: str) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    import pandas as pd

    def figure_of(measure: Resilience) -> tuple[str | float, ...]:
        comparison = measure.compared
        setting = comparison.changed.setting
        return (
            comparison.policy, comparison.table, comparison.n_robots, setting.name, setting.onset,
        )  # fmt: skip

    for of_mode in map_reduce(measures, figure_of).values():
        first = of_mode[0].compared
        setting = first.changed.setting
        window = window_of(first)
        by_number = {
            f"m = {measure.compared.changed.setting.value:g}": measure.curves for measure in of_mode
        }
        rows = [
            (number, curve.runs, *point, CONFIDENCE)
            for number, of_number in by_number.items()
            for curve in of_number
            for point in zip(*curve[1:])
        ]
        panels = [
            CurvePanel(
                f"{first.policy}, {number}",
                "end of the window [s]",
                [Curve(*curve) for curve in of_number],
            )
            for number, of_number in by_number.items()
        ]
        if rows:
            yield Figure(
                slug("deliveries", first.policy, first.table, setting.name, f"{setting.onset:g}s"),
                f"{first.policy}, {first.table}, N = {first.n_robots}: deliveries in the trailing "
                f"{window:g} s around failure mode {setting.name} from {setting.onset:g} s.",
                pd.DataFrame(rows, columns=["panel", "runs", *RateCurve._fields[1:], "confidence"]),
                0.6 + 2.3 * len(panels),
                partial(
                    curves,
                    panels=panels,
                    y_label=f"deliveries in {window:g} s",
                    onset=setting.onset,
                ),
                note=f"Mean over {seeds}; bands: pointwise {P_LEVEL} t-intervals; dotted: the "
                "fault begins.",
            )
