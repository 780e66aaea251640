"""The tables of the benchmark, which `play_tables.py` writes, and the entries that `judge` has."""

from collections.abc import Sequence
from pathlib import Path

from research.tables import ROOT, seeds_from, table
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.benchmark_cells import benchmark_study, entry_digest
from swarm_logistics_env.study.report import benchmark, section
from swarm_logistics_env.study.verdicts.results import StudyResults

# Local scripts, with central control, then learned; the reference, `homing-stock`, has score 1.
POLICIES = (
    "swarm-dt", "swarm-dt-follow", "biased-walk", "site-fidelity", "homing", "central",
    "central-stock", "ppo-delivery@all", "ppo-robust@all",
)  # fmt: skip
# Other people's learners, where `make interop` has trained them; each in its largest world.
LEARNERS = ("sb3-ppo-paper", "benchmarl-ippo-paper", "torchrl-ppo-small", "benchmarl-mappo-small")
SHOWN = "ppo-robust"  # whose cells stand in a table


def benchmark_studies(out: Path) -> tuple[Study, ...]:
    """Return the benchmark's study of each policy, in folders that name its digest."""
    folder = ROOT / "results" / "interop"
    learners = [
        f"{folder / name}@all.safetensors"
        for name in LEARNERS
        if (folder / f"{name}@0.safetensors").exists()
    ]
    studies = []
    for policy in map(PolicySpec.of, (*POLICIES, *learners)):
        name = section.slug(policy.title, entry_digest(policy)[:8])
        directory = out / "benchmark" / name
        studies.append(Study(out=directory, **dict(benchmark_study(policy))))
    return tuple(studies)


def benchmark_blocks(studies: Sequence[StudyResults]) -> dict[str, str]:
    """Return the blocks of the page; note the entries for `judge`."""
    entries = {
        results.policies[0]: benchmark.Entry.of(
            results, entry_digest(results.plan.specification.policies[0])
        )
        for results in studies
    }
    benchmark.write_entries(entries)
    board = benchmark.leaderboard(entries)
    rows = [(f"`{name}`", *columns) for name, *columns in board.rows]
    seeds = f"{seeds_from(studies[0])}, of each training."
    blocks = {"benchmark": table(board.columns, rows, f"{seeds} {' '.join(board.lines)}")}
    for results in studies:
        name = results.policies[0]
        if name.startswith(SHOWN):
            cells = benchmark.table(results, entries[name])
            lines = f"`{name}`, {seeds} {' '.join(cells.lines)}"
            blocks["cells"] = table(cells.columns, cells.rows, lines)
    return blocks
