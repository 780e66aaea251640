"""Figures: what each shows, as a table and as a drawing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.questions.comparison import CONFIDENCE, Comparison
from swarm_logistics_env.spi.definitions import DEFINITIONS, Definition, FactorKind
from swarm_logistics_env.verdicts.columns import VERDICT_COLUMNS, frame
from swarm_logistics_env.verdicts.mid_run_faults import (
    RateCurve,
    mid_run_faults,
    rate_curves,
    window_of,
)
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import Verdict

from . import drawing
from .answer import Answer
from .drawing import Panel, Point
from .section import DECIDED, P_LEVEL, Figure, levels, listed, seeds_text, slug

_COLUMNS = [
    "policy", "table", "indicator", "comparison", "value", "low", "high", "confidence",
    "verdict", "verdict_holm", "published", "saturated",
]  # fmt: skip


def forest_figure(results: StudyResults, found: Answer) -> Figure:
    """Return the lines of the answer as a forest of intervals."""
    points = (
        [_point(results, test, "", test.compared.threshold) for test in line.tests]
        for line in found.lines
    )
    rows = list(zip(found.questions, points))
    tests = [test for line in found.lines for test in line.tests]
    return Figure(
        "answer",
        f"{found.asked} Every question with its interval. {_marks(tests)}.{_capped(tests)}",
        frame(tests, VERDICT_COLUMNS)[_COLUMNS],
        0.9 + 0.27 * len(rows),
        partial(drawing.forest, rows=rows),
    )


def indicator_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield S per step, FT and R per mode and m, A per value, and P without a part."""
    for (table, _, onset, swarm), tests in _by_figure(results).items():
        names = table, f"{onset:g}s" if onset else ""
        definitions = _definitions(tests)
        crosses = "; crosses: published" if any(t.published is not None for t in tests) else ""
        caption = f"{listed(list(dict.fromkeys(t.compared.policy for t in tests)))}, "
        caption += f"{_where(table, onset, swarm)}: {_caption(definitions)} "
        caption += f"{seeds_text(results).capitalize()}. {_marks(tests)}{crosses}."
        panels = [_panel(results, tests, definition) for definition in definitions]
        yield Figure(
            slug(*(definition.symbol for definition in definitions), *names),
            caption + _capped(tests),
            frame(tests, VERDICT_COLUMNS)[_COLUMNS],
            0.5 + 2.5 * len(panels),
            partial(drawing.intervals, panels=panels),
        )


def indicator_panels(results: StudyResults) -> Iterator[tuple[str, Panel]]:
    """Yield the panels of `indicator_figures`, each with what it is about."""
    for (table, _, onset, swarm), tests in _by_figure(results).items():
        for definition in _definitions(tests):
            yield _where(table, onset, swarm), _panel(results, tests, definition)


def _by_figure(results: StudyResults) -> dict[tuple[str, FactorKind, float, int], list[Verdict]]:
    """Return each value once, by table, kind, onset, and swarm size where robots fail."""

    def place(test: Verdict) -> tuple[str, FactorKind, float, int]:
        after, by_fault = test.after, test.after.kind == "fault"
        return test.compared.table, after.kind, after.onset, test.compared.n_robots * by_fault

    alike = grouped(
        results.verdicts,
        lambda test: (*test.compared.family, test.compared.table, test.compared.label),
    )
    # That against the lowest threshold shows them all.
    return grouped(
        (min(same, key=lambda t: t.compared.threshold) for same in alike.values()), place
    )


def _where(table: str, onset: float, swarm: int) -> str:
    start = f", faults from {onset:g} s" if onset else ""
    return f"{table}, N = {swarm}{start}" if swarm else table


