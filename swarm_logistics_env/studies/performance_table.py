"""The table of performances: one row for each policy and condition of a study."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    NamedTuple,
    TypeAlias,
    TypeVar,
    get_args,
    get_type_hints,
)

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.spi.definitions import Factor
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.tasks.task import Outcome

from .comparisons import Arm, Reference
from .plan import Plan

if TYPE_CHECKING:
    import pandas as pd

Columns = Mapping[str, tuple[type, str]]  # name to type and meaning
Kind = TypeVar("Kind")


@dataclass(frozen=True, eq=False)
class Cell:
    """P of one policy under one condition; a number that is missing is NaN."""

    policy: Annotated[str, "label of the policy"]
    table: Annotated[str, "heading of the report's table"]
    cell: Annotated[str, "the condition in words, e.g. N = 10"]
    kind: Annotated[Factor, "what is varied: size, fault, parameter or policy"]
    factor: Annotated[str, "its name: n_robots, a failure mode, a parameter, or a policy"]
    value: Annotated[float, "swarm size N, faulty robots m, or the parameter's value in its unit"]
    onset: Annotated[float, "when the fault begins [s]"]
    n_robots: Annotated[int, "swarm size N"]
    published: Annotated[float, "P of the reference"]
    counted: Annotated[bool, "whether it is one of the cells of the reference's tables"]
    n_seeds: Annotated[int, "number of runs that succeeded"]
    mean: Annotated[float, "mean P, in the unit of the task: items in the warehouse"]
    low: Annotated[float, "lower limit of the 95 % interval of the mean; missing at one seed"]
    high: Annotated[float, "upper limit of it"]
    prediction_low: Annotated[float, "lower limit of the 95 % interval of one further run"]
    prediction_high: Annotated[float, "upper limit of it"]
    published_inside: Annotated[
        bool | None,
        "whether the published P lies in the interval of one run; None: unknown",
    ]
    saturated: Annotated[bool, "whether a run delivered every item, so that P is capped"]
    stalled: Annotated[float, "share of runs with less than a quarter of the cell's median P"]
    problem: Annotated[str | None, "why runs are missing; None: they are complete"]
    arm: Annotated[Arm, "the setting and the condition"]
    by_seed: Annotated[NDArray[np.float64], "P seed by seed, shape (n_seeds,)"]
    digests: Annotated[tuple[str | None, ...], "digest of each run; equal digests: the same run"]


def columns_of(kind: type) -> Columns:
    """Return the columns of the table that holds records of a kind; missing floats are NaN."""
    found = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        type_, meaning = get_args(hint)
        found[name] = type_ if type_ in (float, int, bool) else object, meaning
    return found


PERFORMANCE = columns_of(Cell)
_UNKNOWN = Interval(np.nan, None, None)


def performance_table(
    plan: Plan, outcomes: Mapping[str, Outcome], reference: Reference | None
) -> pd.DataFrame:
    """Return P of every policy and condition of a plan, in the order of the report.

    Args:
        plan: of the study.
        outcomes: of its runs, by key.
        reference: the published performances; None: there are none.

    Returns:
        A table with the columns of `PERFORMANCE`.
    """
    rows = [_row(*cell, plan, outcomes, reference) for cell in plan.cells]
    return table_of(rows, PERFORMANCE)


def rows_of(table: pd.DataFrame) -> Iterator[Any]:
    """Yield the rows of a table with any columns; each column is an attribute."""
    return iter(table.itertuples(index=False))


def records_of(table: pd.DataFrame, kind: type[Kind]) -> Iterator[Kind]:
    """Yield the rows of a table, or of a part of it, as records of the kind that it holds."""
    names = list(columns_of(kind))
    yield from (kind(*row) for row in table[names].itertuples(index=False, name=None))


def cells_of(table: pd.DataFrame) -> Iterator[Cell]:
    """Yield the rows of a table of performances."""
    return records_of(table, Cell)


def groups_of(table: pd.DataFrame, *columns: str) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Yield the rows that are equal in some columns, in order of appearance.

    Yields:
        What they have in common (a tuple if that is several columns), and the rows.
    """
    yield from table.groupby(list(columns) if len(columns) > 1 else columns[0], sort=False)


def table_of(rows: Iterable[Mapping[str, object]], columns: Columns) -> pd.DataFrame:
    """Return records as a table with the given columns; what a record lacks is missing."""
    import pandas as pd

    # Missing texts stay None, which pandas would turn into NaN.
    whole = [{name: row.get(name) for name in columns} for row in rows]
    frame = pd.DataFrame(whole, columns=list(columns), dtype=object)
    return frame.astype({name: kind for name, (kind, _) in columns.items()})


class Played(NamedTuple):
    """What an indicator takes from the runs of one condition.

    Attributes:
        by_seed: P seed by seed of the runs that succeeded, shape (n_seeds,).
        digests: of these runs.
        saturated: whether one of them delivered every item.
        problem: why runs are missing; None: they are complete.
    """

    by_seed: NDArray[np.float64]
    digests: tuple[str | None, ...]
    saturated: bool
    problem: str | None


Row: TypeAlias = Cell | Played  # what a comparison reads of a condition


def played(found: Sequence[Outcome | None], *, paired: bool = True) -> Played:
    """Return the runs of one condition, from their outcomes seed by seed; None: not played."""
    succeeded = [outcome for outcome in found if outcome is not None and outcome.error is None]
    return Played(
        np.array([outcome.delivered for outcome in succeeded], dtype=np.float64),
        tuple(outcome.digest for outcome in succeeded),
        any(outcome.all_delivered for outcome in succeeded),
        _problem(found, paired=paired),
    )


def _row(
    policy: str,
    table: str,
    arm: Arm,
    plan: Plan,
    outcomes: Mapping[str, Outcome],
    reference: Reference | None,
) -> dict[str, object]:
    found = [outcomes.get(arm.condition.run(plan.code, seed).key) for seed in plan.seeds]
    runs = played(found, paired=plan.paired)
    p = runs.by_seed
    mean = spi.mean_interval(p) if p.size else _UNKNOWN
    one_run = spi.prediction_interval(p) if p.size else _UNKNOWN
    published = reference.performance.get(arm.setting) if reference else None
    inside = None
    if published is not None and one_run.low is not None and one_run.high is not None:
        inside = one_run.low <= published <= one_run.high
    return {
        "policy": policy,
        "table": table,
        "cell": str(arm.setting),
        "kind": arm.setting.kind,
        "factor": arm.setting.name,
        "value": arm.setting.value,
        "onset": arm.setting.onset,
        "n_robots": arm.condition.size,
        "published": published,
        "counted": reference is not None and arm.setting in reference.cells,
        "n_seeds": p.size,
        "mean": mean.value,
        "low": mean.low,
        "high": mean.high,
        "prediction_low": one_run.low,
        "prediction_high": one_run.high,
        "published_inside": inside,
        "stalled": spi.share_stalled(p) if p.size else None,
        "arm": arm,
        **runs._asdict(),
    }


def _problem(found: Sequence[Outcome | None], *, paired: bool) -> str | None:
    missing = found.count(None)
    failed = sum(outcome is not None and outcome.error is not None for outcome in found)
    if not paired and missing < len(found):
        missing = 0  # unpaired results need not be equally many everywhere
    parts = [
        f"{count} of {len(found)} runs {what}"
        for count, what in ((failed, "failed"), (missing, "missing"))
        if count
    ]
    return ", ".join(parts) or None
