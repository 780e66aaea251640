"""The report as an HTML page: drawings to choose from, and what a click shows."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from importlib.resources import files
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from more_itertools import map_reduce
from numpy.typing import ArrayLike
from pydantic import JsonValue

from swarm_logistics_env.spi import Interval
from swarm_logistics_env.study.questions.comparison import Arm, Comparison
from swarm_logistics_env.study.tasks.task import Outcome
from swarm_logistics_env.study.tasks.task_world import world_of
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults

from . import drawing
from .answer import name_of_p
from .digest import values_unbroken
from .document import Document
from .drawing import Panel, Point
from .figures import X_LABELS
from .inline_svg import inline
from .page_forest import forest
from .section import P_LEVEL, Figure, Sentence, bracketed, digits_of, percent, width_of

if TYPE_CHECKING:
    from markupsafe import Markup

Json: TypeAlias = dict[str, JsonValue]
# P seed by seed of every condition, by the key of its case; None: a run failed, or is missing.
Runs: TypeAlias = Mapping[str, Sequence[float | None]]
# Name, drawing, what it shows, and what its marks mean.
Chart: TypeAlias = tuple[str, str, Sequence[Panel], tuple[str, ...]]
_HEIGHT = 2.9  # inch, of a drawing of P
_MOST_DOTS = 20_000  # runs that a page draws, the first of each condition
_MOST_TIMES = 150_000  # deliveries in the curves of a page: about 400 kB
# Of decisions, on light and on dark paper, after Okabe and Ito.
_COLOURS = {
    "supported": ("#006b4c", "#3fc79a"),
    "refuted": ("#a84300", "#f5915a"),
    "equivalent": ("#005b94", "#6cb8ee"),
    "open": ("#5b6068", "#a9afb8"),
    "unaffected": ("#5b6068", "#a9afb8"),
    "untestable": ("#5b6068", "#a9afb8"),
    "undefined": ("#a84300", "#f5915a"),
}


class View(NamedTuple):
    """A drawing that the page's reader may choose to see.

    Attributes:
        name: what it shows.
        svg: the drawing, as a part of the page.
        legend: what its marks mean.
    """

    name: str
    svg: str
    legend: tuple[str, ...]


def html(results: StudyResults, document: Document, drawings: Mapping[str, str], latex: str) -> str:
    """Return the whole report as one page that loads nothing.

    Args:
        results: what its script draws.
        document: the report.
        drawings: SVG of every figure, by name.
        latex: the tables for a paper, which the page shows as text.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("swarm_logistics_env", "study/report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    runs = _p_by_seed(results)
    data = _page_data(results, runs, document.sentences)
    rows, axis = forest(results, document.answer)
    environment.filters["values_unbroken"] = values_unbroken
    environment.filters["marked_up"] = marked_up
    return environment.get_template("page.html.jinja").render(
        document=document,
        paired=results.plan.paired,
        answer=document.answer,
        level=percent(document.answer.level),
        forest=rows,
        axis=axis,
        views=list(_views(results, runs, document.figures, drawings)),
        colours=_COLOURS,
        drawings={name: base64.b64encode(svg.encode()).decode() for name, svg in drawings.items()},
        latex=latex,
        # A text must not end the script that it stands in.
        data=json.dumps(data, separators=(",", ":")).replace("<", "\\u003c"),
        script=files(__package__).joinpath("page.js").read_text(encoding="utf-8"),
    )


def marked_up(text: str) -> Markup:
    """Return a text as HTML: counted verdicts have their colours, and no line ends in an option."""
    from markupsafe import Markup, escape

    html = re.sub(r"--[a-z][\w-]*", r'<span class="option">\g<0></span>', str(escape(text)))
    counted = rf"\d+ ({'|'.join(_COLOURS)})\b"
    return Markup(re.sub(counted, r'<span class="word \1">\g<0></span>', html))


def _views(
    results: StudyResults, runs: Runs, figures: Iterable[Figure], drawings: Mapping[str, str]
) -> Iterator[View]:
    """Yield P of every policy in the conditions of each table, then the figures of indicators.

    Args:
        figures: those of the report.
        drawings: SVG of each figure, by name.
    """
    of_indicators = list(_indicator_charts(figures, drawings))
    charts = [*_performance_charts(results, runs), *of_indicators]
    for number, (name, svg, panels, legend) in enumerate(charts):
        has_published = any(
            point.published is not None for panel in panels for point in panel.points
        )
        if has_published:
            legend = (*legend, "×: published")
        yield View(name, inline(svg, f"v{number}", _titles(panels)), legend)


def _performance_charts(results: StudyResults, runs: Runs) -> Iterator[Chart]:
    repeat = "seed" if results.plan.paired else "trial"
    n_drawn = max(map(len, runs.values()))
    only = f" of the first {n_drawn:,}" if n_drawn < len(results.plan.seeds) else ""
    legend = (f"bar: {P_LEVEL} interval", f"dot: one {repeat}{only}, click it")
    for table, panel in _performance_panels(results, runs):
        svg = drawing.svg_image(partial(drawing.intervals, panels=[panel]), _HEIGHT)
        yield f"P: {table}", svg, [panel], legend


def _performance_panels(results: StudyResults, runs: Runs) -> Iterator[tuple[str, Panel]]:
    """Yield P of every policy in the conditions of each table, with its runs; and the table."""
    conditions = list(runs)
    policies = results.policies
    shown = [cell for cell in results.cells if cell.arm.setting.kind != "policy"]
    by_table: dict[str, list[Cell]] = map_reduce(shown, lambda cell: cell.table)
    for table, cells in by_table.items():
        points = tuple(
            Point(
                cell.policy,
                policies.index(cell.policy),
                # "N = 10" stands there as "10", "FM1, m = 2" as "FM1 2".
                re.sub(r"^\w+ = |, m =", "", cell.words),
                *cell.mean,
                # The published values stand beside the first policy.
                cell.published if cell.policy == policies[0] else None,
                decided=True,
                saturated=cell.saturated,
                link=f"condition-{conditions.index(cell.arm.case.key)}",
                runs=tuple(runs[cell.arm.case.key]),
            )
            for cell in cells
            if cell.n_seeds
        )
        setting = cells[0].arm.setting
        x_label = X_LABELS.get(setting.kind, setting.name)
        if points:
            yield table, Panel("", f"performance {name_of_p(results.plan)}", points, (), x_label)


def _indicator_charts(figures: Iterable[Figure], drawings: Mapping[str, str]) -> Iterator[Chart]:
    for figure in figures:
        if figure.panels:
            legend = (f"bar: {figure.level} interval",)
            yield figure.title, drawings[figure.name], figure.panels, legend


def _titles(panels: Sequence[Panel]) -> dict[str, str]:
    """Return what each mark shows in words, by its id."""
    titles = {}
    for panel in panels:
        for point in panel.points:
            if point.value is not None:
                interval = Interval(point.value, point.low, point.high)
                digits = 3 if panel.thresholds else digits_of(point.value, width_of(interval))
                text = bracketed(interval, digits, panel.thresholds)
                titles[point.link] = f"{point.series}, {point.category}: {text}"
            if point.published is not None:
                titles[f"published-{point.link}"] = f"published: {point.published:g}"
    return titles


def _page_data(results: StudyResults, runs: Runs, sentences: Sequence[Sentence]) -> Json:
    """Return all that the page's script needs, as JSON holds it.

    Args:
        sentences: every verdict in words, in the order of the study.
    """
    indices = {key: index for index, key in enumerate(runs)}
    return {
        # A script rounds larger numbers.
        "seeds": [seed if seed < 2**53 else str(seed) for seed in results.plan.seeds],
        "paired": results.plan.paired,
        "conditions": list(_conditions(results, runs)),
        "questions": [
            _question(verdict.compared, words, indices)
            for verdict, words in zip(results.verdicts, sentences)
        ],
    }


def _p_by_seed(results: StudyResults) -> Runs:
    """Return mean P over the trainings of every condition, each once, at the seeds drawn."""
    arms = _arms(results)
    seeds = results.plan.seeds[: max(1, _MOST_DOTS // len(arms))]
    return {
        key: [
            _mean_p([results.succeeded.get((case.key, seed)) for case in arm.case.trainings])
            for seed in seeds
        ]
        for key, arm in arms.items()
    }


def _arms(results: StudyResults) -> dict[str, Arm]:
    """Return the conditions of a study, each once, by the key of its case."""
    return {arm.case.key: arm for _, _, arm in results.plan.cells}


def _conditions(results: StudyResults, runs: Runs) -> Iterator[Json]:
    n_deliveries = sum(len(outcome.delivery_times) for outcome in results.outcomes.values())
    share = min(1.0, _MOST_TIMES / max(1, n_deliveries))
    n_curves = max(1, int(share * len(results.plan.seeds)))
    for key, arm in _arms(results).items():
        first_training = arm.case.trainings[0]
        outcomes = [
            results.succeeded.get((first_training.key, seed)) for seed in results.plan.seeds
        ]
        yield {
            "name": f"{arm.case.policy.title}, {arm.setting}",
            "end": float(arm.case.scenario.duration),
            "p": [*runs[key]],
            # Deliveries in whole seconds, each as the time since the one before; of the first
            # training, where there are several.
            "curves": [
                None
                if outcome is None or outcome.untimed is not None
                else _steps(outcome.delivery_times)
                for outcome in outcomes[:n_curves]
            ],
            "command": world_of(first_training.task).watch_command(first_training),
        }


def _mean_p(outcomes: Sequence[Outcome | None]) -> float | None:
    """Return mean P over the trainings at one seed; None: a run failed, or is missing."""
    p = [outcome.delivered for outcome in outcomes if outcome is not None]
    return round(float(np.mean(p)), 4) if len(p) == len(outcomes) else None


def _steps(times: ArrayLike) -> list[JsonValue]:
    return [*np.diff(np.rint(times).astype(int), prepend=0).tolist()]


def _question(comparison: Comparison, words: Sentence, indices: Mapping[str, int]) -> Json:
    return {
        "table": comparison.table,
        "head": words.head,
        "text": words.text,
        "arms": [
            [comparison.definition.performances[name], str(arm.setting), indices[arm.case.key]]
            for name, arm in comparison.arguments.items()
        ],
    }
