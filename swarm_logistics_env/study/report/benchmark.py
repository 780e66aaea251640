"""The benchmark of robustness: a table by cell, the score, and a place among the entries.

The share of a cell is P of the entry over P of the reference, both means over the same seeds. P
counts as `LEAST_P` at least, and a share lies between `FLOOR` and 1 / `FLOOR`, so that no single
cell decides, whoever fails in it. The score is the geometric mean of the shares of the held-out
cells: scores of two policies over each other are reciprocal.

Its interval is that of the mean logarithm over cells, which are draws from a declared space; of
several trainings over cells and trainings, which are crossed. The seeds of the entry and of the
reference are in the spread between cells, so that the reference's own error is in the interval;
it would count twice if seeds were resampled as well.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from swarm_logistics_env import spi
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.spi.estimate import LEAST_TRAININGS
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.spi.summaries import interval_of_mean
from swarm_logistics_env.study.questions.benchmark_cells import (
    DEVELOPMENT,
    EDITION,
    HELD_OUT,
    N_CELLS,
    REFERENCE,
    words_of,
)
from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults

from .section import NOTHING, P_LEVEL, Section, Texts, bracketed, mean_p
from .tables import CONTACTS_HEADING, contacts_text

LEAST_P = 1.0  # that a mean counts as [items]
FLOOR = 0.05  # of the share of a cell
# What is known of the policies that were played; `research/play_tables.py` writes it.
ENTRIES = Path(__file__).parent / "benchmark_entries.json"
RESAMPLES = 2_000  # of cells and trainings, for ranks
COLUMNS = (
    "policy", f"score [{P_LEVEL}]", f"rank [{P_LEVEL}]", "same rank", "development",
    CONTACTS_HEADING.partition(" [")[0], "runs that stand still", "least share", "digest",
)  # fmt: skip


class PlayedCell(NamedTuple):
    """A cell of the benchmark: a policy's runs, and the reference's at the same seeds."""

    title: str  # with its world and fault
    entry: Cell
    reference: Cell

    @property
    def shares(self) -> Numbers:
        """The share of P of each training, shape (K,); K is 1 for a single policy."""
        p = np.atleast_2d(self.entry.by_seed).mean(axis=1)
        return share(p, self.reference.by_seed.mean())

    @property
    def still(self) -> float:
        """Share of the policy's runs that stand still."""
        return float(np.mean([bool(run.stands_still) for run in self.entry.outcomes]))

    @property
    def row(self) -> Texts:
        """Title, P of both, share, contacts and runs that stand still."""
        return (
            self.title,
            mean_p(self.entry),
            mean_p(self.reference),
            f"{np.exp(np.log(self.shares).mean()):.2f}",
            contacts_text(self.entry),
            _in_percent(self.still),
        )


def share(p: Numbers, reference: Numbers) -> Numbers:
    """Return P as a share of the reference's P, see the module.

    Args:
        p: mean P over seeds, 0 or more [items], any shape.
        reference: that of the reference, of a shape that goes with it.
    """
    ratio = np.maximum(p, LEAST_P) / np.maximum(reference, LEAST_P)
    return np.clip(ratio, FLOOR, 1.0 / FLOOR)


def played_cells(results: StudyResults, half: str) -> list[PlayedCell]:
    """Return the cells of a half, DEVELOPMENT or HELD_OUT, in their order.

    Raises:
        StudyError: runs are missing, or failed.
    """
    words = {cell.title: words_of(cell) for cell in results.plan.specification.ablations}
    played = []
    for verdict in results.verdicts:
        comparison = verdict.compared
        if comparison.table.startswith(half):
            for cell in verdict.cells.values():
                if cell.problem:
                    problem = f"{cell.arm.setting.name}, {comparison.table}: {cell.problem}"
                    raise StudyError(f"{problem}, so there is no score")
            pair = verdict.cells[comparison.original], verdict.cells[comparison.changed]
            title = f"{comparison.table}: {words[comparison.table]}"
            played.append(PlayedCell(title, *pair))
    return played


