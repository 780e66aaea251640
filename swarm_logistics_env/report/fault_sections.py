"""Sections on measures of faults that the paper does not define, and on the looks of a study."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial

from swarm_logistics_env import spi
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.studies.comparison import CONFIDENCE, Comparison
from swarm_logistics_env.studies.fault_measures import (
    ModeBudget,
    RepairCurve,
    Resilience,
    anchoring_loads,
    fault_budgets,
    mid_run_faults,
    rate_curves,
    resiliences,
    window_of,
)
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import grouped

from . import drawing, section
from .section import Figure, Section, slug

_LOAD_TEXT = (
    "Time that working robots spend in contact range of failed ones; in the paired "
    "run with the same robots removed it is 0. The last column is the load per "
    "failed robot and second of failure."
)
_SINGLE_TEXT = (
    "Until the first window in which a run delivers as much again as the paired run with the "
    "robots removed; those that never do are censored (Kaplan and Meier). Deliveries scatter, so "
    "what counts is the distance from the null: pairs without a fault that differ in behaviour."
)
_REPAIR_DATA = ["panel", "runs", "seconds", "share_not_back", "low", "high"]
_RATE_DATA = ["panel", "runs", "seconds", "deliveries", "low", "high"]


def fault_sections(results: StudyResults) -> Iterator[Section]:
    """Yield the fault budget, the resilience to faults in mid-run, and the anchoring load."""
    yield from _budgets(results)
    yield from _resilience(results)
    loads = list(anchoring_loads(results))
    if loads:
        yield Section.table(
            "Anchoring load",
            loads,
            [
                ("policy", lambda one: one.compared.policy),
                ("fault", lambda one: str(one.compared.changed.setting)),
                ("robot-seconds a run [95 %]", lambda one: section.bracketed(one.load, 1)),
                ("robots by a failed one [95 %]", lambda one: section.bracketed(one.neighbours, 3)),
            ],
            _LOAD_TEXT,
        )


def _budgets(results: StudyResults) -> Iterator[Section]:
    # A budget that is 0 for every mode tells nothing that R does not tell.
    budgets = list(fault_budgets(results))
    if any(one.budget is None or one.budget.robots for one in budgets):
        yield Section.table(
            "Fault budget",
            budgets,
            [
                ("policy", lambda one: one.compared.policy),
                ("failure mode", _mode),
                ("N", lambda one: str(one.compared.n_robots)),
                ("m tested", lambda one: ", ".join(map(str, one.tested))),
                ("robots that may fail", _may_fail),
            ],
            "The largest m with R > 0 supported at every m' up to it, tested in order, with "
            "unadjusted verdicts: the sequence is fixed, so the error stays below 5 %. "
            f"Over {section.seeds_text(results)}.",
        )


def _mode(one: ModeBudget) -> str:
    setting = one.compared.changed.setting
    return setting.name + (f" from {setting.onset:g} s" if setting.onset else "")


def _may_fail(one: ModeBudget) -> str:
    if one.budget is None:
        return "undefined: a run failed or is missing"
    robots, limit = one.budget
    if limit is None:
        return f"at least {robots}"
    if limit not in one.tested:
        return f"{robots} shown; m = {limit} was not tested"
    # Whether more are refuted or only unknown differs for whoever has to decide.
    return f"{robots}; m = {limit} {section.said(one.verdict)}"


def look_section(results: StudyResults) -> Section:
    """Return the looks of a study that runs until it is clear, and what stopped at each."""
    stopped = Counter(test.stopped_at for test in results.verdicts if test.stopped_at)
    alphas = spi.look_alphas(results.looks, 1 - CONFIDENCE)
    return Section.table(
        "Looks, until it is clear",
        list(zip(results.looks, alphas)),
        [
            ("seeds", lambda look: str(look[0])),
            ("p below, alone", lambda look: f"{look[1]:.4f}"),
            ("level of intervals", lambda look: section.percent(1 - look[1])),
            ("stopped here", lambda look: str(stopped[look[0]])),
        ],
        "Declared before the first run. Alpha is spent over the looks in proportion to the seeds, "
        "and Holm's procedure steps down at each look, so that a comparison stops once its verdict "
        "stands; the intervals hold over all looks together with 95 %.",
        f"{stopped.total()} of {len(results.verdicts)} comparisons stopped. P and the further "
        f"measures are over the {len(results.plan.seeds)} seeds that all conditions share.",
    )


def _resilience(results: StudyResults) -> Iterator[Section]:
    """Yield the measures of faults in mid-run, and the curves of what is delivered around them."""
    found = list(resiliences(results))
    if not found:
        return
    who: list[tuple[str, Callable[[Resilience], str]]] = [
        ("policy", lambda one: one.compared.policy),
        ("fault", lambda one: str(one.compared.changed.setting)),
    ]
    yield Section.table(
        "Resilience: deliveries after the onset",
        found,
        [
            *who,
            ("over the removed robots' [95 %]", lambda r: section.bracketed(r.against_removed, 3)),
            ("above 1", lambda one: _verdict(one.against_removed)),
            ("over the whole swarm's [95 %]", lambda one: section.bracketed(one.against_whole, 3)),
            ("above 1 - m/N", lambda one: _verdict(one.against_whole)),
        ],
        "Deliveries after the onset over those of the paired reference. Reference with the robots "
        "removed at the onset: fault tolerance local in time; whole swarm: robustness local in "
        f"time. Verdicts unadjusted; {section.seeds_text(results)}.",
    )
    figures = tuple(_rate_figures(results))
    if figures:
        yield Section("", figures=figures)
    single = [one for one in found if one.single]
    problems = [
        f"{one.compared.policy}, {one.compared.changed.setting}: no time to come back: "
        f"{one.problem}."
        for one in found
        if one.problem
    ]
    yield Section.table(
        "Time until single runs are back",
        single,
        [
            *who,
            ("median [s]", lambda one: _median(one.single[0])),
            ("not back", lambda one: _not_back(one.single[0])),
            ("null's median [s]", lambda one: _median(one.single[1])),
            ("null not back", lambda one: _not_back(one.single[1])),
        ],
        _SINGLE_TEXT,
        *problems,
    )
    repairs = tuple(_repair_figures(results, {one.compared: one.single for one in single}))
    if repairs:
        yield Section("", figures=repairs)


def _verdict(estimate: Estimate | None) -> str:
    if estimate is None:
        return "undefined"
    if estimate.identical:
        return section.UNAFFECTED
    return section.said(estimate.verdict) + section.SATURATED * ("capped" in estimate.flags)


def _median(curve: RepairCurve) -> str:
    median = curve.curve.median()
    return "not reached" if median is None else f"{median:g}"


def _not_back(curve: RepairCurve) -> str:
    return f"{curve.censored} of {curve.total} runs"


def _panels(results: StudyResults) -> list[list[Comparison]]:
    """Return the faults in mid-run that share a figure: all m of one mode and onset."""

    def place(one: Comparison) -> tuple[str, str, int, str, float]:
        setting = one.changed.setting
        return one.policy, one.table, one.n_robots, setting.name, setting.onset

    return list(grouped(mid_run_faults(results), place).values())


def _rate_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    import pandas as pd

    for compared in _panels(results):
        one, setting = compared[0], compared[0].changed.setting
        panels = {f"m = {c.changed.setting.value:g}": rate_curves(results, c) for c in compared}
        rows = [
            (title, curve.runs, *point)
            for title, curves in panels.items()
            for curve in curves
            for point in zip(*curve[1:])
        ]
        if rows:
            window = window_of(one)
            yield Figure(
                slug("deliveries", one.policy, one.table, setting.name, f"{setting.onset:g}s"),
                f"{one.policy}, {one.table}, N = {one.n_robots}: deliveries in the trailing "
                f"{window:g} s around failure mode {setting.name} from {setting.onset:g} s (dotted "
                f"line). Mean over {section.seeds_text(results)} with pointwise 95 % t-intervals.",
                pd.DataFrame(rows, columns=_RATE_DATA),
                0.6 + 2.3 * len(panels),
                partial(
                    drawing.rates,
                    panels=panels,
                    onset=setting.onset,
                    y_label=f"deliveries in {window:g} s",
                ),
            )


def _repair_figures(
    results: StudyResults, singles: dict[Comparison, tuple[RepairCurve, ...]]
) -> Iterator[Figure]:
    """Yield the curves of single runs' times to come back, a figure per failure mode."""
    import pandas as pd

    for compared in _panels(results):
        one, setting = compared[0], compared[0].changed.setting
        panels = {f"m = {c.changed.setting.value:g}": singles[c] for c in compared if c in singles}
        rows = [
            (title, curve.runs, *point)
            for title, curves in panels.items()
            for curve in curves
            for point in zip(*curve.curve)
        ]
        if rows:
            yield Figure(
                slug("self-repair", one.policy, one.table, setting.name, f"{setting.onset:g}s"),
                f"{one.policy}, {one.table}, N = {one.n_robots}: share of runs whose delivery rate "
                f"is not back yet after failure mode {setting.name} from {setting.onset:g} s, "
                "beside pairs of runs without fault that differ in behaviour seeds alone. "
                "Kaplan-Meier with pointwise 95 % intervals (Greenwood, log-log); "
                f"{section.seeds_text(results)}; a cross where runs are censored.",
                pd.DataFrame(rows, columns=_REPAIR_DATA),
                0.6 + 2.1 * len(panels),
                partial(drawing.repairs, panels=panels),
            )
