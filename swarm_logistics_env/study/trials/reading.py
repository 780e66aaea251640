"""Reading trials: from a file, a folder of files or a data frame to `Trials`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from swarm_logistics_env.spi.inputs import IndicatorError

from .cell_checks import check_cells
from .fault_names import FaultNames
from .finished import finished_words
from .pairing import paired_by_blocks
from .readers import read_table
from .references import notes_on_references, references_of
from .table import Cells, Columns
from .trial import Column, Trial, Trials
from .trial_columns import MORE_IS_BETTER, columns_of
from .trial_rows import numbered_blocks, trials_of
from .units import word_of_time
from .values import summed_over, with_values

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
    reference: Mapping[str, float] | None = None,
) -> Trials:
    """Read one run a row, or one delivery a row (an event log).

    Files are CSV of any delimiter, or of a kind that `trials.readers` know. The columns are
    `robots`, `fault`, `faulty`, `onset`, `policy`, `seed`, `trial`, `contacts` and `performance`,
    or words of `trial_columns.COLUMN_NAMES` for them, as far as they apply; any other column of
    numbers that vary is a parameter of that name. Instead of `performance` may stand
    `time_to_finish` (P is `work` divided by it), or `time`, in an event log: a run without any
    delivery is a row with an empty time. A column `table` tells tables apart of which each has
    runs of its own, also without a fault.

    Args:
        source: path of a file or a folder of files, or a data frame of pandas.
        columns: what a column is to its name in the file, e.g. {"performance": "boxes"}.
        ignore: columns to leave out.
        values: cells to replace, each "COLUMN:CELL=NEW", e.g. "fault:kein=none".
        sum_over: the column that tells the robots of a trial apart, whose deliveries are summed.
        duration: of every trial [s], where no column says it; faults in mid-run need it.
        decimal: the sign before decimals, "." or ","; None: ".", unless cells show a comma.
        thousands: the sign between thousands, "." or ","; None: none, and a file is refused in
            which either may stand there.
        reference: parameters and the value that A is relative to, e.g. {"width": 2.0}; of one that
            is not named: its value in the condition without a fault that has most trials.

    Raises:
        IndicatorError: the file cannot be read, or a line of it cannot be; names line, column and
            value.
    """
    mapped = dict(columns or {})
    table = read_table(source, mapped, ignore)
    table = with_values(table, mapped, values)
    if sum_over is not None:
        table = summed_over(table, sum_over, mapped)
    table_columns = columns_of(table, mapped, ignore, decimal, thousands)
    check_cells(table_columns, is_summed=sum_over is not None)
    faults = FaultNames(table_columns)
    _check_columns(table_columns, faults, mapped)
    finished = finished_words(table_columns)
    blocks = numbered_blocks(table_columns)
    trials, conditions = trials_of(table_columns, faults, finished, blocks, duration)
    means, notes_on_pairs = paired_by_blocks(table_columns, trials)
    names = [cells.name for cells in table_columns.parameters]
    references = tuple(references_of(table.source, means, names, reference or {}))
    notes = [
        *table.notes,
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


def _notes_on_conditions(trials: Sequence[Trial], columns: Columns) -> Iterator[str]:
    """Yield what P is where it is a rate, and what tells the conditions apart, or does not."""
    if "time_to_finish" in columns.by_meaning:
        yield f"P is {columns.performance_name.replace('/', 'divided by', 1)}: more is better."
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
    use_by_name = {cells.name: "parameter" for cells in columns.parameters}
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


def _check_columns(columns: Columns, faults: FaultNames, mapped: Mapping[str, str]) -> None:
    """Refuse a file without the columns that no other can stand for, all of them at once.

    Args:
        mapped: what a column is to its name in the file, as somebody says.
    """
    names = columns.by_meaning
    lacking = {}
    if not {"performance", "time", "time_to_finish"} & names.keys():
        lacking["performance"] = "column 'performance', or time, for one delivery a row"
    if faults.any_fails and "faulty" not in names:
        lacking["faulty"] = "column 'faulty', for how many robots fail"
    if lacking:
        options = " ".join(f"--column {name}=NAME" for name in lacking)
        raise IndicatorError(
            f"{columns.table.source} has no {' and no '.join(lacking.values())}: it has "
            f"{', '.join(map(repr, columns.table.header))}; say which it is by {options}, or add it"
        )
    if MORE_IS_BETTER not in mapped:
        _refuse_time_as_performance(columns)


def _refuse_time_as_performance(columns: Columns) -> None:
    """Ask of a performance that is a time by its name whether more of it is better."""
    cells = columns.by_meaning.get("performance")
    if cells and (word := word_of_time(cells.name)):
        raise IndicatorError(
            f"{cells.table.source}: {cells.name!r} is a time by its name ({word}): where less is "
            "better, as of the time until all is done, say --column "
            f"time_to_finish={cells.name!r}, and --column work=NAME if what was done in it varies; "
            f"where more is better, --column {MORE_IS_BETTER}={cells.name!r}"
        )
