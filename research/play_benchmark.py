"""The tables of the benchmark, which `play_tables.py` writes, and the entries that `judge` has."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from research.tables import ROOT, seeds_from, table
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report import benchmark, section
from swarm_logistics_env.study.report.tables import CONTACTS_HEADING, contacts_text
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults

# Local scripts, the last with the stock that pays on robots of the preset `realistic`.
STOCK = PolicySpec(
    name="homing-stock", parameters={"near": 1.2, "far": 1.6}, label="homing-stock, near"
)
LOCAL = ("swarm-dt", "swarm-dt-follow", "homing", "homing-stock", STOCK)
# With central control, then learned.
OTHERS = ("central", "central-stock", "ppo-delivery@all", "ppo-robust@all")
# Other people's learners, where `make interop` has trained them; each in its largest world.
LEARNERS = ("sb3-ppo-paper", "benchmarl-ippo-paper", "torchrl-ppo-small", "benchmarl-mappo-small")
SHOWN = "ppo-robust"  # whose cells stand in a table

Cells = dict[tuple[str, str], Cell]  # a study's, by title and condition


def benchmark_studies(out: Path) -> tuple[Study, ...]:
    """Return the benchmark's study of each policy, in folders: of local scripts first."""
    folder = ROOT / "results" / "interop"
    learners = [
        f"{folder / name}@all.safetensors"
        for name in LEARNERS
        if (folder / f"{name}@0.safetensors").exists()
    ]
    studies = []
    policies: list[str | PolicySpec] = [*LOCAL, *OTHERS, *learners]
    for policy in policies:
        title = policy.title if isinstance(policy, PolicySpec) else policy
        directory = out / "benchmark" / section.slug(Path(title).stem)
        studies.append(Study.preset(benchmark.STUDY, out=directory, policies=[policy]))
    return tuple(studies)


def benchmark_blocks(studies: Sequence[StudyResults], n_local: int = len(LOCAL)) -> dict[str, str]:
    """Return the blocks of the page; note the entries for `judge`.

    Args:
        n_local: the number of studies of local scripts, which come first.
    """
    scripts = studies[:n_local]
    best = benchmark.best_scripts(scripts)
    references = {world: cell.mean.value for world, (_, cell) in best.items()}
    scores = {results.policies[0]: benchmark.score(results, references) for results in studies}
    benchmark.Entries(references, scores).write()
    blocks = {"benchmark": _leaderboard(studies, scores)}
    shown = [results for results in studies if results.policies[0].startswith(SHOWN)]
    if shown:
        blocks["cells"] = _cells(shown[0], scripts)
    return blocks


def _leaderboard(studies: Sequence[StudyResults], scores: Mapping[str, Numbers]) -> str:
    """Return the entries by score, with every entrant's contacts and worst cell."""
    board = benchmark.leaderboard(scores)
    worst_cells = {}
    contacts = {}
    for results in studies:
        test, share = benchmark.worst(results)
        worst_cells[results.policies[0]] = f"{test.compared.table}, {test.after}: {share:.0%}"
        contacts[results.policies[0]] = benchmark.contacts(results)
    return table(
        (*board.columns, CONTACTS_HEADING, "worst cell, share of P without it"),
        [
            (f"`{name}`", *columns, contacts[name], worst_cells[name])
            for name, *columns in board.rows
        ],
        f"{seeds_from(studies[0])}, of each training. {' '.join(board.lines)}",
    )


def _cells(shown: StudyResults, scripts: Sequence[StudyResults]) -> str:
    """Return P of one policy in every condition, beside that of the best local script there."""
    cells = _by_condition(shown)
    of_scripts = [_by_condition(results) for results in scripts]
    rows: list[tuple[object, ...]] = []
    for condition, cell in cells.items():
        best = max((script[condition] for script in of_scripts), key=lambda c: c.mean.value)
        best_p = f"{section.mean_p(best)} `{best.policy}`"
        share = f"{cell.mean.value / best.mean.value:.2f}"
        name = ", ".join(condition)
        rows.append((name, section.mean_p(cell), best_p, share, contacts_text(cell)))
    return table(
        (
            "condition",
            f"P of `{shown.policies[0]}` [{section.P_LEVEL}]",
            f"P of the best local script [{section.P_LEVEL}]",
            "share",
            CONTACTS_HEADING,
        ),
        rows,
        f"{seeds_from(shown)}, of each training.",
    )


def _by_condition(results: StudyResults) -> Cells:
    """Return the cells of a study by title and condition, the sound swarm of a title once."""
    by_condition: Cells = {}
    shown = set()
    for verdict in results.verdicts:
        comparison = verdict.compared
        for arm, cell in results.cells_of(comparison).items():
            if arm is not comparison.removed and arm.case.key not in shown:
                shown.add(arm.case.key)
                by_condition[comparison.table, str(arm.setting)] = cell
    return by_condition
