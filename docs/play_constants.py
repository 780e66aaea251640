"""Searches the constants that the paper leaves open: `python docs/play_constants.py`.

It rewrites the tables and the figure of docs/paper_constants.md. What is played is kept, so that a
call after an interruption plays the rest; all of it takes a quarter of an hour on one free core.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from front_page import DOCS, rewritten
from record_tables import table

from swarm_logistics_env import spi
from swarm_logistics_env.report import wording
from swarm_logistics_env.report.drawing import COLOURS, INK, images
from swarm_logistics_env.studies.comparisons import Setting
from swarm_logistics_env.studies.store import Store
from verification.paper_constants import (
    CELLS,
    FM1,
    LEAST,
    PUBLISHED,
    RANGES,
    TABLE_I,
    Budget,
    Floats,
    Found,
    Judged,
    Players,
    defaults,
    errors,
    model_of,
    play,
    spread,
)
from verification.paper_model import Model
from verification.paper_profile import Identified, identify

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAGE = DOCS / "paper_constants.md"
FIGURE = DOCS / "media" / "paper_constants.svg"
OUT = DOCS.parent / "results" / "constants"
BUDGET = Budget()
UNITS = {"wall_distance": "m", "diffusion": "rad²/s", "avoidance_range": "m", "radio_range": "m"}
_GROUPS: Mapping[str, Callable[[Setting], bool]] = {
    "N = 5 to 20": lambda cell: cell.kind == "size" and cell.value <= 20,
    "N = 30 to 60": lambda cell: cell.kind == "size" and 30 <= cell.value <= 60,
    "N = 100, 150": lambda cell: cell.kind == "size" and cell.value >= 100,
    "no fault, robots removed": lambda cell: cell.name in ("none", "removed"),
    **{mode: lambda cell, mode=mode: cell.name == mode for mode in ("FM1", "FM2", "FM3", "FM4")},
    "wider warehouse": lambda cell: cell.name == "warehouse_width" and cell.value > 10,
    "narrower delivery area": lambda cell: cell.name == "delivery_width",
}


def judgement(found: Found) -> str:
    """Return what the best candidate of each half is worth on the other one."""
    head = ("searched on", "loss there", "judged on", "its loss", "defaults' loss", "difference",
            "met by it", "met by the defaults")  # fmt: skip
    rows = []
    for one, name, other in zip(found.judged, ("half 1", "half 2"), ("half 2", "half 1")):
        its, of_defaults = one.losses
        rows.append(
            (
                f"{name}, {len(one.searched.cells)} cells",
                f"{one.searched.loss:.3f}",
                f"{other}, {len(one.cells)} cells",
                f"{its:.3f}",
                f"{of_defaults:.3f}",
                wording.bracketed(one.difference, 3),
                _met(one, one.p),
                _met(one, one.p_defaults),
            )
        )
    halves = [
        f"Half {number}: {'; '.join(str(CELLS[k]) for k in one.searched.cells)}."
        for number, one in enumerate(found.judged, start=1)
    ]
    seeds = found.judged[0].p.shape[1]
    text = f"{seeds} fresh seeds; difference: with its 95 % interval over the cells."
    return "\n".join([table(head, rows), "", text, "", *halves])


def _met(judged: Judged, p: Floats) -> str:
    published = PUBLISHED[list(judged.cells)]
    intervals = [spi.mean_interval(row) for row in p]
    inside = sum(
        one.low is not None and one.high is not None and one.low <= value <= one.high
        for one, value in zip(intervals, published)
    )
    return f"{inside} of {len(published)}"


def constants(found: Found, told: Identified) -> str:
    """Return what the tables leave open of each constant."""
    head = ("constant", "default", "searched", "not ruled out", "share of the range",
            "best of half 1", "best of half 2", "best by the model")  # fmt: skip
    best = [one.searched.best for one in found.judged]
    rows = [
        (
            f"`{name}`" if name.isidentifier() else name,
            f"{default:g} {UNITS.get(name, '')}".strip(),
            f"{low:g} to {high:g}",
            "{:.3g} to {:.3g}".format(*told.profiles[name].kept),
            f"{told.profiles[name].share:.0%}",
            *(f"{one[k]:g}" for one in (*best, told.best)),
        )
        for k, (name, default, (low, high)) in enumerate(
            zip(RANGES, defaults(), RANGES.values(), strict=True)
        )
    ]
    of_defaults = errors(found.p_defaults.mean(axis=1), range(len(CELLS))).mean()
    text = (
        f"The model's best candidate is expected to have a loss of {told.loss:.3f} over all "
        f"{len(CELLS)} cells, the defaults have {of_defaults:.3f}. Constants that are right have a "
        f"loss of {wording.bracketed(told.right, 3)} in simulated tables of single runs, and in "
        f"95 % of them lie within {told.limit - told.loss:.3f} of the best candidate."
    )
    names = list(RANGES)
    pairs = [(abs(told.linked[a, b]), a, b) for a in range(len(names)) for b in range(a)]
    strongest = [
        f"{names[a]} and {names[b]} {told.linked[a, b]:+.2f}"
        for _, a, b in sorted(pairs, reverse=True)[:3]
    ]
    linked = f"Rank correlations among what is not ruled out: {', '.join(strongest)}."
    return "\n".join([table(head, rows), "", text, "", linked])


def effects(model: Model) -> str:
    """Return by how much P changes in each group of cells if a constant doubles, on average."""
    places = spread(1024, "effects") - 0.5
    logs = np.log(np.maximum(model.means(places + 0.5), LEAST))
    all_slopes, *_ = np.linalg.lstsq(places, logs - logs.mean(axis=0))
    rows = []
    for group, belongs in _GROUPS.items():
        cells = [k for k, cell in enumerate(CELLS) if belongs(cell)]
        slopes = all_slopes[:, cells].mean(axis=1)
        doubled = [
            f"{np.expm1(slope * np.log(2) / np.log(high / low)):+.0%}"
            for slope, (low, high) in zip(slopes, RANGES.values())
        ]
        doubled = [change.replace("+0%", "0%").replace("-0%", "0%") for change in doubled]
        rows.append((group, *doubled, f"{model.explained[cells].mean():.0%}"))
    return table(("cells", *RANGES, "explained"), rows)


def trade(found: Found) -> str:
    """Return how well Table I and FM1 are met together, by the defaults and by a rival."""
    seeds, n = found.p_trade.shape[1], len(TABLE_I)
    own = found.p_defaults[[*TABLE_I, *FM1], :seeds]
    rows = []
    for name, p in (("defaults", own), ("rival", found.p_trade)):
        means = p.mean(axis=1)
        losses = (errors(means[:n], TABLE_I).mean(), errors(means[n:], FM1).mean())
        told = [", ".join(f"{mean:.1f}" for mean in part) for part in (means[n:], means[:n])]
        rows.append((name, *(f"{loss:.3f}" for loss in losses), *told))
    paper = [", ".join(f"{PUBLISHED[k]:g}" for k in cells) for cells in (FM1, TABLE_I)]
    head = ("", "loss on Table I", "loss on FM1", "P under FM1, m = 1, 2, 3", "P of Table I")
    rival = ", ".join(f"{name} {value:g}" for name, value in zip(RANGES, found.trade))
    text = f"{seeds} fresh seeds. The rival: {rival}."
    return "\n".join([table(head, [("paper", "", "", *paper), *rows]), "", text])


def draw(canvas: Figure, found: Found, told: Identified) -> None:
    """Draw the profile of each constant, and the losses on Table I and on FM1 together."""
    panels = canvas.subplots(4, 2).ravel()
    of_defaults = errors(found.p_defaults.mean(axis=1), range(len(CELLS))).mean()
    top = max(np.quantile(profile.loss, 0.9) for profile in told.profiles.values())
    for axes, default, (name, profile) in zip(panels, defaults(), told.profiles.items()):
        centres = np.sqrt(profile.values[1:] * profile.values[:-1])
        axes.axvspan(*profile.kept, color=COLOURS[5], alpha=0.25, linewidth=0)
        axes.plot(centres, profile.loss, color=COLOURS[0])
        axes.plot(default, of_defaults, "D", color=COLOURS[1], markersize=5)
        axes.set(xscale="log", ylim=(0.0, 1.15 * max(top, of_defaults)), ylabel="loss")
        unit = UNITS.get(name)
        axes.set_title(f"{name} [{unit}]" if unit else name)
        _plain_ticks(axes, profile.values[0], profile.values[-1])
    _draw_trade(panels[-1], found, told)


def _plain_ticks(axes: Axes, low: float, high: float) -> None:
    ticks = [
        value for value in (0.1, 0.2, 0.5, 1, 2, 4, 8, 80, 100, 150, 200) if low <= value <= high
    ]
    axes.set_xticks(ticks, [f"{value:g}" for value in ticks])
    axes.minorticks_off()


def _draw_trade(axes: Axes, found: Found, told: Identified) -> None:
    x, y = (errors(found.p_first[:, list(k)], k).mean(axis=1) for k in (TABLE_I, FM1))
    axes.plot(x, y, ".", color=INK, alpha=0.35)
    axes.plot(*told.trade[0].T, color=COLOURS[0])
    n, both = len(TABLE_I), [*TABLE_I, *FM1]
    for p, marker, colour in ((found.p_defaults[both], "D", 1), (found.p_trade, "s", 2)):
        of_cell = errors(p.mean(axis=1), both)
        place = of_cell[:n].mean(), of_cell[n:].mean()
        axes.plot(*place, marker, color=COLOURS[colour], markersize=5)
    axes.set(xlim=(0, 0.6), ylim=(0, 0.8), xlabel="loss on Table I", ylabel="loss on FM1")
    axes.set_title("Table I against FM1")


def main(out: Path = OUT, budget: Budget = BUDGET) -> None:
    """Play what is missing, then rewrite the page and its figure."""
    out.mkdir(parents=True, exist_ok=True)
    with Store(out / "runs.sqlite") as store:
        found = play(Players(store, budget.duration), budget)
    model = model_of(found.first, found.p_first, range(len(CELLS)))
    told = identify(model, found.p_defaults)
    blocks = {
        "judgement": judgement(found),
        "constants": constants(found, told),
        "effects": effects(model),
        "trade": trade(found),
    }
    PAGE.write_text(rewritten(PAGE.read_text(encoding="utf-8"), blocks), encoding="utf-8")
    svg, _ = images(lambda canvas: draw(canvas, found, told), 9.0)
    FIGURE.write_text(svg, encoding="utf-8")


if __name__ == "__main__":
    main()
