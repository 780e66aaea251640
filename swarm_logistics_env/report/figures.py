"""Figures of the indicators and of P against N: what each shows, as a table and as a drawing."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from swarm_logistics_env.spi.definitions import DEFINITIONS, Definition, Factor
from swarm_logistics_env.studies.performance_table import groups_of
from swarm_logistics_env.studies.results import StudyResults

from . import drawing
from .drawing import Panel
from .wording import DECIDED, listed, percent, seeds_text

if TYPE_CHECKING:
    import pandas as pd


@dataclass
class Figure:
    """One figure.

    Attributes:
        name: of its files, without ending; letters, digits and hyphens.
        caption: what it shows and under which conditions, in full.
        data: what it shows, one row a point.
        height: of the drawing [inch]; the width is that of all figures.
        draw: draws it on an empty canvas.
    """

    name: str
    caption: str
    data: pd.DataFrame
    height: float
    draw: drawing.Draw


def indicator_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield S per step, FT and R per mode and m, A per parameter, and P without a part."""
    for table, tests in groups_of(_asked(results, "size"), "table"):
        panels = _panels(_by_policy(tests, _steps(tests)), "swarm size N → N + m")
        title = f"{_policies(tests)}, {table}: {_caption(tests, 'per step in N')}"
        yield _interval_figure(results, (table,), title, tests, panels)
    yield from _faults(results)
    tests = _asked(results, "parameter")
    if not tests.empty:
        panels = [
            panel
            for (table, name), here in groups_of(tests, "table", "factor")
            for panel in _panels(_by_policy(here, _steps(here)), f"{name}, x_o → x_new", table)
        ]
        title = f"{_policies(tests)}: {_caption(tests, 'per parameter')}"
        yield _interval_figure(results, (), title, tests, panels)
    yield from _ablations(results)


def _faults(results: StudyResults) -> Iterator[Figure]:
    for (table, onset, swarm), tests in groups_of(
        _asked(results, "fault"), "table", "onset", "n_robots"
    ):
        start = f", faults from {onset:g} s" if onset else ""
        numbers = tests["after"].map("{:g}".format)
        x_label = "failure mode and number m of faulty robots"
        if len(tests["policy"].unique()) > 1:
            points = _by_policy(tests, tests["factor"] + " " + numbers)
        else:
            points = tests.assign(series="m = " + numbers, category=tests["factor"])
            x_label = "failure mode"
        title = (
            f"{_policies(tests)}, {table}, N = {swarm}{start}: "
            f"{_caption(tests, 'per failure mode and number m of faulty robots')}"
        )
        names = table, f"{onset:g}s" if onset else ""
        yield _interval_figure(results, names, title, tests, _panels(points, x_label))


def _ablations(results: StudyResults) -> Iterator[Figure]:
    asked = results.indicators[results.indicators["kind"] == "policy"]
    for table, tests in groups_of(asked, "table"):
        # 0 first: it is the threshold that always stands in the picture.
        thresholds = tuple(dict.fromkeys([0.0, *tests["threshold"]]))
        points = _by_policy(tests, tests["comparison"])
        title = (
            f"{_policies(tests)}, {table}: relative change of P where another policy takes its "
            "place, (P_new - P_o) / P_o; below a threshold P falls by more than that share."
        )
        panels = _panels(points, "in its place", thresholds=thresholds)
        yield _interval_figure(results, (table,), title, tests, panels)


def _by_policy(tests: pd.DataFrame, categories: pd.Series[str]) -> pd.DataFrame:
    """Return points of one series a policy; the published values stand beside the first."""
    first = tests["policy"] == tests["policy"].iloc[0]
    return tests.assign(
        series=tests["policy"], category=categories, published=tests["published"].where(first)
    )


def _steps(tests: pd.DataFrame) -> pd.Series[str]:
    return tests["before"].map("{:g}→".format) + tests["after"].map("{:g}".format)