class Entry(Record):
    """What is kept of a policy that was played.

    Args:
        digest: from which its held-out cells were drawn; empty: the reference.
        held_out, development: the share of each training (rows) in each cell.
        contacts: per robot-minute, the mean of the held-out cells; None: of the reference.
        standing_still: share of the runs in held-out cells that stand still; None: as contacts.
    """

    error_type = StudyError

    digest: str
    held_out: tuple[tuple[float, ...], ...]
    development: tuple[tuple[float, ...], ...]
    contacts: float | None = None
    standing_still: float | None = None

    @classmethod
    def of(cls, results: StudyResults, digest: str) -> Self:
        """Return what the runs of a policy say.

        Raises:
            StudyError: runs are missing, or failed.
        """
        held_out = played_cells(results, HELD_OUT)
        return cls(
            digest=digest,
            held_out=_table_of_shares(held_out),
            development=_table_of_shares(played_cells(results, DEVELOPMENT)),
            contacts=np.mean([cell.entry.contacts.value for cell in held_out]).item(),
            standing_still=np.mean([cell.still for cell in held_out]).item(),
        )

    @classmethod
    def of_reference(cls) -> Self:
        """Return the reference, whose share is 1 in whatever cells."""
        held_out, development = ((1.0,) * N_CELLS[half] for half in (HELD_OUT, DEVELOPMENT))
        return cls(digest="", held_out=(held_out,), development=(development,))

    @property
    def score(self) -> spi.Interval:
        """Geometric mean of the held-out shares with its interval at `CONFIDENCE`."""
        return geometric_mean(self.held_out)

    @property
    def development_score(self) -> spi.Interval:
        """The same of the shares for development."""
        return geometric_mean(self.development)

    @property
    def by_cell(self) -> Numbers:
        """Share of every held-out cell, of several trainings the geometric mean."""
        return np.asarray(np.exp(np.log(self.held_out).mean(axis=0)))


def _table_of_shares(cells: Sequence[PlayedCell]) -> tuple[tuple[float, ...], ...]:
    """Return the share of each training (rows) in each cell (columns)."""
    rows = np.stack([cell.shares for cell in cells], axis=1)
    return tuple(map(tuple, rows.tolist()))


def geometric_mean(shares: Sequence[Sequence[float]]) -> spi.Interval:
    """Return the geometric mean with its interval at `CONFIDENCE`, over columns and rows.

    Args:
        shares: above 0, of trainings (rows) in cells (columns).
    """
    mean, low, high = interval_of_mean(np.log(shares), CONFIDENCE)
    limits = (None if limit is None else float(np.exp(limit)) for limit in (low, high))
    return spi.Interval(float(np.exp(mean)), *limits)


def read_entries() -> dict[str, Entry]:
    """Return the entries that the package has, by the title of the policy."""
    recorded = json.loads(ENTRIES.read_text(encoding="utf-8"))
    return {name: Entry(**fields) for name, fields in recorded.items()}


def write_entries(entries: Mapping[str, Entry]) -> None:
    """Make them the entries that the package has."""
    recorded = {name: entry.model_dump(mode="json") for name, entry in entries.items()}
    ENTRIES.write_text(json.dumps(recorded, indent=1) + "\n", encoding="utf-8")


