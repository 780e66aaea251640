"""References: the value of a parameter that A is relative to, which no order of rows decides."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence

from swarm_logistics_env.spi.inputs import IndicatorError

from .table import Columns
from .trial import NO_FAULT_WORD, Trial


def references_of(
    columns: Columns, trials: Sequence[Trial], named: Mapping[str, float]
) -> Iterator[tuple[str, str, float]]:
    """Yield table, parameter and the value that A is relative to, where it is settled.

    It is what somebody names, or the value in the condition without a fault that has most trials,
    over all policies. Where several conditions have as many and differ in it, nothing settles it.

    Args:
        columns: that the trials were read from.
        named: the parameters whose reference somebody names.

    Raises:
        IndicatorError: something named is no parameter, or no trial without a fault has the value.
    """
    varying = [cells.name for cells in columns.parameters]
    plain = [trial for trial in trials if trial.fault == NO_FAULT_WORD]
    for name, value in named.items():
        if name not in varying:
            raise IndicatorError(
                f"--reference {name}={value:g}: {columns.table.source} has no parameter {name!r} "
                f"that varies, but {', '.join(map(repr, varying)) or 'none'}"
            )
        values = sorted({dict(trial.parameters)[name] for trial in plain})
        if value not in values:
            raise IndicatorError(
                f"--reference {name}={value:g}: no trial without a fault has it: should be one of "
                f"{', '.join(f'{x:g}' for x in values)}"
            )
    for table in sorted({trial.table for trial in plain}):
        counts: Counter[tuple[int | None, tuple[tuple[str, float], ...]]] = Counter()
        for trial in plain:
            if trial.table == table:
                counts[trial.n_robots, trial.parameters] += trial.n_trials
        most = max(counts.values())
        frequent = [dict(values) for (_, values), count in counts.items() if count == most]
        for name in varying:
            candidates = {values[name] for values in frequent}
            if name in named:
                yield table, name, named[name]
            elif len(candidates) == 1:
                yield table, name, candidates.pop()


def notes_on_references(
    references: Iterable[tuple[str, str, float]], named: Mapping[str, float]
) -> Iterator[str]:
    """Yield which reference is taken where nobody names it."""
    for table, name, value in references:
        if name not in named:
            prefix = f"{table}: " if table else ""
            yield (
                f"{prefix}A is relative to {name} = {value:g}, as most trials without a fault have "
                "it; --reference names another."
            )
