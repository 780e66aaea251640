"""The benchmark of robustness: a table by cell, the worst one, and a place among the entries."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from more_itertools import map_reduce

from swarm_logistics_env import spi
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.spi.estimate import LEAST_TRAININGS
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study.questions.comparison import CONFIDENCE, Arm, Comparison
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.study.verdicts.verdict import Verdict

from .section import NOTHING, P_LEVEL, Section, Texts, bracketed, mean_p, percent, ratio
from .tables import CONTACTS_HEADING, contacts_text

STUDY = "benchmark"
# P of the local scripts in each world, and scores of policies; `research/play_tables.py` writes it.
ENTRIES = Path(__file__).parent / "benchmark_entries.json"
HELD_OUT = "Held out"  # how the titles of its tables begin that give the score
RESAMPLES = 2_000


@dataclass(frozen=True)
class Entries:
    """What a policy is set beside.

    Attributes:
        references: world -> P of the local script that delivers the most in it, without a fault
            [items].
        scores: policy -> its `score`, (K, n) or (n,).
    """

    references: Mapping[str, float]
    scores: Mapping[str, Numbers]

    @classmethod
    def read(cls) -> Entries:
        """Return the entries that the package has."""
        recorded = json.loads(ENTRIES.read_text(encoding="utf-8"))
        scores = {name: np.array(score) for name, score in recorded["scores"].items()}
        return cls(recorded["references"], scores)

    def write(self) -> None:
        """Make them the entries that the package has."""
        scores = {name: np.asarray(score).tolist() for name, score in self.scores.items()}
        text = json.dumps({"references": dict(self.references), "scores": scores})
        ENTRIES.write_text(text + "\n", encoding="utf-8")


def table(results: StudyResults, references: Mapping[str, float]) -> Section:
    """Return P, contacts, S, R or A, and FT of every condition, those of a title together."""
    level = results.level
    rows: list[Texts] = []
    shown: set[str] = set()  # the sound swarm is the original condition of most titles
    by_title: dict[str, list[Verdict]] = map_reduce(
        results.verdicts, lambda verdict: verdict.compared.table
    )
    for title, verdicts in by_title.items():
        rows.append((title, "", "", "", ""))
        original = verdicts[0].compared.original
        if original.case.key not in shown:
            shown.add(original.case.key)
            cell = results.cells_of(verdicts[0].compared)[original]
            rows.append((f"  {original.setting}", mean_p(cell), contacts_text(cell), "", ""))
        by_arm: dict[Arm, list[Verdict]] = map_reduce(verdicts, lambda v: v.compared.changed)
        for changed, of_arm in by_arm.items():
            by_symbol = {verdict.compared.indicator: verdict for verdict in of_arm}
            tolerance = by_symbol.pop("FT", None)
            indicators = [f"{symbol} {ratio(v, level)}" for symbol, v in by_symbol.items()]
            cell = results.cells_of(of_arm[0].compared)[changed]
            ft = NOTHING if tolerance is None else ratio(tolerance, level)
            p = mean_p(cell)
            contacts = contacts_text(cell)
            rows.append((f"  {changed.setting}", p, contacts, "; ".join(indicators), ft))
    return Section(
        f"{results.policies[0]}: benchmark of robustness",
        (
            "condition",
            f"P [{P_LEVEL}]",
            CONTACTS_HEADING,
            f"S, R or A [{percent(level)}]",
            f"FT [{percent(level)}]",
        ),
        tuple(rows),
        tuple(_notes(results, references)),
    )


def _notes(results: StudyResults, references: Mapping[str, float]) -> Iterator[str]:
    verdict, share = worst(results)
    cells = results.cells_of(verdict.compared)
    changed = cells[verdict.compared.changed]
    original = cells[verdict.compared.original]
    yield (
        f"Worst cell: {verdict.compared.table}, {changed.words}: P {mean_p(changed)}, {share:.0%} "
        f"of {mean_p(original)}."
    )
    held_out = bracketed(spi.mean_interval(score(results, references), CONFIDENCE), 2)
    yield (
        f"Score {held_out}, {P_LEVEL} interval: the mean share of the best local script's P, over "
        f"the {len(_held_out(results))} held-out cells."
    )


def worst(results: StudyResults) -> tuple[Verdict, float]:
    """Return the comparison whose P is the least share of its original condition's, and the share.

    Swarm sizes are left out: a small swarm delivers less by itself.

    Raises:
        StudyError: no comparison has its runs.
    """
    shares = []
    for verdict in results.verdicts:
        if verdict.estimate is not None and verdict.after.kind != "size":
            comparison = verdict.compared
            cells = results.cells_of(comparison)
            share = cells[comparison.changed].mean.value / cells[comparison.original].mean.value
            shares.append((verdict, share))
    if not shares:
        raise StudyError("no comparison of the benchmark has its runs: all of them failed")
    return min(shares, key=lambda verdict_and_share: verdict_and_share[1])


def score(results: StudyResults, references: Mapping[str, float]) -> Numbers:
    """Return the mean share of the best local script's P over the held-out conditions.

    Args:
        references: of `Entries`.

    Returns:
        The score of every training and seed, (K, n) or (n,).

    Raises:
        StudyError: runs are missing, or failed.
    """
    shares = []
    for comparison, cell in _held_out(results).items():
        if cell.problem:
            raise StudyError(f"{comparison.label}: {cell.problem}, so there is no score")
        shares.append(cell.by_seed / references[_world_of(comparison)])
    return np.asarray(np.mean(shares, axis=0))


def best_scripts(studies: Sequence[StudyResults]) -> dict[str, tuple[str, Cell]]:
    """Return by world which script delivers the most in it without a fault, and its runs.

    Args:
        studies: the benchmark's study of each local script.
    """
    best: dict[str, tuple[str, Cell]] = {}
    for results in studies:
        for comparison in _held_out(results):
            world = _world_of(comparison)
            cells = results.cells_of(comparison)
            cell = cells[_sound_arm(comparison)]
            if world not in best or cell.mean.value > best[world][1].mean.value:
                best[world] = results.policies[0], cell
    return best


def _sound_arm(comparison: Comparison) -> Arm:
    """Return the arm without a fault in the world of the changed condition."""
    is_fault = comparison.changed.setting.kind == "fault"
    return comparison.original if is_fault else comparison.changed


def _world_of(comparison: Comparison) -> str:
    """Return the name of the world that a condition is played in."""
    return f"{comparison.table}, {_sound_arm(comparison).setting}"


def contacts(results: StudyResults) -> str:
    """Return contacts per robot-minute, the mean of the held-out conditions."""
    mean = float(np.mean([cell.contacts.value for cell in _held_out(results).values()]))
    return NOTHING if np.isnan(mean) else f"{mean:.1f}"


def _held_out(results: StudyResults) -> dict[Comparison, Cell]:
    """Return the cell of every held-out condition, by one of its comparisons."""
    comparisons = {
        verdict.compared.changed: verdict.compared
        for verdict in results.verdicts
        if verdict.compared.table.startswith(HELD_OUT)
    }
    return {c: results.cells_of(c)[changed] for changed, c in comparisons.items()}


def leaderboard(entries: Mapping[str, Numbers]) -> Section:
    """Return the table of entries by score, and how stable that order is.

    Seeds are resampled for all entries together, as they are played over the same ones, trainings
    for each entry by itself. Only a single training has no spread over trainings. Of two trainings
    or more, but too few for a verdict, resamples tell nothing: such an entry has no rank, and the
    ranks of all others are among themselves.

    Args:
        entries: name to scores, (K, n) or (n,), each over the same n seeds.
    """
    names = sorted(entries, key=lambda name: -float(np.mean(entries[name])))
    ranked = [n for n in names if not 1 < len(np.atleast_2d(entries[n])) < LEAST_TRAININGS]
    ranks = _ranks([np.atleast_2d(entries[name]) for name in ranked])
    of_name = dict(zip(ranked, ranks))
    rows = tuple(
        (
            name,
            bracketed(spi.mean_interval(entries[name], CONFIDENCE), 2),
            *of_name.get(name, ("open", NOTHING)),
        )
        for name in names
    )
    return Section(
        "Benchmark of robustness: entries by score",
        ("policy", f"score [{P_LEVEL}]", f"rank [{P_LEVEL}]", "same rank"),
        rows,
        (
            (
                "Score: P as a share of the best local script's in the same world without a fault, "
                "the mean of the held-out cells."
            ),
            f"Limits of a rank, and how often it is the same: of {RESAMPLES} resamples of both.",
            f"Open: of fewer than {LEAST_TRAININGS} trainings, too few for a rank.",
        ),
    )


def _ranks(scores: Sequence[Numbers]) -> list[tuple[str, str]]:
    """Return the rank of each entry with its limits, and how often it is the same."""
    from scipy.stats import rankdata

    if not scores:
        return []
    ranks = rankdata([-entry.mean() for entry in scores], method="min")
    resampled_ranks = rankdata(-_resampled_means(scores), method="min", axis=1)
    outside = 50.0 * (1.0 - CONFIDENCE)
    ends = outside, 100.0 - outside
    best, worst = np.percentile(resampled_ranks, ends, axis=0, method="nearest").astype(int)
    stability = (resampled_ranks == ranks).mean(axis=0)
    return [
        (f"{rank:.0f} [{low}, {high}]", f"{share:.0%}")
        for rank, low, high, share in zip(ranks, best, worst, stability)
    ]


def _resampled_means(scores: Sequence[Numbers]) -> Numbers:
    """Return the mean score of each entry (columns) in each resample of seeds and trainings."""
    rng = np.random.Generator(np.random.Philox(key=len(scores)))
    n_seeds = min(entry.shape[1] for entry in scores)
    means = []
    for _ in range(RESAMPLES):
        seeds = rng.integers(n_seeds, size=n_seeds)
        resampled = (entry[rng.integers(len(entry), size=len(entry))][:, seeds] for entry in scores)
        means.append([entry.mean() for entry in resampled])
    return np.array(means)
