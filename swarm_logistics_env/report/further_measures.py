"""Sections on measures that the paper does not define, and on declared looks."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_logistics_env import spi
from swarm_logistics_env.report import wording
from swarm_logistics_env.report.resilience_sections import beyond_resilience
from swarm_logistics_env.report.result_tables import Section
from swarm_logistics_env.spi.scaling import ScalingFit
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.fault_runs import (
    ModeBudget,
    anchoring_loads,
    fault_budgets,
)
from swarm_logistics_env.studies.results import CONFIDENCE, StudyResults
from swarm_logistics_env.studies.size_series import SizeSeries, steps

_WORTH = (
    "Marginal gain: P(N2) - (N2/N1) P(N1), in items; above 0 where S > 1. Karp-Flatt e: the share "
    "of the work that is not shared; 0 where P grows as N does, 1 where it does not grow, below 0 "
    "where it grows faster."
)


def beyond(results: StudyResults, series: tuple[SizeSeries, ...]) -> Iterator[Section]:
    """Yield the second table of a report, topic by topic."""
    if series:
        yield _laws(series)
        yield from _sizes(results, series)


def _laws(series: tuple[SizeSeries, ...]) -> Section:
    rows, lines = [], []
    for one in series:
        who = f"{one.policy or 'published runs'}: {one.table}"
        rows += [(who, *_law(fit)) for fit in one.fits]
        if one.problem:
            lines.append(f"{who}: no law is fitted: {one.problem}.")
    return Section(
        "Scaling laws",
        ("P(N) of", "weights", "law", "parameters", "N* [95 %]", "AICc"),
        tuple(rows),
        (
            (
                "USL: P = gN / (1 + a(N-1) + bN(N-1)), N* = sqrt((1-a)/b). The other: "
                "P = kN^p exp(-qN), N* = p/q. Fitted to mean P by least squares with the weights "
                "given; the better law by AICc stands first. N* is the size of the largest P; it "
                "moves with the weights, so it is quoted with its interval and its weights."
            ),
            *lines,
        ),
    )


def _law(fit: ScalingFit) -> tuple[str, ...]:
    law = {"usl": "USL", "power_exponential": "kN^p exp(-qN)"}[fit.law]
    parameters = ", ".join(f"{name} = {value:.3g}" for name, value in fit.parameters.items())
    if fit.peak is None:
        peak = "none: the fitted law has no peak"
    else:
        peak = wording.bracketed(Interval(fit.peak, fit.peak_low, fit.peak_high), 1)
    aicc = wording.NOTHING if fit.aicc is None else f"{fit.aicc:.1f}"
    return fit.weighting, law, parameters, peak, aicc


def _sizes(results: StudyResults, series: tuple[SizeSeries, ...]) -> Iterator[Section]:
    for one in series:
        if one.policy is None:
            continue
        rows = [
            (
                f"{step.before} → {step.after}" + (wording.SATURATED if step.saturated else ""),
                wording.bracketed(step.efficiency, 3),
                wording.bracketed(step.marginal_gain, 1),
                wording.bracketed(step.karp_flatt, 3),
            )
            for step in steps(results, one.policy, one.table)
        ]
        if rows:
            yield Section(
                f"{one.policy}: {one.table}, what robots are worth",
                (
                    "N",
                    "P/N at the larger N [95 %]",
                    "marginal gain [95 %]",
                    "Karp-Flatt e [95 %]",
                ),
                tuple(rows),
                (_WORTH,),
            )


def beyond_faults(results: StudyResults) -> Iterator[Section]:
    """Yield what there is to say of a study's faults beyond FT and R."""
    budgets = [_budget(budget) for budget in fault_budgets(results)]
    if budgets:
        yield Section(
            "Fault budget",
            ("policy", "failure mode", "N", "m tested", "robots that may fail"),
            tuple(budgets),
            (
                (
                    "The largest m with R > 0 supported at every m' up to it, tested in order, "
                    "with unadjusted verdicts: the sequence is fixed, so the error stays below "
                    f"5 %. Over {wording.seeds_text(results)}."
                ),
            ),
        )
    yield from beyond_resilience(results)
    loads = [
        (
            load.comparison.policy,
            str(load.comparison.changed.setting),
            wording.bracketed(load.load, 1),
            wording.bracketed(load.neighbours, 3),
        )
        for load in anchoring_loads(results)
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
    setting = budget.comparison.changed.setting
    if budget.budget is None:
        answer = "blocked: runs are missing"
    elif budget.budget.limit is None:
        answer = f"at least {budget.budget.robots}"
    elif budget.budget.limit not in budget.tested:
        answer = f"{budget.budget.robots} shown; m = {budget.budget.limit} was not tested"
    else:
        # That more may fail is either refuted, or not known: not the same to who has to decide.
        answer = f"{budget.budget.robots}; m = {budget.budget.limit} {budget.verdict}"
    return (
        budget.comparison.policy,
        setting.name + (f" from {setting.onset:g} s" if setting.onset else ""),
        str(budget.comparison.original.condition.size),
        ", ".join(map(str, budget.tested)),
        answer,
    )


def checks(results: StudyResults) -> Iterator[Section]:
    """Yield the declared looks, where there are any."""
    if results.looks:
        yield _looks(results)


def _looks(results: StudyResults) -> Section:
    n_seeds = len(results.plan.seeds)
    rows = []
    for number, (look, alpha) in enumerate(
        zip(results.looks, spi.look_alphas(results.looks, 1 - CONFIDENCE)), start=1
    ):
        when = "past" if look < n_seeds else "to come" if look > n_seeds else "this report"
        rows.append(
            (
                f"{number} of {len(results.looks)}",
                str(look),
                "< 0.0001" if alpha < 0.0001 else f"{alpha:.4f}",
                wording.percent(1 - alpha),
                when,
            )
        )
    lines = [
        (
            "Declared before the first run. O'Brien-Fleming spending (Lan and DeMets) keeps the "
            "error over all looks at 5 %: a verdict at a look needs p below its level, and its "
            "interval has the level beside it."
        )
    ]
    if results.exploratory:
        lines.append(
            f"No look was declared at {wording.seeds_text(results)}: every verdict is exploratory."
        )
    return Section(
        "Declared looks",
        ("look", "seeds", "p below", "level of intervals", "when"),
        tuple(rows),
        tuple(lines),
    )
