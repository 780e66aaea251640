"""Figures of the indicators: what each shows, as a table and as a drawing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

from swarm_logistics_env.spi.definitions import DEFINITIONS, Definition, Factor
from swarm_logistics_env.studies.results import StudyResults, frame_of_verdicts
from swarm_logistics_env.studies.verdict import Verdict, grouped

from . import drawing
from .answer import Answer
from .drawing import Panel, Point
from .section import DECIDED, Figure, listed, seeds_text, slug

_COLUMNS = [
    "policy", "table", "indicator", "comparison", "value", "low", "high", "verdict",
    "verdict_holm", "published", "saturated",
]  # fmt: skip
_MARKS = (
    "Filled: the Holm-adjusted verdict is decided; hollow: open; bars: 95 % intervals, an arrow "
    "where a bar leaves the axis; dashed: thresholds"
)


def forest_figure(results: StudyResults, found: Answer) -> Figure:
    """Return the lines of the answer as a forest of intervals."""
    several = len(results.policies) > 1
    rows = [
        (
            f"{line.policy}: {line.question}" if several else line.question,
            [
                _point(test, results.policies.index(line.policy), "", test.compared.threshold)
                for test in line.tests
            ],
        )
        for line in found.lines
    ]
    tests = [test for line in found.lines for test in line.tests]
    return Figure(
        "answer",
        f"{found.asked} Every question with its 95 % interval. {_MARKS}.{_capped(tests)}",
        frame_of_verdicts(tests)[_COLUMNS],
        0.9 + 0.27 * len(rows),
        partial(drawing.forest, rows=rows),
    )


def indicator_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield S per step, FT and R per mode and m, A per parameter, and P without a part."""
    for table, tests in grouped(_asked(results, "size"), lambda t: t.compared.table).items():
        panels = _panels(results, tests, "swarm size N → N + m")
        title = f"{_policies(tests)}, {table}: {_caption(tests, 'per step in N')}"
        yield _interval_figure(results, (table,), title, tests, panels)
    yield from _faults(results)
    tests = _asked(results, "parameter")
    if tests:
        panels = [
            panel
            for (table, name), here in grouped(
                tests, lambda t: (t.compared.table, t.compared.changed.setting.name)
            ).items()
            for panel in _panels(results, here, f"{name}, x_o → x_new", table)
        ]
        title = f"{_policies(tests)}: {_caption(tests, 'per parameter')}"
        yield _interval_figure(results, (), title, tests, panels)
    asked = [t for t in results.verdicts if t.compared.changed.setting.kind == "policy"]
    for table, tests in grouped(asked, lambda t: t.compared.table).items():
        # 0 first: it is the threshold that always stands in the picture.
        thresholds = tuple(dict.fromkeys([0.0, *(t.compared.threshold for t in tests)]))
        title = (
            f"{_policies(tests)}, {table}: relative change of P where another policy takes its "
            "place, (P_new - P_o) / P_o; below a threshold P falls by more than that share."
        )
        panels = _panels(results, tests, "in its place", thresholds=thresholds)
        yield _interval_figure(results, (table,), title, tests, panels)


def _faults(results: StudyResults) -> Iterator[Figure]:
    def place(test: Verdict) -> tuple[str, float, int]:
        compared = test.compared
        return compared.table, compared.changed.setting.onset, compared.n_robots

    for (table, onset, swarm), tests in grouped(_asked(results, "fault"), place).items():
        start = f", faults from {onset:g} s" if onset else ""
        title = (
            f"{_policies(tests)}, {table}, N = {swarm}{start}: "
            f"{_caption(tests, 'per failure mode and number m of faulty robots')}"
        )
        several = len({test.compared.policy for test in tests}) > 1
        x_label = "failure mode and number m of faulty robots" if several else "failure mode"
        names = table, f"{onset:g}s" if onset else ""
        panels = _panels(results, tests, x_label, by_m=not several)
        yield _interval_figure(results, names, title, tests, panels)


