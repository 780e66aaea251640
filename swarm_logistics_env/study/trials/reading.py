"""Reading trials: from a file, a folder of files or a data frame to `Trials`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from .cell_checks import check_cells
from .column_checks import check_columns
from .complaints import Complaints
from .fault_names import FaultNames
from .finished import finished_words
from .missing import missing_rows, without_rows
from .pairing import paired_by_blocks
from .readers import read_table
from .references import notes_on_references, references_of
from .table import Cells, Columns, Table
from .trial import Column, Trial, Trials
from .trial_columns import columns_of
from .trial_rows import numbered_blocks, trials_of
from .values import summed_over, with_constants, with_values
from .wide import long_of

if TYPE_CHECKING:
    import pandas as pd


def read_trials(
    source: str | Path | pd.DataFrame,
    *,
    columns: Mapping[str, str] | None = None,
    ignore: Sequence[str] = (),
    values: Sequence[str] = (),
    sum_over: str | None = None,
    duration: float | None = None,
    decimal: str | None = None,
    thousands: str | None = None,
    skip_missing: bool = False,
    wide: str | None = None,
    reference: Mapping[str, float] | None = None,
) -> Trials:
    """Read one run a row, or one delivery a row (an event log).

    Files are CSV of any delimiter, or of a kind that `trials.readers` know. The columns are
    `robots`, `fault`, `faulty`, `onset`, `policy`, `seed`, `trial`, `contacts` and `performance`,
    or words of `words.COLUMN_NAMES` for them, as far as they apply; any other column of
    numbers that vary is a parameter of that name. Instead of `performance` may stand
    `time_to_finish` (P is `work` divided by it), or `time`, in an event log: a run without any
    delivery is a row with an empty time. A column `table` tells tables apart of which each has
    runs of its own, also without a fault.

    Args:
        source: path of a file or a folder of files, or a data frame of pandas.
        columns: what a column is to its name in the file, e.g. {"performance": "boxes"}; or to a
            number where the file has no such column, e.g. {"robots": "8"}.
        ignore: columns to leave out.
        values: cells to replace, each "COLUMN:CELL=NEW", e.g. "fault:kein=none".
        sum_over: the column that tells the robots of a trial apart, whose deliveries are summed.
        duration: of every trial [s], where no column says it; faults in mid-run need it.
        decimal: the sign before decimals, "." or ","; None: ".", unless cells show a comma.
        thousands: the sign between thousands, "." or ","; None: none, and a file is refused in
            which either may stand there.
        skip_missing: whether rows that lack a value are left out; else they are refused.
        wide: what the columns of a wide table differ in, where their names leave it open: "robots",
            "fault", "policy", "trial" (repetitions), or the name of a parameter.
        reference: parameters and the value that A is relative to, e.g. {"width": 2.0}; of one that
            is not named: its value in the condition without a fault that has most trials.

    Raises:
        IndicatorError: the file cannot be read, or a line of it; names line, column and value.
    """
    mapped = dict(columns or {})
    table = long_of(read_table(source, mapped, ignore), mapped, ignore, wide, decimal, thousands)
    table = with_values(with_constants(table, mapped), mapped, values)
    table = summed_over(table, sum_over, mapped)
    table_columns, complaints = _columns_of(
        table, mapped, ignore, decimal, thousands, skip_missing=skip_missing
    )
    finished = finished_words(table_columns, complaints)
    check_cells(table_columns, complaints, is_summed=sum_over is not None)
    faults = FaultNames(table_columns, mapped, complaints)
    check_columns(table_columns, faults, mapped, duration, complaints)
    complaints.raise_all()
    blocks = numbered_blocks(table_columns)
    trials, conditions = trials_of(table_columns, faults, finished, blocks, duration, complaints)
    means, notes_on_pairs = paired_by_blocks(table_columns, trials)
    references = tuple(references_of(table_columns, means, reference or {}))
    notes = [
        *table_columns.table.notes,
        *table_columns.notes,
        *faults.notes,
        *_notes_on_conditions(trials, table_columns),
        *_notes_on_left_out(table_columns.ignored, conditions),
        *notes_on_pairs,
        *notes_on_references(references, reference or {}),
    ]
    return Trials(
        Path(table.source).name or table.source,
        table.digest,
        tuple(means),
        tuple(notes),
        _uses_of(table_columns),
        table_columns.performance_name,
        references,
        tuple(blocks),
    )


def _columns_of(
    table: Table,
    mapped: Mapping[str, str],
    ignore: Sequence[str],
    decimal: str | None,
    thousands: str | None,
    *,
    skip_missing: bool,
) -> tuple[Columns, Complaints]:
    """Return the columns of a table, if said so of the rows with all values, and complaints."""
    complaints = Complaints()
    columns = columns_of(table, mapped, ignore, decimal, thousands, complaints)
    complaints.missing = missing_rows(columns)
    if not (skip_missing and complaints.missing):
        return columns, complaints
    table = without_rows(table, complaints)
    complaints = Complaints()
    return columns_of(table, mapped, ignore, decimal, thousands, complaints), complaints


def _notes_on_conditions(trials: Sequence[Trial], columns: Columns) -> Iterator[str]:
    """Yield what P is where it is a rate, and what tells the conditions apart, or does not."""
    if "time_to_finish" in columns.by_meaning:
        yield f"P is {columns.performance_name.replace('/', 'divided by', 1)}: more is better."
    stopped = sum(trial.least is not None for trial in trials)
    if stopped:
        yield (
            f"{stopped} of {len(trials)} trials were stopped before they finished, and nobody "
            "counted what was done: P of such a trial is shown as the most that it may be, as if "
            "it had finished then; verdicts and intervals hold for any P from 0 to that."
        )
    for cells in columns.covariates:
        yield f"{cells.name!r} differs from trial to trial: it tells no conditions apart."
    counts = Counter(trial.condition for trial in trials)
    names = [cells.name for cells in columns.parameters]
    if names and min(counts.values()) == 1 < max(counts.values()):
        yield (
            f"{len(trials)} trials in {len(counts)} conditions, told apart by "
            f"{' and '.join(names)}, some of a single trial: leave out what was only noted, as "
            f"by --ignore {names[0]!r}."
        )


def _notes_on_left_out(columns: Sequence[Cells], conditions: Sequence[object]) -> Iterator[str]:
    """Yield which columns are left out though they differ from condition to condition alone."""
    n_conditions = len({*conditions})
    for cells in columns:
        if len({*cells.texts}) > 1 and len({*zip(conditions, cells.texts)}) == n_conditions:
            yield (
                f"{cells.name!r} is left out, though it differs between conditions: what comes of "
                "it counts as theirs."
            )


def _uses_of(columns: Columns) -> tuple[Column, ...]:
    """Return what every column of a table was taken for."""
    use_by_name: dict[str, str] = {cells.name: "parameter" for cells in columns.parameters}
    use_by_name |= {cells.name: "covariate" for cells in columns.covariates}
    use_by_name |= {cells.name: meaning for meaning, cells in columns.by_meaning.items()}
    use_by_name |= {cells.name: "seed" for cells in columns.blocks}
    ignored = [cells.name for cells in columns.ignored]
    uses = []
    for name in columns.table.header:
        values = (*dict.fromkeys(columns.table.columns[name].texts),)
        use = "left out" if name in ignored or len(values) > 1 else "the same in all"
        use = use_by_name.get(name, use)
        use = "robots" if use == "n_robots" else use
        uses.append(Column(name, use, values[:_FEW_VALUES], len(values)))
    return tuple(uses)


_FEW_VALUES = 6  # that show what a column holds
