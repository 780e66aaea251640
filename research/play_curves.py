"""P and R over items a robot, over robots with items in proportion, and over the duration.

    python -m research.play_curves

A headline is one point of these curves. It plays scripts and a network on robots that could exist
and writes the tables and the picture of docs/results.md. What is played is kept, as by
`play_tables`. Declared before the first run: the points below, the seeds, FM4 in 8 % of the robots.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from research.play_tables import MEDIA, OUT, PAGE
from research.tables import block_rows, curve_of, play, rewrite, seeds_from, table
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report import drawing, section
from swarm_logistics_env.study.report.curves import CurvePanel, curves
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

POLICIES = ("swarm-dt", "homing", "homing-stock", "ppo-delivery", "ppo-robust")
N_ROBOTS, ITEMS_A_ROBOT, DURATION = 25, 2.4, 500.0  # where the curves cross, as in `realistic`
BROKEN = 0.08  # the share of robots in FM4
ITEMS = (1, 2, 3, 4, 6, 8)  # a robot
ROBOTS = (5, 10, 50, 100)
DURATIONS = (125.0, 250.0, 1000.0, 2000.0)  # [s]
CURVES = {"items a robot": ITEMS, "robots": ROBOTS, "seconds": DURATIONS}
Point = tuple[str, float]  # a curve and its value


def conditions(curve: str, value: float) -> dict[str, Any]:
    """Return the fields of a point's scenario."""
    n_robots = int(value) if curve == "robots" else N_ROBOTS
    items = value if curve == "items a robot" else ITEMS_A_ROBOT
    duration = value if curve == "seconds" else DURATION
    return {"n_robots": n_robots, "n_items": round(items * n_robots), "duration": duration}


def study() -> Study:
    """Return the study of all curves: a table of it is a point."""
    faults = [
        {
            "title": f"{value:g} {curve}",
            "modes": ["FM4"],
            "robots": [max(1, round(BROKEN * conditions(curve, value)["n_robots"]))],
            "scenario": conditions(curve, value),
        }
        for curve, values in CURVES.items()
        for value in values
    ]
    return Study(
        name="curves",
        policies=list(POLICIES),
        seeds=8,
        first_seed=460_000,
        scenario={"preset": "realistic", "restock": True},
        faults=faults,
        indicators=["R"],
        out=OUT / "curves",
    )


def blocks(results: StudyResults) -> Iterator[tuple[str, str]]:
    """Yield a table for each curve: P, runs that stand still, and R."""
    cells = {(c.table, c.policy): c for c in results.cells if not c.arm.setting.value}
    verdicts = {(v.compared.table, v.compared.policy): v for v in results.verdicts}
    for curve, values in CURVES.items():
        titles = [f"{value:g} {curve}" for value in values]
        rows = [
            (f"`{policy}`", what, *(texts[title, policy] for title in titles))
            for policy in results.policies
            for what, texts in _measures(cells, verdicts).items()
        ]
        line = (
            f"{seeds_from(results)}; 95 % intervals; R with FM4 in {100 * BROKEN:g} % of the "
            "robots, at least one."
        )
        yield _block(curve), table(("policy", "", *titles), rows, line)


def _block(curve: str) -> str:
    """Return the name of the block on the page that a curve stands in."""
    return f"curve_{curve.split()[0]}"


def _measures(
    cells: Mapping[tuple[str, str], Cell], verdicts: Mapping[tuple[str, str], Verdict]
) -> dict[str, dict[tuple[str, str], str]]:
    return {
        "P": {key: section.mean_p(cell) for key, cell in cells.items()},
        "runs that stand still": {
            key: f"{100.0 * (cell.mean_of('stands_still') or 0.0):.0f} %"
            for key, cell in cells.items()
        },
        "R": {
            key: section.bracketed(verdict.estimate, 2) if verdict.estimate else section.NOTHING
            for key, verdict in verdicts.items()
        },
    }


def draw() -> None:
    """Draw P over each of the three, a panel a curve, of the tables on the page."""
    panels = []
    for curve, values in CURVES.items():
        rows = block_rows(PAGE, _block(curve))
        of_policies = [curve_of(policy, values, p) for policy, what, *p in rows if what == "P"]
        panels.append(CurvePanel("", curve, of_policies))
    picture = partial(
        curves, panels=panels, y_label="P [items]", n_columns=len(panels), logarithmic=True
    )
    note = "Means of 8 seeds; bands: 95 % intervals; all axes are logarithmic."
    images = drawing.images(picture, 2.9, note, drawing.FigureStyle(8.0))
    (MEDIA / "curves.png").write_bytes(images.png)


def main() -> None:
    """Play what is missing, then write tables and picture."""
    (results,) = play([study()])
    rewrite(PAGE, dict(blocks(results)))
    draw()


if __name__ == "__main__":
    main()