def _panels(
    points: pd.DataFrame, x_label: str, title: str = "", thresholds: tuple[float, ...] = ()
) -> list[Panel]:
    """Return a pair of axes for each indicator."""
    decided = points["verdict_holm"].isin(DECIDED)
    points = points.assign(decided=decided, style=points["series"].factorize()[0])
    return [
        Panel(
            title,
            definition.heading,
            points[points["indicator"] == definition.symbol],
            thresholds or tuple(definition.adjectives),
            x_label,
        )
        for definition in _definitions(points)
    ]


def _interval_figure(
    results: StudyResults,
    names: tuple[str, ...],
    caption: str,
    tests: pd.DataFrame,
    panels: Sequence[Panel],
) -> Figure:
    """Return the figure of indicators with their intervals."""
    columns = [
        "policy", "table", "indicator", "comparison", "value", "low", "high",
        "verdict", "verdict_holm", "published", "saturated",
    ]  # fmt: skip
    crosses = "; crosses: published" if tests["published"].notna().any() else ""
    marks = (
        "Filled: the Holm-adjusted verdict is decided; hollow: inconclusive; bars: "
        f"{percent(results.confidence)} intervals, an arrow where a bar leaves the axis; dashed: "
        f"thresholds{crosses}."
    )
    return Figure(
        slug(*(definition.symbol for definition in _definitions(tests)), *names),
        f"{caption} {seeds_text(results).capitalize()}. {marks}{_saturation(tests)}",
        tests[columns],
        0.5 + 2.5 * len(panels),
        partial(drawing.intervals, panels=panels),
    )


def size_figures(results: StudyResults) -> Iterator[Figure]:
    """Yield P against swarm size N, a figure for every policy and table of sizes."""
    p = results.performance
    for (policy, table), cells in groups_of(p[p["kind"] == "size"], "policy", "table"):
        known = cells.sort_values("value").dropna(subset="mean")
        if not known.empty:
            yield Figure(
                slug("P-N", policy, table),
                f"{policy}, {table}: P against swarm size N (mean of {seeds_text(results)}, bars: "
                f"95 % t-intervals).{_saturation(known)}",
                known[["value", "mean", "low", "high"]],
                3.6,
                partial(drawing.sizes, cells=known),
            )


def _saturation(rows: pd.DataFrame) -> str:
    capped = rows["saturated"].any()
    return " †: P is capped, every item was delivered in a run." if capped else ""


def _definitions(tests: pd.DataFrame) -> list[Definition]:
    asked = set(tests["indicator"])
    return [definition for symbol, definition in DEFINITIONS.items() if symbol in asked]


def _policies(tests: pd.DataFrame) -> str:
    return listed(list(tests["policy"].unique()))


def _caption(tests: pd.DataFrame, per: str) -> str:
    """Return what a figure shows, e.g. "robustness R per failure mode; above 0 robust."."""
    definitions = _definitions(tests)
    above: dict[float, list[str]] = {}
    for definition in definitions:
        for threshold, adjective in definition.adjectives.items():
            above.setdefault(threshold, []).append(adjective)
    says = ", ".join(f"above {threshold:g} {', '.join(says)}" for threshold, says in above.items())
    return f"{listed([definition.heading for definition in definitions])} {per}; {says}."


def _asked(results: StudyResults, factor: Factor) -> pd.DataFrame:
    """Return each indicator of a factor once: that asked against the lowest threshold."""
    tests = results.indicators
    once = ["policy", "table", "indicator", "comparison"]
    lowest = tests.groupby(once)["threshold"].transform("min") == tests["threshold"]
    return tests[(tests["kind"] == factor) & lowest].drop_duplicates(once)


def slug(*parts: object) -> str:
    """Return a name for files of letters, digits and hyphens, at most 80."""
    return re.sub(r"[^A-Za-z0-9]+", "-", " ".join(map(str, parts))).strip("-")[:80]