def table(results: StudyResults, entry: Entry) -> Section:
    """Return P, the reference's P, the share, contacts and standstills of every cell."""
    held_out = played_cells(results, HELD_OUT)
    cells = [*played_cells(results, DEVELOPMENT), *held_out]
    worst = int(entry.by_cell.argmin())
    return Section(
        f"{results.policies[0]}: benchmark of robustness, edition {EDITION}",
        (
            "cell",
            f"P [{P_LEVEL}]",
            f"P of {REFERENCE} [{P_LEVEL}]",
            "share",
            CONTACTS_HEADING,
            "runs that stand still",
        ),
        tuple(cell.row for cell in cells),
        (
            (
                f"Score {bracketed(entry.score, 2)}, {P_LEVEL} interval over cells: the geometric "
                f"mean of the shares of {len(held_out)} held-out cells, which were drawn from the "
                f"policy's digest {entry.digest[:8]}. Development: "
                f"{bracketed(entry.development_score, 2)}."
            ),
            f"Worst cell, share {entry.by_cell[worst]:.2f}: {held_out[worst].title}.",
            f"In held-out cells {_in_percent(entry.standing_still)} of the runs stand still.",
        ),
    )


def _in_percent(part: float | None) -> str:
    return NOTHING if part is None else f"{part:.0%}"


def leaderboard(entries: Mapping[str, Entry]) -> Section:
    """Return the table of entries by score, the reference among them, and how stable it is.

    Cells are resampled for each entry by itself, as its held-out cells are its own, and so are
    trainings. Of two trainings or more, but too few for a verdict, resamples tell nothing: such an
    entry has no rank, and the ranks of all others are among themselves.
    """
    entries = {**entries, REFERENCE: Entry.of_reference()}
    names = sorted(entries, key=lambda name: -entries[name].score.value)
    ranked = [n for n in names if not 1 < len(entries[n].held_out) < LEAST_TRAININGS]
    ranks = _ranks([np.log(entries[name].held_out) for name in ranked])
    of_name = dict(zip(ranked, ranks))
    rows = []
    for name in names:
        entry = entries[name]
        contacts = NOTHING if entry.contacts is None else f"{entry.contacts:.1f}"
        rows.append(
            (
                name,
                bracketed(entry.score, 2),
                *of_name.get(name, ("open", NOTHING)),
                bracketed(entry.development_score, 2),
                contacts,
                _in_percent(entry.standing_still),
                f"{entry.by_cell.min():.2f}",
                entry.digest[:8] or NOTHING,
            )
        )
    return Section(
        f"Benchmark of robustness, edition {EDITION}: entries by score",
        COLUMNS,
        tuple(rows),
        (
            (
                f"Score: P as a share of that of {REFERENCE} in the same cell, the geometric mean "
                "of the held-out cells, which differ from entry to entry; development: of the "
                "cells that all share."
            ),
            f"Limits of a rank, and how often it is the same: of {RESAMPLES} resamples.",
            f"Open: of fewer than {LEAST_TRAININGS} trainings, too few for a rank.",
        ),
    )


def _ranks(logarithms: Sequence[Numbers]) -> list[tuple[str, str]]:
    """Return the rank of each entry with its limits, and how often it is the same."""
    from scipy.stats import rankdata

    ranks = rankdata([-entry.mean() for entry in logarithms], method="min")
    resampled_ranks = rankdata(-_resampled_means(logarithms), method="min", axis=1)
    outside = 50.0 * (1.0 - CONFIDENCE)
    ends = outside, 100.0 - outside
    best, worst = np.percentile(resampled_ranks, ends, axis=0, method="nearest").astype(int)
    stability = (resampled_ranks == ranks).mean(axis=0)
    return [
        (f"{rank:.0f} [{low}, {high}]", f"{share_of_resamples:.0%}")
        for rank, low, high, share_of_resamples in zip(ranks, best, worst, stability)
    ]


def _resampled_means(logarithms: Sequence[Numbers]) -> Numbers:
    """Return the mean of each entry (columns) in each resample of its cells and trainings."""
    rng = np.random.Generator(np.random.Philox(key=len(logarithms)))
    columns = []
    for entry in logarithms:
        n_trainings, n_cells = entry.shape
        rows = rng.integers(n_trainings, size=(RESAMPLES, n_trainings, 1))
        cells = rng.integers(n_cells, size=(RESAMPLES, 1, n_cells))
        columns.append(entry[rows, cells].mean(axis=(1, 2)))
    return np.stack(columns, axis=1)
