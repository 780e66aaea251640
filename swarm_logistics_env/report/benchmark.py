"""The benchmark of robustness: a table by cell, the worst one, and a place among the entries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.questions.comparison import CONFIDENCE, Arm
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.verdicts.cell import Cell
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import Verdict

from .section import (
    NOTHING,
    P_LEVEL,
    Section,
    Texts,
    bracketed,
    level_of,
    mean_p,
    percent,
    ratio,
)

STUDY = "benchmark"
HELD_OUT = "Held out"  # how the titles of its tables begin that give the score
RESAMPLES = 2_000


def table(results: StudyResults) -> Section:
    """Return P, S, R or A, and FT of every condition, those of a title together."""
    level = level_of(results.verdicts)
    rows: list[Texts] = []
    shown: set[str] = set()  # the sound swarm is the original condition of most titles
    for title, tests in grouped(results.verdicts, lambda one: one.compared.table).items():
        rows.append((title, "", "", ""))
        first = tests[0].compared
        original = first.original
        if original.case.key not in shown:
            shown.add(original.case.key)
            rows.append(
                (f"  {original.setting}", mean_p(results.cells_of(first)[original]), "", "")
            )
        for changed, found in grouped(tests, lambda one: one.compared.changed).items():
            by_symbol = {test.compared.indicator: test for test in found}
            tolerance = by_symbol.pop("FT", None)
            others = [f"{symbol} {ratio(test, level)}" for symbol, test in by_symbol.items()]
            p = mean_p(results.cells_of(found[0].compared)[changed])
            ft = NOTHING if tolerance is None else ratio(tolerance, level)
            rows.append((f"  {changed.setting}", p, "; ".join(others), ft))
    return Section(
        f"{results.policies[0]}: benchmark of robustness",
        (
            "condition",
            f"P [{P_LEVEL}]",
            f"S, R or A [{percent(level)}]",
            f"FT [{percent(level)}]",
        ),
        tuple(rows),
        tuple(_notes(results)),
    )


def _notes(results: StudyResults) -> Iterator[str]:
    test, share = worst(results)
    cells = results.cells_of(test.compared)
    changed, original = cells[test.compared.changed], cells[test.compared.original]
    yield (
        f"Worst cell: {test.compared.table}, {changed.words}: P {mean_p(changed)}, {share:.0%} of "
        f"{mean_p(original)}."
    )
    held_out = bracketed(spi.mean_interval(score(results), CONFIDENCE), 1)
    yield (
        f"Score: mean P of the {len(_held_out(results))} held-out cells {held_out}, {P_LEVEL} "
        "interval."
    )


def worst(results: StudyResults) -> tuple[Verdict, float]:
    """Return the comparison whose P is the least share of its original condition's, and the share.

    Swarm sizes are left out: a small swarm delivers less by itself.

    Raises:
        StudyError: no comparison has its runs.
    """
    shares = [
        (test, cells[test.compared.changed].mean.value / cells[test.compared.original].mean.value)
        for test in results.verdicts
        if test.estimate is not None and test.after.kind != "size"
        for cells in [results.cells_of(test.compared)]
    ]
    if not shares:
        raise StudyError("no comparison of the benchmark has its runs: all of them failed")
    return min(shares, key=lambda one: one[1])


def score(results: StudyResults) -> Numbers:
    """Return mean P over the held-out conditions, of every training and seed, (K, n) or (n,).

    Raises:
        StudyError: runs are missing, or failed.
    """
    cells = _held_out(results)
    for arm, cell in cells.items():
        if cell.problem:
            raise StudyError(f"{arm.setting}: {cell.problem}, so there is no score")
    return np.asarray(np.mean([cell.by_seed for cell in cells.values()], axis=0))


def _held_out(results: StudyResults) -> dict[Arm, Cell]:
    return {
        test.compared.changed: results.cells_of(test.compared)[test.compared.changed]
        for test in results.verdicts
        if test.compared.table.startswith(HELD_OUT)
    }


def leaderboard(entries: Mapping[str, Numbers]) -> Section:
    """Return the table of entries by score, and how stable that order is.

    Seeds are resampled for all entries together, as they are played over the same ones, trainings
    for each entry by itself. Only a single training has no spread over trainings.

    Args:
        entries: name to scores, (K, n) or (n,), each over the same n seeds.
    """
    from scipy.stats import rankdata

    scores = [np.atleast_2d(one) for one in entries.values()]
    rng = np.random.Generator(np.random.Philox(key=len(entries)))
    n_seeds = min(one.shape[1] for one in scores)
    drawn = []
    for _ in range(RESAMPLES):
        seeds = rng.integers(n_seeds, size=n_seeds)
        resampled = (one[rng.integers(len(one), size=len(one))][:, seeds] for one in scores)
        drawn.append([one.mean() for one in resampled])
    # 1 + how many entries score higher.
    found = rankdata([-one.mean() for one in scores], method="min")
    ranks = rankdata(-np.array(drawn), method="min", axis=1)
    outside = 50.0 * (1.0 - CONFIDENCE)
    ends = outside, 100.0 - outside
    best, worst = np.percentile(ranks, ends, axis=0, method="nearest").astype(int)
    same = (ranks == found).mean(axis=0)
    named = list(entries.items())
    rows = tuple(
        (
            named[one][0],
            bracketed(spi.mean_interval(named[one][1], CONFIDENCE), 1),
            f"{found[one]:.0f} [{best[one]}, {worst[one]}]",
            f"{same[one]:.0%}",
        )
        for one in np.argsort(found, kind="stable")
    )
    return Section(
        "Benchmark of robustness: entries by score",
        ("policy", f"score [{P_LEVEL}]", f"rank [{P_LEVEL}]", "same rank"),
        rows,
        (
            "Score: mean P of the held-out cells, over trainings and seeds.",
            f"Limits of a rank, and how often it is the same: of {RESAMPLES} resamples of both.",
        ),
    )
