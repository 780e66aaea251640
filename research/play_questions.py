"""Plays the studies that answer the field's questions.

    python -m research.play_questions [NAME ...]

Of each study in examples/questions this writes the tables into one page, and a figure. What is
played is kept, as by `play_tables`.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from more_itertools import map_reduce

from research import question_tables
from research.play_tables import OUT
from research.tables import ROOT, example, play, rewrite
from swarm_logistics_env.study.report import drawing
from swarm_logistics_env.study.report.curves import Curve, CurvePanel, curves
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.drawing import Draw
from swarm_logistics_env.study.report.figures import note_on_verdicts
from swarm_logistics_env.study.report.points import Panel, Point
from swarm_logistics_env.study.verdicts.mid_run_faults import rate_curves
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import DECIDED, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

DOCS = ROOT / "docs"
# Blocks of the page; its figure, the height of it [inch], and the note below it.
Answer = tuple[Mapping[str, str], Draw, float, str]


def policies_compared(results: StudyResults) -> Answer:
    """Answer with all policies side by side, and the report's figure of R."""
    figures = document(results).figures
    figure = next(figure for figure in figures if figure.name.startswith("R-Two-robots"))
    blocks = {"answer": question_tables.side_by_side(results)}
    return blocks, figure.draw, figure.height, figure.note


def larger_swarms(results: StudyResults) -> Answer:
    """Answer with P and R against N."""
    blocks = {
        "performance": question_tables.performances_by_size(results),
        "robustness": question_tables.by_size(results),
    }
    robustness = [test for test in results.verdicts if test.compared.indicator == "R"]
    panels = []
    by_mode: dict[str, list[Verdict]] = map_reduce(robustness, lambda test: test.after.name)
    for mode, tests in by_mode.items():
        points = tuple(
            Point(
                test.compared.policy,
                results.policies.index(test.compared.policy),
                f"{test.compared.n_robots}, m = {test.after.value:g}",
                *interval,
                decided=test.on_threshold.adjusted in DECIDED,
            )
            for test in tests
            if (interval := test.interval)
        )
        panels.append(Panel(mode, "robustness R", points, (0.0,), ""))
    panels[-1] = replace(panels[-1], x_label="swarm size N, faulty robots m")
    note = note_on_verdicts(results, robustness)
    return blocks, partial(on_one_scale, panels=panels), 0.7 + 1.8 * len(panels), note


def on_one_scale(canvas: "Canvas", panels: Sequence[Panel]) -> None:
    """Draw values with their intervals, one panel below the other, all on one scale."""
    drawing.intervals(canvas, panels)
    ends = [end for axes in canvas.axes for end in axes.get_ylim()]
    for axes in canvas.axes:
        axes.set_ylim(min(ends), max(ends))


def wear_and_repair(results: StudyResults) -> Answer:
    """Answer with what wear costs and what a repair brings, drawn over time for FM4."""
    blocks = {
        "wear": question_tables.wear(results),
        "repair": question_tables.repairs(results),
        "after": question_tables.after_repairs(results),
    }
    by_policy: dict[str, dict[str, Curve]] = {}
    for test in results.verdicts:
        if test.after.name == "FM4":
            rates = {rate.runs: rate for rate in rate_curves(results, test.compared)}
            sound = float(rates["no fault"].deliveries.mean())
            title = f"{test.compared.policy}, 100 % are {sound:.1f} items"
            of_policy = by_policy.setdefault(title, {})
            for runs, rate in rates.items():
                label = test.compared.table.lower() if runs == "fault" else runs
                percentages = (100.0 / sound * column for column in rate[2:])
                of_policy[label] = Curve(label, rate.seconds, *percentages)
    panels = [
        CurvePanel(title, "end of the window [s]", list(of_policy.values()))
        for title, of_policy in by_policy.items()
    ]
    draw = partial(curves, panels=panels, y_label="deliveries [%]", onset=100.0)
    note = f"Means of {results.seeds_text}; bands: pointwise 95 % t-intervals; dotted: the fault."
    return blocks, draw, 0.5 + 1.9 * len(panels), note


def realistic_robots(results: StudyResults) -> Answer:
    """Answer with all policies, and each beside itself in the ideal world."""
    blocks, draw, height, note = policies_compared(results)
    seeds = len(results.plan.seeds)
    (ideal,) = play([example(OUT, "questions/central_or_swarm", seeds=seeds)])
    blocks = {**blocks, "lost": question_tables.losses_between_worlds(results, ideal)}
    return blocks, draw, height, note


QUESTIONS: dict[str, Callable[[StudyResults], Answer]] = {
    "central_or_swarm": policies_compared,
    "larger_swarms": larger_swarms,
    "wear_and_repair": wear_and_repair,
    "realistic_robots": realistic_robots,
}


def main(names: list[str]) -> None:
    """Play the studies of these names, and rewrite their tables and figures."""
    for name in names or QUESTIONS:
        (results,) = play([example(OUT, f"questions/{name}")])
        blocks, draw, height, note = QUESTIONS[name](results)
        svg = drawing.svg_image(draw, height, note)
        (DOCS / "media" / f"{name}.svg").write_text(svg, encoding="utf-8")
        page_blocks = {f"{name} {part}": block for part, block in blocks.items()}
        rewrite(DOCS / "research" / "questions_of_the_field.md", page_blocks)


if __name__ == "__main__":
    main(sys.argv[1:])
