"""How far results carry from one engine to another: `make bodies` (two core-hours).

Plays policies in the package's own engine, on MuJoCo's robots and in the DotBots' simulator, on the
same seeds, and writes the tables of docs/bodies.md. What is played stays in results/bodies, and the
same command goes on after an interruption.

Declared before the first run: an order of two policies turns if the 95 % intervals of their
difference over seeds lie on different sides of 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

from research.play_tables import shares_of_script
from research.tables import ROOT, percent_change, play, rewrite, side, signed_percent, table
from swarm_logistics_env import spi
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.spi.summaries import t_interval
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import NO_FAULT
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.report.tables import contacts_text
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict
from swarm_logistics_env.world.scenario import CHIPMUNK, Scenario

PAGE = ROOT / "docs" / "bodies.md"
POLICIES: tuple[str, ...] = ("swarm-dt", "homing", "ppo-robust")
FAULTS = ({"modes": ["FM1", "FM4_jam"], "robots": [2]},)


class World(NamedTuple):
    """A world that two engines move: the package's own and another."""

    name: str
    scenario: Scenario
    engine: str
    n_seeds: int
    faults: Sequence[Mapping[str, object]] = FAULTS
    policies: Sequence[str | PolicySpec] = POLICIES

    def study(self, bodies: str) -> Study:
        """Return the study of one of the two engines."""
        return Study(
            name=section.slug(self.name, bodies),
            policies=list(self.policies),
            seeds=self.n_seeds,
            first_seed=560_000,
            scenario=self.scenario.replace(bodies=bodies),
            indicators=["R", "change"],
            faults=list(self.faults),
            ablations=[
                {"title": "policies", "policy": policy}
                for policy in (() if self.faults else self.policies[:-1])
            ],
            out=ROOT / "results" / "bodies" / section.slug(self.name, bodies),
        )


_WORLD = Scenario(restock=True, duration=200.0)
# MuJoCo's motors give 5 m/s2 at most, so the package's own engine gets no more either.
_WHEELS = _WORLD.replace(drive="differential", max_acceleration=5.0)
_SLOW = _WORLD.replace(drive="differential", max_speed=1.0, max_acceleration=2.0)
REALISTIC = World(
    "realistic",
    Scenario.preset("realistic").replace(restock=True),
    "mujoco",
    n_seeds=5,
    faults=(),
    policies=("homing", "homing-stock", "ppo-robust@all"),
)
OTHERS = (
    World("wheels", _WHEELS, "mujoco", 10),
    World("slow wheels", _SLOW, "mujoco", 10, faults=()),
    World("pushed disc", _WORLD, "mujoco", 10, faults=()),
    World("dotbots", Scenario.preset("dotbots"), "dotbots", 5),
)


class Results(NamedTuple):
    """What both engines of a world say."""

    world: World
    chipmunk: StudyResults
    other: StudyResults


def played(world: World) -> Results:
    """Play what is missing of a world; return what its runs say."""
    return Results(world, *play(world.study(bodies) for bodies in (CHIPMUNK, world.engine)))


def p_rows(results: Results) -> Iterator[tuple[str, ...]]:
    """Yield P of each policy and condition in both engines, and its change."""
    in_chipmunk, in_other = (cells_of(study) for study in (results.chipmunk, results.other))
    for policy, setting in in_chipmunk:
        cells = in_chipmunk[policy, setting], in_other[policy, setting]
        p = map(section.mean_p, cells)
        contacts = map(contacts_text, cells)
        yield results.world.name, f"`{policy}`", setting, *p, change_of_p(*cells), *contacts


def change_of_p(in_chipmunk: Cell, in_other: Cell) -> str:
    """Return by how much P changes from one engine to the other, e.g. "-20 % [-31, -8]"."""
    try:
        return signed_percent(percent_change(in_chipmunk.by_seed, in_other.by_seed), 0)
    except spi.IndicatorError:
        return section.NOTHING  # nothing was delivered in the package's own engine


