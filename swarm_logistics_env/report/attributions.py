"""The chapter on who is to blame, from the tables that `blame` left in the folder of a study."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.performance_table import Row, groups_of, rows_of

from . import wording
from .document import Chapter, Document
from .drawing import COLOURS, INK
from .figures import Figure
from .result_tables import Column, Section, table_section

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Canvas

TABLE = "attribution.csv"
_TEXT = (
    "Which robots and which lost capabilities cost the deliveries that a fault costs, from copies "
    "of the world at the onset. None of it enters a verdict above."
)
_COLUMNS: list[Column] = [
    ("what", lambda row: row.part),
    ("meaning", lambda row: row.meaning),
    ("robots", lambda row: "" if row.robots != row.robots else f"{row.robots:.0f}"),
    ("deliveries lost [95 %]", lambda row: wording.bracketed(_lost(row), 2)),
]


def with_attributions(whole: Document, folder: Path) -> Document:
    """Return a report with a chapter on the attributions in folders of the study's own."""
    found = tuple(section_of(path) for path in sorted(folder.glob(f"*/{TABLE}")))
    if not found:
        return whole
    chapter = Chapter("Who is to blame", _TEXT, found)
    return replace(whole, chapters=(*whole.chapters, chapter))


def section_of(path: Path) -> Section:
    """Return an attribution.csv as a table with its figure."""
    import pandas as pd

    table = pd.read_csv(path)
    table = table[table["robots"] != 0]  # nobody failed in that role
    one = next(rows_of(table))
    title = f"{one.policy}: deliveries that {one.fault} costs, per episode"
    text = (
        f"Means over {one.seeds} seeds. The rows of roles sum to all, and so do those of lost "
        "capabilities (Shapley values); robots: how many failed in that role, over all seeds."
    )
    capped = (
        f"Capped: in {one.capped} of them every item was delivered without the fault, so it costs "
        "more than is shown."
    )
    lines = (text, capped) if one.capped else (text,)
    name = re.sub(r"[^A-Za-z0-9]+", "-", path.parent.name).strip("-")
    caption = f"{title}, with 95 % intervals over {one.seeds} seeds."
    height = 1.0 + 0.3 * len(table)
    figure = Figure(name, caption, table, height, lambda canvas: _draw(canvas, table))
    section = table_section(title, rows_of(table), _COLUMNS, *lines)
    return replace(section, figures=(figure,))


def _lost(row: Row) -> Interval:
    alone = row.low != row.low  # one seed
    return Interval(row.lost, *((None, None) if alone else (row.low, row.high)))


def _draw(canvas: Canvas, table: pd.DataFrame) -> None:
    groups = list(groups_of(table, "group"))
    heights = [len(here) for _, here in groups]
    panels = canvas.subplots(len(groups), 1, sharex=True, squeeze=False, height_ratios=heights)
    for axes, (group, here) in zip(panels[:, 0], groups):
        places = range(len(here))
        axes.barh(places, here["lost"], color=COLOURS[0], height=0.6)
        axes.hlines(places, here["low"], here["high"], color=INK, linewidth=1.5)
        axes.set_yticks(places, here["part"])
        axes.invert_yaxis()
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.grid(visible=False)
        axes.set_title(group)
    panels[-1, 0].set_xlabel("deliveries lost after the onset, per episode")
