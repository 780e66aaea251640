"""Blocks and pairs: which trials of a file belong together, and which have no partner."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

from swarm_logistics_env.spi.inputs import IndicatorError

from .table import Row, Table
from .trial import Trial


def numbered_blocks(rows: Sequence[Row]) -> dict[str, int]:
    """Return a number for each block, in the file's order; none where blocks are numbers."""
    if all(row.is_numbered_block() for row in rows):
        return {}
    names = dict.fromkeys(row.text("seed") for row in rows if row.text("seed"))
    return {name: number for number, name in enumerate(names)}


def paired_within_blocks(trials: Sequence[Trial]) -> list[Trial]:
    """Return trials with a pair of their own where a block holds several of a condition.

    Within a block, as a day or a map, trials are alike but for chance: the first of one condition
    is paired with the first of another, in the file's order.
    """
    counts: Counter[tuple[object, int | None]] = Counter()
    pairs: dict[tuple[int | None, int], int] = {}
    paired = []
    for trial in trials:
        key = trial.condition, trial.seed
        pair = pairs.setdefault((trial.seed, counts[key]), len(pairs))
        counts[key] += 1
        paired.append(replace(trial, seed=pair))
    return paired


def holds_several(trials: Sequence[Trial]) -> bool:
    """Return whether some block holds several trials of a condition, and each is in a block."""
    if any(trial.seed is None for trial in trials):
        return False
    keys = [(trial.condition, trial.seed) for trial in trials]
    return len({*keys}) < len(keys)


def check_pairing(table: Table, trials: Sequence[Trial]) -> None:
    """Refuse runs without a seed beside others, and two of one seed in a condition.

    Raises:
        IndicatorError: there are some.
    """
    if all(trial.seed is None for trial in trials):
        return
    conditions: dict[object, dict[int | None, Trial]] = {}
    for trial in trials:
        location = f"{table.source}, {table.line_word} {trial.line}"
        if trial.seed is None:
            raise IndicatorError(
                f"{location}: has no seed, as other rows have: give every run one, or leave "
                "the column out"
            )
        of_seed = conditions.setdefault(trial.condition, {})
        if (first := of_seed.setdefault(trial.seed, trial)) is not trial:
            raise IndicatorError(
                f"{location}: has seed {trial.seed} like line {first.line}, two rows of one "
                "seed in one condition: should be one, or leave the column out"
            )


def notes_on_pairs(trials: Sequence[Trial], block: str) -> Iterator[str]:
    """Yield which policies have less than all blocks, and how many runs have no partner.

    Args:
        block: what the file calls a seed.
    """
    every = {trial.seed for trial in trials} - {None}
    by_table: dict[tuple[str, str], dict[object, set[int | None]]] = {}
    for trial in trials:
        conditions = by_table.setdefault((trial.policy, trial.table), {})
        conditions.setdefault(trial.condition, set()).add(trial.seed)
    for (policy, table), conditions in by_table.items():
        title = f"{policy}, {table}" if table else policy
        in_any, in_all = set.union(*conditions.values()), set.intersection(*conditions.values())
        if len(in_any) < len(every):
            yield f"{title} has runs of {len(in_any)} of the file's {len(every)} blocks ({block})."
        alone = sum(len(seeds - in_all) for seeds in conditions.values())
        if alone:
            yield (
                f"{title}: no partner of the same {block} in some condition for {alone} of its "
                "runs: they count for P, and are left out where such a condition is compared."
            )
