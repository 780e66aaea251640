"""The ladder of scripts, and what the large numbers lean on: two tables of docs/results.md.

`make tables` plays and writes them with docs/play_tables.py.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tables import table

from swarm_logistics_env import spi
from swarm_logistics_env.report import drawing, section
from swarm_logistics_env.spi.summaries import t_interval
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import Cell

if TYPE_CHECKING:
    from matplotlib.figure import Figure

EXAMPLES = Path(__file__).parents[1] / "examples"
NAMES = "ladder", "ladder_restocked", "leans"


def ladder_studies(out: Path) -> tuple[Study, ...]:
    """Return the studies of both tables."""
    return tuple(Study.from_file(EXAMPLES / f"{name}.toml", out=out / name) for name in NAMES)


def ladder_block(cleared: StudyResults, restocked: StudyResults) -> str:
    """Return a row for each rung: its time to clear and P, and what it adds to the one before."""
    columns: list[tuple[str, Callable[[str, str], str]]] = []
    for table_name in _tables(cleared):
        columns += [
            (f"time to clear [s], {table_name}", _times(cleared, table_name)),
            (f"P where items come back, {table_name}", _gains(restocked, table_name)),
        ]
    rungs = cleared.policies
    rows = [
        (f"`{rung}`", *(of(rung, before) for _, of in columns))
        for rung, before in zip(rungs, _before(rungs))
    ]
    seeds = cleared.plan.seeds
    text = (
        f"{len(seeds)} seeds from {seeds[0]:,} on. Times are medians with 95 % intervals: less is "
        "better; those of networks are means over their trainings and seeds. P is the items "
        "delivered in 500 s, and in brackets the gain over the rung above, seed by seed; that of "
        "`central`, which has no stock, is over `homing`."
    )
    return "\n".join([table(("", *(name for name, _ in columns)), rows), "", text])


def _before(rungs: Sequence[str]) -> list[str]:
    """Return the rung that each is compared with."""
    return [
        "" if rung.startswith("ppo-") else "homing" if rung == "central" else before
        for rung, before in zip(rungs, ("", *rungs))
    ]


def leans_block(found: StudyResults) -> str:
    """Return a row for each world: P of every policy."""
    worlds = {name: _cells(found, name) for name in _tables(found)}
    for fault in found.plan.specification.faults:
        ours = [c for c in found.cells if c.table == fault.title]
        worlds[fault.title] = {c.policy: c for c in ours if c.arm.setting.name in fault.modes}
    rows = [
        (name, *(_p_and_stalls(cells[one]) for one in found.policies))
        for name, cells in worlds.items()
    ]
    seeds = found.plan.seeds
    text = (
        f"P, items delivered in 500 s by 25 robots, with 95 % intervals; {len(seeds)} seeds from "
        f"{seeds[0]:,} on, of each training. {section.SATURATED}: in at least one run every item "
        "was delivered. Stalled: so many of the runs delivered less than a quarter of the median."
    )
    head = ("", *(f"`{one}`" for one in found.policies))
    shares = _shares(next(iter(worlds.values())))
    return "\n".join([table(head, rows), "", text, shares])


def _p_and_stalls(cell: Cell) -> str:
    stalled = spi.share_stalled(cell.by_seed.ravel())
    return section.mean_p(cell) + (f"; {stalled:.0%} stalled" if stalled else "")


def _shares(cells: dict[str, Cell]) -> str:
    """Return in a sentence how much of the networks' gains a script reaches."""
    p = {one: cell.mean.value for one, cell in cells.items()}

    def share(script: str, least: str, network: str) -> str:
        return f"{(p[script] - p[least]) / (p[network] - p[least]):.0%}"

    told = [
        f"`homing` has {share('homing', 'swarm-dt', one)} and `homing-stock` "
        f"{share('homing-stock', 'swarm-dt', one)} of those of `{one}`"
        for one in p
        if one.startswith("ppo-")
    ]
    if not told:
        return ""
    return f"As it is, of the deliveries that a network has over `swarm-dt`: {'; '.join(told)}."


def _tables(found: StudyResults) -> Sequence[str]:
    return list(dict.fromkeys(one.title for one in found.plan.specification.ablations))


def _cells(found: StudyResults, name: str) -> dict[str, Cell]:
    """Return the cells of a table by policy."""
    return {cell.arm.setting.name: cell for cell in found.cells if cell.table == name}


def _times(found: StudyResults, name: str) -> Callable[[str, str], str]:
    cells = _cells(found, name)
    return lambda rung, _: section.time_to_clear(cells[rung])


def _gains(found: StudyResults, name: str) -> Callable[[str, str], str]:
    cells = _cells(found, name)

    def text(rung: str, before: str) -> str:
        told = section.mean_p(cells[rung])
        if not before:
            return told
        more = t_interval(cells[rung].by_seed - cells[before].by_seed)
        return f"{told} (+{section.bracketed(more, 1)})".replace("+-", "-")

    return text


def draw_ladder(restocked: StudyResults, path: Path) -> None:
    """Draw P of each rung with its interval, without and with a handling time."""

    def draw(canvas: Figure) -> None:
        axes = canvas.subplots()
        places = range(len(restocked.policies), 0, -1)
        for shift, (name, colour) in enumerate(zip(_tables(restocked), drawing.COLOURS)):
            cells = _cells(restocked, name)
            for place, rung in zip(places, restocked.policies):
                value, low, high = cells[rung].mean
                at = place + 0.14 - 0.28 * shift
                axes.plot([low or value, high or value], [at, at], color=colour)
                axes.plot(value, at, drawing.MARKERS[shift], color=colour)
            axes.plot([], [], drawing.MARKERS[shift], color=colour, label=name)
        axes.set_yticks(list(places), restocked.policies)
        axes.set(xlabel="P, items delivered in 500 s where items come back", xlim=(0.0, None))
        axes.legend(loc="upper right")

    path.write_text(drawing.images(draw, 2.9)[0], encoding="utf-8")