def _panel(results: StudyResults, tests: Sequence[Verdict], definition: Definition) -> Panel:
    """Return a pair of axes for an indicator, a series a policy."""
    here = [test for test in tests if test.compared.indicator == definition.symbol]
    after, first = here[0].after, here[0].compared.policy
    points = tuple(
        # The published values stand beside the first policy.
        _point(
            results,
            test,
            _category(test),
            test.published if test.compared.policy == first else None,
        )
        for test in here
    )
    # 0 first: it is the threshold that always stands in the picture.
    asked = [test.compared.threshold for test in here]
    thresholds = dict.fromkeys([0.0, *definition.adjectives, *asked])
    x_label = f"{after.name}, x_o → x_new" if after.kind == "parameter" else X_LABELS[after.kind]
    return Panel("", definition.heading, points, tuple(thresholds), x_label, tuple(here))


X_LABELS = {
    "size": "swarm size N → N + m",
    "fault": "failure mode and number m of faulty robots",
    "policy": "in its place",
}


def _category(test: Verdict) -> str:
    before, after = test.compared.original.setting, test.after
    if after.kind == "fault":
        return f"{after.name} {after.value:g}"
    return test.compared.label if after.kind == "policy" else f"{before.value:g}→{after.value:g}"


def _point(results: StudyResults, test: Verdict, category: str, published: float | None) -> Point:
    policy = test.compared.policy
    value, low, high = test.interval or (None, None, None)
    style, decided = results.policies.index(policy), test.on_threshold.adjusted in DECIDED
    return Point(policy, style, category, value, low, high, published, decided, test.saturated)


def _marks(tests: Sequence[Verdict]) -> str:
    return (
        "Filled: the Holm-adjusted verdict is decided; hollow: it is not; bars: "
        f"{levels(tests)} intervals, without an end where they leave the axis; dashed: thresholds"
    )


def _capped(tests: Sequence[Verdict]) -> str:
    is_capped = any(test.saturated for test in tests)
    return " †: P is capped, every item was delivered in a run." * is_capped


def _definitions(tests: Sequence[Verdict]) -> list[Definition]:
    asked = {test.compared.indicator for test in tests}
    return [definition for symbol, definition in DEFINITIONS.items() if symbol in asked]


def _caption(definitions: Sequence[Definition]) -> str:
    """Return what a figure shows, e.g. "robustness R; above 0 robust."."""
    named = [named for definition in definitions for named in definition.adjectives.items()]
    above = grouped(named, lambda one: one[0]).items()
    says = ", ".join(f"above {at:g} {', '.join(word for _, word in here)}" for at, here in above)
    if not says:
        says = "(P_new - P_o) / P_o; below a threshold P falls by more than that share"
    return f"{listed([definition.heading for definition in definitions])}; {says}."


def rate_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield deliveries over time around every fault in mid-run, a figure per failure mode."""
    import pandas as pd

    def place(one: Comparison) -> tuple[str | float, ...]:
        setting = one.changed.setting
        return one.policy, one.table, one.n_robots, setting.name, setting.onset

    for compared in grouped(mid_run_faults(results), place).values():
        one, setting, window = compared[0], compared[0].changed.setting, window_of(compared[0])
        panels = {f"m = {c.changed.setting.value:g}": rate_curves(results, c) for c in compared}
        rows = [
            (title, curve.runs, *point, CONFIDENCE)
            for title, curves in panels.items()
            for curve in curves
            for point in zip(*curve[1:])
        ]
        if rows:
            yield Figure(
                slug("deliveries", one.policy, one.table, setting.name, f"{setting.onset:g}s"),
                f"{one.policy}, {one.table}, N = {one.n_robots}: deliveries in the trailing "
                f"{window:g} s around failure mode {setting.name} from {setting.onset:g} s (dotted "
                f"line). Mean over {seeds_text(results)} with pointwise {P_LEVEL} t-intervals.",
                pd.DataFrame(rows, columns=["panel", "runs", *RateCurve._fields[1:], "confidence"]),
                0.6 + 2.3 * len(panels),
                partial(
                    drawing.rates,
                    panels=panels,
                    onset=setting.onset,
                    y_label=f"deliveries in {window:g} s",
                ),
            )
