"""Reading trials: from a file, a folder of files or a data frame to `Trials`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from swarm_logistics_env.spi.inputs import IndicatorError

from .finished import are_words, finished_words, says_yes
from .pairing import numbered_blocks, paired_by_blocks
from .readers import read_table
from .references import notes_on_references, references_of
from .table import Columns, Table, rows_of
from .trial import Column, Trial, Trials
from .trial_columns import MORE_IS_BETTER, bare, columns_of
from .trial_rows import check_cells, check_labels, events_of, performance_of, trial_of
from .units import in_seconds, unit_of_time, word_of_time
from .values import FaultNames, summed_over, with_values

if TYPE_CHECKING:
    import pandas as pd

# A column is a covariate, no parameter, that has so many values at least, and more values than half
# of the trials or than any plan has levels.
FEWEST_OF_COVARIATE = 6
MOST_LEVELS = 50


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
    table = with_values(read_table(source, mapped, ignore), mapped, values)
    if sum_over is not None:
        table = summed_over(table, sum_over, mapped)
    table_columns, guesses = columns_of(table, mapped, ignore, decimal, thousands)
    rows = [*rows_of(table, table_columns)]
    varying, covariates = _parameters(table, table_columns)
    check_cells(table, table_columns, varying, is_summed=sum_over is not None)
    faults = FaultNames(rows)
    _check_columns(table, table_columns, faults, mapped)
    blocks = numbered_blocks(rows)
    unnamed = Path(table.source).stem or table.source
    is_log = "time" in table_columns.names
    finished = finished_words(rows) if "time_to_finish" in table_columns.names else {}
    performances = ((0.0 if is_log else performance_of(row, finished)) for row in rows)
    pairs = [
        (trial_of(row, faults, varying, duration, blocks, unnamed, performance=p), row)
        for row, p in zip(rows, performances)
    ]
    if "trial" in table_columns.names and not is_log:
        check_labels(pairs)
    trials = events_of(pairs) if is_log else [trial for trial, _ in pairs]
    notes = [*table.notes, *guesses, *faults.notes]
    if "time_to_finish" not in table_columns.names:  # a rate compares trials of any length
        _check_durations(table, trials)
    notes += _notes_on_conditions(trials, table_columns, varying, covariates)
    conditions = [trial.condition for trial, _ in pairs]
    notes += _notes_on_left_out({name: table.column(name) for name in ignore}, conditions)
    trials, notes_on_pairs = paired_by_blocks(table, table_columns, trials, mapped)
    references = tuple(references_of(table.source, trials, varying, reference or {}))
    notes += [*notes_on_pairs, *notes_on_references(references, reference or {})]
    return Trials(
        Path(table.source).name or table.source,
        table.digest,
        tuple(trials),
        tuple(notes),
        _uses_of(table, table_columns, varying, covariates),
        _name_of_performance(table_columns),
        references,
        tuple(blocks),
    )


def _notes_on_conditions(
    trials: Sequence[Trial], columns: Columns, varying: Sequence[str], covariates: Sequence[str]
) -> Iterator[str]:
    """Yield what P is where it is a rate, and what tells the conditions apart, or does not."""
    if "time_to_finish" in columns.names:
        yield f"P is {_work_by_time(columns).replace('/', 'divided by', 1)}: more is better."
    for name in covariates:
        yield f"{name!r} differs from trial to trial: it tells no conditions apart."
    counts = Counter(trial.condition for trial in trials)
    if varying and min(counts.values()) == 1 < max(counts.values()):
        yield (
            f"{len(trials)} trials in {len(counts)} conditions, told apart by "
            f"{' and '.join(varying)}, some of a single trial: leave out what was only noted, as "
            f"by --ignore {varying[0]!r}."
        )


def _notes_on_left_out(
    columns: Mapping[str, Sequence[str]], conditions: Sequence[object]
) -> Iterator[str]:
    """Yield which columns are left out though they differ from condition to condition alone."""
    n_conditions = len({*conditions})
    for name, cells in columns.items():
        if len({*cells}) > 1 and len({*zip(conditions, cells)}) == n_conditions:
            yield (
                f"{name!r} is left out, though it differs between conditions: what comes of it "
                "counts as theirs."
            )


def _parameters(table: Table, columns: Columns) -> tuple[list[str], list[str]]:
    """Return the parameters that vary, and the covariates among them."""
    varying = list[str]()
    covariates = list[str]()
    for name in columns.parameters:
        values = {*table.column(name)}
        if len(values) > 1:
            is_wide = len(values) > min(MOST_LEVELS, len(table.cells) / 2)
            # In an event log a row is a delivery.
            is_covariate = len(values) >= FEWEST_OF_COVARIATE and "time" not in columns.names
            (covariates if is_wide and is_covariate else varying).append(name)
    return varying, covariates


def _uses_of(
    table: Table, columns: Columns, varying: Sequence[str], covariates: Sequence[str]
) -> tuple[Column, ...]:
    """Return what every column of a table was taken for."""
    meanings = {name: meaning for meaning, name in columns.names.items()}
    meanings |= dict.fromkeys(columns.blocks, "seed")
    uses = []
    for name in table.header:
        values = (*dict.fromkeys(table.column(name)),)
        use = meanings.get(name)
        if use is None and name in varying:
            use = "parameter"
        elif use is None and name in covariates:
            use = "covariate"
        elif use is None:
            use = "left out" if name in columns.ignored or len(values) > 1 else "the same in all"
        use = "robots" if use == "n_robots" else use
        uses.append(Column(name, use, values[:_FEW_VALUES], len(values)))
    return tuple(uses)


_FEW_VALUES = 6  # that show what a column holds


def _name_of_performance(columns: Columns) -> str:
    """Return what the file calls P."""
    names = columns.names
    if "time_to_finish" in names:
        return _work_by_time(columns)
    if "time" in names:
        return "deliveries"
    return "P" if bare(names["performance"]) in ("p", "performance") else names["performance"]


def _work_by_time(columns: Columns) -> str:
    """Return what P is where it is a rate, with the unit in which it is one."""
    name = columns.names["time_to_finish"]
    unit = unit_of_time(name)
    if unit and "time_to_finish" in columns.seconds:
        name = in_seconds(name, unit)
    return f"{columns.names.get('work', '1')} / {name}"


def _check_columns(
    table: Table, columns: Columns, faults: FaultNames, mapped: Mapping[str, str]
) -> None:
    """Refuse a file without the columns that no other can stand for, all of them at once.

    Args:
        mapped: what a column is to its name in the file, as somebody says.
    """
    names = columns.names
    lacking = {}
    if not {"performance", "time", "time_to_finish"} & names.keys():
        lacking["performance"] = "column 'performance', or time, for one delivery a row"
    if faults.any_fails and "faulty" not in names:
        lacking["faulty"] = "column 'faulty', for how many robots fail"
    if lacking:
        options = " ".join(f"--column {name}=NAME" for name in lacking)
        raise IndicatorError(
            f"{table.source} has no {' and no '.join(lacking.values())}: it has "
            f"{', '.join(map(repr, table.header))}; say which it is by {options}, or add it"
        )
    if MORE_IS_BETTER not in mapped:
        _refuse_time_as_performance(table, columns)
    if "time_to_finish" in names and "finished" not in names:
        _refuse_unnamed_finished(table, columns)


def _refuse_time_as_performance(table: Table, columns: Columns) -> None:
    """Ask of a performance that is a time by its name whether more of it is better."""
    name = columns.names.get("performance", "")
    word = word_of_time(name)
    if word is None:
        return
    raise IndicatorError(
        f"{table.source}: {name!r} is a time by its name ({word}): where less is better, as of the "
        f"time until all is done, say --column time_to_finish={name!r}, and --column work=NAME if "
        f"what was done in it varies; where more is better, --column {MORE_IS_BETTER}={name!r}"
    )


def _refuse_unnamed_finished(table: Table, columns: Columns) -> None:
    """Ask of a column that may say which trials finished, and would be a parameter."""
    for name in columns.parameters:
        cells = {*table.column(name)}
        means = says_yes(bare(name))
        is_number = all(cell.replace(".", "").isdigit() for cell in cells)
        if not are_words(cells) or (is_number and means is None):
            continue
        values = ""
        if means is False:  # it says who did not finish
            for cell in sorted(cells):
                finished = "no" if says_yes(cell) else "yes"
                values += f" --value {quote(f'finished:{cell}={finished}')}"
        raise IndicatorError(
            f"{table.source}: {name!r} may say which trials finished: say --column "
            f"{quote(f'finished={name}')}{values}, or leave it out by --ignore {quote(name)}"
        )


def _check_durations(table: Table, trials: Sequence[Trial]) -> None:
    """Refuse trials of which some lasted longer than others."""
    for trial in trials:
        if trial.duration != trials[0].duration:
            raise IndicatorError(
                f"{table.source}, {table.line_word} {trial.line}: is not as long as "
                f"{table.line_word} {trials[0].line}: runs compared should be of one length; else "
                "let P be a rate, and leave the column out"
            )
