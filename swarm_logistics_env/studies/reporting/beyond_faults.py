"""Sections on faults beyond FT and R: budgets, anchoring, resilience and self-repair."""

from __future__ import annotations

import math
from collections.abc import Iterator

from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.self_repair import RECOVERED, SelfRepair
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.analysis.faulty_runs import (
    ModeBudget,
    anchoring_loads,
    fault_budgets,
)
from swarm_logistics_env.studies.analysis.resilience import (
    Resilience,
    mid_run_faults,
    rate_curves,
    resiliences,
    window_of,
)
from swarm_logistics_env.studies.comparisons import Comparison
from swarm_logistics_env.studies.judgement import Findings
from swarm_logistics_env.studies.reporting import drawing, wording
from swarm_logistics_env.studies.reporting.figures import Figure, slug
from swarm_logistics_env.studies.reporting.sections import Section


def beyond_faults(findings: Findings) -> Iterator[Section]:
    """Yield what there is to say of a study's faults beyond FT and R."""
    budgets = [_budget(budget) for budget in fault_budgets(findings)]
    if budgets:
        yield Section(
            "Fault budget",
            ("policy", "failure mode", "N", "m tested", "robots that may fail"),
            tuple(budgets),
            (
                (
                    "The largest m with R > 0 supported at every m' up to it, tested in order, "
                    "with unadjusted verdicts: the sequence is fixed, so the error stays below "
                    f"5 %. Over {wording.seeds_text(findings)}."
                ),
            ),
        )
    found = tuple(resiliences(findings))
    if found:
        yield from _resilience(findings, found)
    loads = [
        (
            load.comparison.policy,
            str(load.comparison.changed.level),
            wording.bracketed(load.load, 1),
            wording.bracketed(load.neighbours, 3),
        )
        for load in anchoring_loads(findings)
    ]
    if loads:
        yield Section(
            "Anchoring load",
            ("policy", "fault", "robot-seconds a run [95 %]", "robots by a failed one [95 %]"),
            tuple(loads),
            (
                (
                    "Time that working robots spend in contact range of failed ones; in the paired "
                    "run with the same robots removed it is 0. The last column is the load per "
                    "failed robot and second of failure."
                ),
            ),
        )


def _budget(budget: ModeBudget) -> tuple[str, ...]:
    level = budget.comparison.changed.level
    if budget.budget is None:
        answer = "blocked: runs are missing"
    elif budget.budget.limit is None:
        answer = f"at least {budget.budget.robots}"
    elif budget.budget.limit not in budget.tested:
        answer = f"{budget.budget.robots} shown; m = {budget.budget.limit} was not tested"
    else:
        answer = str(budget.budget.robots)
    return (
        budget.comparison.policy,
        level.name + (f" from {level.onset:g} s" if level.onset else ""),
        str(budget.comparison.original.condition.scenario.n_robots),
        ", ".join(map(str, budget.tested)),
        answer,
    )


def _resilience(findings: Findings, found: tuple[Resilience, ...]) -> Iterator[Section]:
    rows, repairs, problems = [], [], []
    for one in found:
        who = one.comparison.policy, str(one.comparison.changed.level)
        rows.append((*who, *_index(one.against_removed), *_index(one.against_whole)))
        if one.repair is not None:
            repairs.append((*who, *_repair(one.repair, window_of(one.comparison))))
        else:
            problems.append(f"{who[0]}, {who[1]}: no self-repair time: {one.problem}.")
    yield Section(
        "Resilience: deliveries after the onset",
        (
            "policy", "fault", "over the removed robots' [95 %]", "above 1",
            "over the whole swarm's [95 %]", "above 1 - m/N",
        ),
        tuple(rows),
        (
            ("Deliveries after the onset over those of the paired reference. Reference with the "
            "robots removed at the onset: fault tolerance local in time; whole swarm: robustness "
            f"local in time. Verdicts unadjusted; {wording.seeds_text(findings)}."),
        ),
    )  # fmt: skip
    yield Section(
        "Self-repair time",
        (
            "policy", "fault", "window [s]", "self-repair [s, 95 %]", "no-fault null [s]",
            "95 % of the null below [s]", "longest that could show [s]", "reading",
        ),
        tuple(repairs),
        (
            ("From the onset until the delivery rate, pooled over seeds in a trailing window, is "
            f"back at {100 * RECOVERED:g} % of that with the robots removed, for a whole window. "
            "The null is the same statistic of a pair without fault that differs in behaviour "
            "seeds alone: a time that does not exceed 95 % of its resamples measures noise. "
            "Intervals: bootstrap over seeds; ∞ and \"censored\": not back within the run."),
            *problems,
        ),
    )  # fmt: skip
    for figure in rate_figures(findings):
        yield Section("", figures=(figure,))


def _index(estimate: Estimate | None) -> tuple[str, str]:
    if estimate is None:
        return wording.NOTHING, "undefined"
    interval = Interval(estimate.value, estimate.low, estimate.high)
    return wording.bracketed(interval, 3), estimate.verdict


def _repair(repair: SelfRepair, window: float) -> tuple[str, ...]:
    seconds = math.inf if repair.seconds is None else repair.seconds
    null = math.inf if repair.null_seconds is None else repair.null_seconds
    if not repair.distinguishable:
        reading = "not distinguishable from no fault"
    elif repair.censored:
        reading = "censored: not back within the run"
    else:
        reading = "longer than chance makes it"
    return (
        f"{window:g}",
        wording.bracketed(Interval(seconds, repair.low, repair.high), 0),
        wording.bracketed(Interval(null, None, None), 0),
        wording.bracketed(Interval(repair.null_limit, None, None), 0),
        f"{repair.followed:g}",
        reading,
    )


def rate_figures(findings: Findings) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    groups: dict[tuple[str, str, str, float], list[Comparison]] = {}
    for comparison in mid_run_faults(findings):
        level = comparison.changed.level
        key = comparison.policy, comparison.table, level.name, level.onset
        groups.setdefault(key, []).append(comparison)
    for (policy, table, mode, onset), comparisons in groups.items():
        panels = [
            drawing.RatePanel(
                f"m = {comparison.changed.level.value:g}", rate_curves(findings, comparison)
            )
            for comparison in comparisons
        ]
        window = window_of(comparisons[0])
        rows = tuple(
            (panel.title, curve.label, second, rate.value, rate.low, rate.high)
            for panel in panels
            for curve in panel.curves
            for second, rate in zip(curve.seconds, curve.rates)
        )
        if not rows:
            continue
        swarm = comparisons[0].original.condition.scenario.n_robots
        yield Figure(
            slug("deliveries", policy, table, mode, f"{onset:g}s"),
            f"{policy}, {table}, N = {swarm}: deliveries in the trailing {window:g} s around "
            f"failure mode {mode} from {onset:g} s (dotted line). Mean over "
            f"{wording.seeds_text(findings)} with pointwise 95 % t-intervals.",
            ("panel", "runs", "seconds", "deliveries", "low", "high"),
            rows,
            0.6 + 2.3 * len(panels),
            _draw(panels, onset, f"deliveries in {window:g} s"),
        )


def _draw(panels: list[drawing.RatePanel], onset: float, y_label: str) -> drawing.Draw:
    return lambda canvas: drawing.rates(canvas, panels, onset, y_label)