def _category(test: Verdict) -> str:
    before, after = test.compared.original.setting, test.compared.changed.setting
    if after.kind == "fault":
        return f"{after.name} {after.value:g}"
    return test.compared.label if after.kind == "policy" else f"{before.value:g}→{after.value:g}"


def _panels(
    results: StudyResults,
    tests: Sequence[Verdict],
    x_label: str,
    title: str = "",
    thresholds: tuple[float, ...] = (),
    *,
    by_m: bool = False,
) -> list[Panel]:
    """Return a pair of axes for each indicator: a series a policy or, of one policy, an m."""
    found = []
    numbers = sorted({test.compared.changed.setting.value for test in tests})
    for definition in _definitions(tests):
        points = []
        for test in tests:
            if test.compared.indicator != definition.symbol:
                continue
            setting, policy = test.compared.changed.setting, test.compared.policy
            # The published values stand beside the first policy.
            published = test.published if policy == tests[0].compared.policy else None
            if by_m:
                style, series, category = numbers.index(setting.value), "", setting.name
                series = f"m = {setting.value:g}"
            else:
                style, series, category = results.policies.index(policy), policy, _category(test)
            points.append(_point(test, style, category, published, series))
        above = thresholds or tuple(definition.adjectives)
        found.append(Panel(title, definition.heading, tuple(points), above, x_label))
    return found


def _point(
    test: Verdict, style: int, category: str, published: float | None, series: str = ""
) -> Point:
    value, low, high = test.interval or (None, None, None)
    return Point(
        series,
        style,
        category,
        value,
        low,
        high,
        published,
        decided=test.holm in DECIDED,
        saturated=test.saturated,
    )


def _interval_figure(
    results: StudyResults,
    names: tuple[str, ...],
    caption: str,
    tests: Sequence[Verdict],
    panels: Sequence[Panel],
) -> Figure:
    """Return the figure of indicators with their intervals."""
    crosses = "; crosses: published" if any(t.published is not None for t in tests) else ""
    return Figure(
        slug(*(definition.symbol for definition in _definitions(tests)), *names),
        f"{caption} {seeds_text(results).capitalize()}. {_MARKS}{crosses}.{_capped(tests)}",
        frame_of_verdicts(tests)[_COLUMNS],
        0.5 + 2.5 * len(panels),
        partial(drawing.intervals, panels=panels),
    )


_CAPPED = " †: P is capped, every item was delivered in a run."


def _capped(tests: Sequence[Verdict]) -> str:
    return _CAPPED if any(test.saturated for test in tests) else ""


def _definitions(tests: Sequence[Verdict]) -> list[Definition]:
    asked = {test.compared.indicator for test in tests}
    return [definition for symbol, definition in DEFINITIONS.items() if symbol in asked]


def _policies(tests: Sequence[Verdict]) -> str:
    return listed(list(dict.fromkeys(test.compared.policy for test in tests)))


def _caption(tests: Sequence[Verdict], per: str) -> str:
    """Return what a figure shows, e.g. "robustness R per failure mode; above 0 robust."."""
    definitions = _definitions(tests)
    above: dict[float, list[str]] = {}
    for definition in definitions:
        for threshold, adjective in definition.adjectives.items():
            above.setdefault(threshold, []).append(adjective)
    says = ", ".join(f"above {threshold:g} {', '.join(says)}" for threshold, says in above.items())
    return f"{listed([definition.heading for definition in definitions])} {per}; {says}."


def _asked(results: StudyResults, factor: Factor) -> list[Verdict]:
    """Return each indicator of a factor once: that asked against the lowest threshold."""
    of = [t for t in results.verdicts if t.compared.changed.setting.kind == factor]

    def same(test: Verdict) -> tuple[str, str, str, str]:
        compared = test.compared
        return compared.policy, compared.table, compared.indicator, compared.label

    return [min(tests, key=lambda t: t.compared.threshold) for tests in grouped(of, same).values()]