def cells_of(results: StudyResults) -> dict[tuple[str, str], Cell]:
    """Return the cells by policy and condition; of policies compared with the first, each once."""
    cells = {}
    for cell in results.cells:
        setting = cell.arm.setting
        is_policy = setting.kind == "policy"
        key = (setting.name, str(NO_FAULT)) if is_policy else (cell.policy, str(setting))
        cells[key] = cell
    rank = {policy: rank for rank, policy in enumerate(results.policies)}
    return {key: cells[key] for key in sorted(cells, key=lambda key: rank[key[0]])}


def r_rows(results: Results) -> Iterator[tuple[str, ...]]:
    """Yield R of each policy and failure mode in both engines."""
    in_chipmunk, in_other = (verdicts_of(study) for study in (results.chipmunk, results.other))
    for policy, label in in_chipmunk:
        ratios = (section.ratio(verdicts[policy, label]) for verdicts in (in_chipmunk, in_other))
        yield results.world.name, f"`{policy}`", label, *ratios


def verdicts_of(results: StudyResults) -> dict[tuple[str, str], Verdict]:
    """Return the verdicts on R by policy and failure mode."""
    return {
        (verdict.compared.policy, verdict.compared.label): verdict
        for verdict in results.verdicts
        if verdict.compared.indicator == "R"
    }


def order_rows(results: Results) -> Iterator[tuple[str, ...]]:
    """Yield the difference of each two policies' P without a fault in both engines."""
    in_chipmunk, in_other = (cells_of(study) for study in (results.chipmunk, results.other))
    for first, second in combinations(results.chipmunk.policies, 2):
        texts = []
        sides = []
        for cells in (in_chipmunk, in_other):
            p, of_second = (cells[policy, str(NO_FAULT)].by_seed for policy in (first, second))
            interval = t_interval(p - of_second)
            texts.append(section.bracketed(interval, 0))
            sides.append(side(interval))
        words = {1: "holds", -1: "turns", 0: "open"}
        yield results.world.name, f"`{first}` less `{second}`", *texts, words[sides[0] * sides[1]]


def share_rows(results: Results) -> Iterator[tuple[str, ...]]:
    """Yield P of each policy as a multiple of that of each one before it, in both engines."""
    studies = (results.chipmunk, results.other)
    for script, policy in combinations(results.chipmunk.policies, 2):
        shares = (shares_of_script(study, script)[policy] for study in studies)
        texts = (section.bracketed(share, 2, [1.0]) for share in shares)
        yield f"`{policy}` / `{script}`", *texts


def write(
    worlds: Sequence[Results],
    **tables: tuple[Sequence[str], Callable[[Results], Iterable[Sequence[str]]]],
) -> None:
    """Write tables of some worlds into the page: of each, its columns and the rows of a world."""
    seeds = "; ".join(f"{results.world.name}: {results.world.n_seeds}" for results in worlds)
    line = f"Seeds from 560,000 on, the same for both engines ({seeds}); intervals of 95 %."
    blocks = {
        f"bodies {name}": table(head, [row for results in worlds for row in rows(results)], line)
        for name, (head, rows) in tables.items()
    }
    rewrite(PAGE, blocks)


def main() -> None:
    """Play what is missing, then write the tables of docs/bodies.md, those of `REALISTIC` first."""
    engines = "P, `chipmunk`", "P, the other engine"
    contacts = "contacts a robot-minute, `chipmunk`", "the other engine"
    columns = "world", "policy", "condition", *engines, "change of P", *contacts
    write(
        [played(REALISTIC)],
        realistic=(columns, p_rows),
        share=(("P of two policies", "`chipmunk`", "the other engine"), share_rows),
    )
    write(
        [played(world) for world in OTHERS],
        p=(columns, p_rows),
        order=(("world", "difference", *engines, "order"), order_rows),
        r=(("world", "policy", "fault", "R, `chipmunk`", "R, the other engine"), r_rows),
    )


if __name__ == "__main__":
    main()
