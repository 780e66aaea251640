"""How swarms scale in racks, and how they bear narrower aisles: `python -m research.play_floors`.

Plays scripts and networks with 10 to 150 robots on the open floor and on the shipped plans, and
with 10 and 25 in halls that differ in the width of their aisles; writes the tables of
docs/floors.md and the picture of P over the number of robots. What is played stays in
results/floors, and the same command goes on after an interruption.

Declared before the first run: a run falls back (there it was called a collapse) if it delivers less
than half of what the same policy delivers on the same floor at the best of the smaller sizes, on
average. Of two policies the order turns if the 95 % intervals of their difference (Welch's) lie on
different sides of 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import combinations, pairwise, product

from more_itertools import map_reduce
from scipy.stats import binomtest

from research.tables import (
    ROOT,
    block_rows,
    curve_of,
    difference_of_means,
    play,
    rewrite,
    seeds_from,
    side,
    table,
)
from swarm_logistics_env import spi
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report import drawing, section
from swarm_logistics_env.study.report.curves import CurvePanel, curves
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.world.scenario import Scenario

PAGE = ROOT / "docs" / "floors.md"
PICTURE = ROOT / "docs" / "media" / "floors-scaling.png"
FLOORS = {"open": None, "aisles": "aisles", "two_docks": "two_docks"}
POLICIES = ("swarm-dt", "homing", "homing-stock", "ppo-robust@all")
SIZES = (10, 25, 50, 100, 150)
COMPARED_AT = (25, 100)
# Aisles between racks of 0.5 m in a hall of 10 m x 10 m; the shipped plan has 1 m.
WIDTHS = (1.0, 0.75, 1.5, 2.0)  # [m], the reference first
SIZES_IN_WIDTHS = (10, 25)
FALLEN_BACK_BELOW = 0.5  # of P of the best smaller size
Results = Mapping[str, StudyResults]  # by floor


def study(name: str, scenario: Scenario, sizes: Sequence[int] = SIZES) -> Study:
    """Return the study of one floor."""
    return Study(
        name=name,
        policies=list(POLICIES),
        seeds=6,
        first_seed=540_000,
        scenario=scenario,
        sizes=[{"values": sizes}],
        out=ROOT / "results" / "floors" / name,
    )


def scenario_on(floor: str | None, cell_size: float = 0.5) -> Scenario:
    """Return the world of a floor with cells of that side [m]."""
    return Scenario(floor=floor, cell_size=cell_size, restock=True, duration=200.0)


def hall(width: float) -> Scenario:
    """Return the world of the plan `aisles` with other aisles: as many racks as its storage has."""
    cell = 0.25  # [m]
    aisle = ":" * round(width / cell)
    rack = "=" * 2
    free = "." * 8
    dock = "A" * 8
    n_racks = 24 // len(aisle + rack)
    between = ":" * 24 + free + dock
    through = (n_racks * (aisle + rack)).ljust(24, ":") + free + dock
    rows = [between] * 4 + [through] * 14 + [between] * 4 + [through] * 14 + [between] * 4
    return scenario_on("\n".join(rows), cell_size=cell)


def cells_of(results: StudyResults) -> dict[tuple[str, int], Cell]:
    """Return the cells by policy and number of robots."""
    return {(cell.policy, int(cell.arm.setting.value)): cell for cell in results.cells}


def p_block(results: Results) -> str:
    """Return P of each policy and size on each floor."""
    rows = [
        (floor, f"`{policy}`", *(section.mean_p(cells_of(of_floor)[policy, n]) for n in SIZES))
        for floor, of_floor in results.items()
        for policy in of_floor.policies
    ]
    first = next(iter(results.values()))
    return table(
        ("floor", "policy", *(f"N = {n}" for n in SIZES)),
        rows,
        f"Mean P in 200 s with its 95 % interval, {seeds_from(first)}, of each training; restock.",
    )


def scalability_block(results: Results) -> str:
    """Return S of each step from a size to the next."""
    rows = []
    for floor, of_floor in results.items():
        by_policy = map_reduce(of_floor.verdicts, lambda verdict: verdict.compared.policy)
        for policy, verdicts in by_policy.items():
            rows.append((floor, f"`{policy}`", *map(section.ratio, verdicts)))
    return table(
        ("floor", "policy", *(f"{n} -> {larger}" for n, larger in pairwise(SIZES))),
        rows,
        "S of the step with its 95 % interval; of several trainings also how many collapsed.",
    )


def fallen_back_block(results: Results) -> str:
    """Return how many runs of each size fall back, with the interval of their share."""
    rows = [
        (floor, f"`{policy}`", *fallen_back(cells_of(of_floor), policy))
        for floor, of_floor in results.items()
        for policy in of_floor.policies
    ]
    return table(
        ("floor", "policy", *(f"N = {n}" for n in SIZES[1:])),
        rows,
        "Runs that deliver less than half of the mean of the best smaller size, and the exact 95 % "
        "interval of their share.",
    )


def fallen_back(cells: Mapping[tuple[str, int], Cell], policy: str) -> Iterator[str]:
    """Yield how many runs of each size but the first fell back, with the interval of the share."""
    best = 0.0
    for n, larger in pairwise(SIZES):
        best = max(best, cells[policy, n].mean.value)
        p = cells[policy, larger].by_seed.ravel()
        n_runs = int((p < FALLEN_BACK_BELOW * best).sum())
        low, high = binomtest(n_runs, len(p)).proportion_ci()
        yield f"{n_runs} of {len(p)} [{100 * low:.0f}, {100 * high:.0f}] %"


def samples(cell: Cell) -> Numbers:
    """Return P of each training, or of each seed of a policy without trainings."""
    return cell.by_seed.mean(axis=1) if cell.by_seed.ndim == 2 else cell.by_seed


def difference(cells: Mapping[tuple[str, int], Cell], pair: Sequence[str], n: int) -> spi.Interval:
    """Return P of the first policy less that of the second, with its 95 % interval."""
    first, second = (samples(cells[policy, n]) for policy in pair)
    return difference_of_means(first, second)


def turns_block(results: Results) -> str:
    """Return the pairs of policies whose order on the open floor turns on a plan."""
    cells = {floor: cells_of(of_floor) for floor, of_floor in results.items()}
    rows = []
    for pair in combinations(results["open"].policies, 2):
        for n in COMPARED_AT:
            intervals = {floor: difference(cells[floor], pair, n) for floor in FLOORS}
            signs = {floor: side(interval) for floor, interval in intervals.items()}
            if any(signs[floor] * signs["open"] < 0 for floor in FLOORS):
                texts = (section.limits(interval, 0) for interval in intervals.values())
                rows.append((f"`{pair[0]}` less `{pair[1]}`", n, *texts))
    n_compared = len(COMPARED_AT) * len(list(combinations(results["open"].policies, 2)))
    line = f"{len(rows)} of {n_compared} comparisons turn; no correction for their number."
    return table(("P of", "N", *FLOORS), rows, line)


def adaptability_block(results: Mapping[float, StudyResults]) -> str:
    """Return P in aisles of each width and A from the first width to each other."""
    cells = {width: cells_of(of_width) for width, of_width in results.items()}
    reference, *others = WIDTHS
    rows: list[tuple[str, ...]] = []
    for n, policy in product(SIZES_IN_WIDTHS, results[reference].policies):
        p_o = cells[reference][policy, n]
        p_new = {x: cells[x][policy, n] for x in others}
        estimates = (
            spi.adaptability(p_o.by_seed, p_new[x].by_seed, x_o=reference, x_new=x) for x in others
        )
        means = (section.mean_p(cell) for cell in (p_o, *p_new.values()))
        rows.append((str(n), f"`{policy}`", *means, *(section.bracketed(a, 2) for a in estimates)))
    return table(
        ("N", "policy", *(f"P, {x:g} m" for x in WIDTHS), *(f"A, {x:g} m" for x in others)),
        rows,
        f"Mean P in 200 s, and A from aisles of {reference:g} m to others, with 95 % intervals; "
        f"{seeds_from(results[reference])}, of each training; restock.",
    )


def draw() -> None:
    """Draw P over the number of robots, a panel for each floor, of the table on the page."""
    by_floor = map_reduce(block_rows(PAGE, "floors p"), lambda cells: cells[0])
    panels = [
        CurvePanel(floor, "robots N", [curve_of(policy, SIZES, p) for _, policy, *p in rows])
        for floor, rows in by_floor.items()
    ]
    picture = partial(
        curves, panels=panels, y_label="P in 200 s [items]", n_columns=3, logarithmic=True
    )
    note = "Means of 6 seeds, of each training; bands: 95 % intervals; both axes are logarithmic."
    PICTURE.write_bytes(drawing.images(picture, 2.9, note, drawing.FigureStyle(8.0)).png)


def main() -> None:
    """Play what is missing, then write tables and picture."""
    on_floors = [study(name, scenario_on(floor)) for name, floor in FLOORS.items()]
    results = dict(zip(FLOORS, play(on_floors)))
    in_halls = [study(f"aisles-{x:g}-m", hall(x), SIZES_IN_WIDTHS) for x in WIDTHS]
    in_widths = dict(zip(WIDTHS, play(in_halls)))
    blocks = {
        "floors p": p_block,
        "floors s": scalability_block,
        "floors fallen back": fallen_back_block,
        "floors turns": turns_block,
    }
    tables = {name: block(results) for name, block in blocks.items()}
    rewrite(PAGE, {**tables, "floors a": adaptability_block(in_widths)})
    draw()


if __name__ == "__main__":
    main()
