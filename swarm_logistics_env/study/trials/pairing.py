"""Blocks and pairs: which trials of a file belong together, and which have no partner."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import fsum
from shlex import quote

from more_itertools import map_reduce

from swarm_logistics_env.spi.inputs import IndicatorError

from .table import Columns, Table
from .trial import Trial


def paired_by_blocks(columns: Columns, trials: Sequence[Trial]) -> tuple[list[Trial], list[str]]:
    """Return the trials of which each block has one in a condition, and notes on how.

    Args:
        columns: that the trials were read from.

    Raises:
        IndicatorError: some trials have no seed, or two of a condition have the same one.
    """
    block = columns.by_meaning["seed"].name if columns.blocks else "seed"
    _check_seeds(columns.table, trials, of_seeds=columns.has_seeds)
    means, notes = _one_trial_a_block(trials, block)
    notes += _notes_on_joined(columns)
    notes += _notes_on_partners(means, block)
    return means, notes


def _one_trial_a_block(trials: Sequence[Trial], block: str) -> tuple[list[Trial], list[str]]:
    """Return one trial for each block and condition, the mean of those that it holds, and notes.

    What a block has, as a map that makes a fault cost more, all its trials share. They are no
    independent pairs: the block is the unit, whether it holds few trials or many.

    Args:
        block: what the file calls a block.
    """
    if trials[0].seed is None:
        return [*trials], []
    groups: dict[object, list[Trial]] = map_reduce(trials, lambda row: (row.condition, row.seed))
    counts = sorted({len(group) for group in groups.values()})
    if counts[-1] == 1:
        return [*trials], []
    if len({trial.seed for trial in trials}) == 1:
        note = f"All trials are of one {block}: they are not paired, and tell of no other {block}."
        return [replace(trial, seed=None) for trial in trials], [note]
    means = [_mean_of(group) for group in groups.values()]
    several = f"{counts[0]} to {counts[-1]}" if len(counts) > 1 else f"{counts[0]}"
    note = (
        f"{several} trials of one {block} and condition count as one trial, their mean, as they "
        f"share what differs between blocks; every {block} counts alike."
    )
    notes = [note]
    if any(trial.times is not None for trial in trials):
        notes.append("The times of their deliveries are left out.")
    return means, notes


def _mean_of(trials: Sequence[Trial]) -> Trial:
    """Return the mean of a block's trials in one condition, as a trial."""
    if len(trials) == 1:
        return trials[0]
    contacts = [trial.contacts for trial in trials if trial.contacts is not None]
    durations = {trial.duration for trial in trials}
    least = [trial.performance if trial.least is None else trial.least for trial in trials]
    is_known = all(trial.least is None for trial in trials)
    # By exact sums, which are the same in any order.
    return replace(
        min(trials, key=lambda trial: trial.line),
        performance=fsum(trial.performance for trial in trials) / len(trials),
        times=None,
        duration=durations.pop() if len(durations) == 1 else None,
        contacts=fsum(contacts) / len(contacts) if contacts else None,
        n_trials=len(trials),
        least=None if is_known else fsum(least) / len(trials),
    )


def _notes_on_joined(columns: Columns) -> Iterator[str]:
    """Yield which column of several that make a block has values that blocks share."""
    names = [cells.name for cells in columns.blocks]
    if len(names) < 2:
        return
    n_blocks = len({*zip(*(cells.texts for cells in columns.blocks))})
    for cells in columns.blocks:
        n_values = len({*cells.texts})
        if 1 < n_values < n_blocks and cells.name not in columns.seeds:
            left_out = " ".join(f"--ignore {quote(name)}" for name in names if name != cells.name)
            yield (
                f"Pairs are of one {columns.by_meaning['seed'].name}, so verdicts are of the "
                f"{n_values} values of {cells.name!r} alone; {left_out} compares their means, for "
                "all such values."
            )


def _check_seeds(table: Table, trials: Sequence[Trial], *, of_seeds: bool) -> None:
    """Refuse runs without a seed beside others, and two of one seed in a condition.

    Args:
        of_seeds: whether a condition has one run of each, which blocks need not have.
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
        if (first := of_seed.setdefault(trial.seed, trial)) is not trial and of_seeds:
            raise IndicatorError(
                f"{location}: has seed {trial.seed} like line {first.line}, two rows of one "
                "seed in one condition: should be one; where it names what several trials share, "
                "as a map does, say --column block=NAME"
            )


def _notes_on_partners(trials: Sequence[Trial], block: str) -> Iterator[str]:
    """Yield which policies have less than all blocks, and how many runs have no partner.

    Args:
        block: what the file calls a seed.
    """
    every = {trial.seed for trial in trials} - {None}
    by_table: dict[tuple[str, str], dict[object, set[int | None]]] = {}
    for trial in trials:
        conditions = by_table.setdefault((trial.policy, trial.table), {})
        conditions.setdefault(trial.condition, set()).add(trial.seed)
    for (policy, table), conditions in sorted(by_table.items()):
        title = f"{policy}, {table}" if table else policy
        in_any = set.union(*conditions.values())
        in_all = set.intersection(*conditions.values())
        if len(in_any) < len(every):
            yield f"{title} has runs of {len(in_any)} of the file's {len(every)} blocks ({block})."
        alone = sum(len(seeds - in_all) for seeds in conditions.values())
        if alone:
            yield (
                f"{title}: no partner of the same {block} in some condition for {alone} of its "
                "runs: they count for P, and are left out where such a condition is compared."
            )
