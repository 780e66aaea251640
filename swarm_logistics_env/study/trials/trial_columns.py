"""What each column of a table is, by its name or as somebody says."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .column_name import ColumnName
from .complaints import Complaints
from .signs import with_signs
from .table import Cells, Columns, Table
from .units import SECONDS, NamedUnit, in_seconds, units_of_times
from .words import CELLS, COLUMN_NAMES, ENGLISH_NAMES, MEANING

TEXTS = ("fault", "policy", "trial", "table", "finished")  # columns that hold no numbers
SEEDS = ("seed", "pair")  # blocks of one run each in every condition
# A column is a covariate, no parameter, that has so many values at least, and more values than half
# of the trials or than any plan has levels.
FEWEST_OF_COVARIATE = 6
MOST_LEVELS = 50
ONE_TRIAL_A_ROW = (
    "the unit is the trial, never the robot; sum the deliveries of a trial's robots into one row"
)


def columns_of(
    table: Table,
    columns: Mapping[str, str],
    ignore: Sequence[str],
    decimal: str | None,
    thousands: str | None,
    complaints: Complaints,
) -> Columns:
    """Return what the columns of a table are, with their cells.

    Args:
        columns: what a column is (a word of `COLUMN_NAMES`) to its name in the table.
        ignore: names of columns to leave out.
        decimal: the sign before decimals, "." or ","; None: ".", unless a column says otherwise.
        thousands: the sign between thousands; None: none, but where it can be nothing else.
        complaints: take what is wrong: a column that is named twice, may be a misspelled one, or
            has no unit that its times can have; rows of robots, not of trials.

    Raises:
        IndicatorError: a column that somebody names is not there, there are no rows, or a sign
            cannot be one.
    """
    names, parameters, blocks, errors = _names(table, columns, ignore, complaints.suspected)
    for error in errors:
        complaints.add(error)
    numbers = [*(name for column, name in names.items() if column not in TEXTS), *parameters]
    table, notes = with_signs(table, numbers, decimal, thousands, complaints)
    units = dict[str, NamedUnit]()
    with complaints.noted():
        units = units_of_times(table.source, names)
    seconds = {column: SECONDS[unit.unit] for column, unit in units.items() if unit.unit in SECONDS}
    notes += [
        f"{names[column]!r} is converted to seconds."
        for column, factor in seconds.items()
        if factor != 1.0
    ]
    by_meaning = {
        column: replace(table.columns[name], meaning=column, seconds=seconds.get(column, 1.0))
        for column, name in names.items()
        if name in table.columns
    }
    block_cells = [table.columns[name] for name in blocks]
    if len(blocks) > 1:
        texts = [", ".join(row) for row in zip(*(cells.texts for cells in block_cells))]
        by_meaning["seed"] = Cells(ColumnName(names["seed"]), texts, table, "seed")
    varying, covariates = _parameters(table, parameters, is_log="time" in names)
    # What somebody calls a block counts before its name in the file.
    words = {name: word for word, name in columns.items() if MEANING[word] == "seed"}
    table_columns = Columns(
        table=table,
        by_meaning=by_meaning,
        parameters=varying,
        covariates=covariates,
        ignored=[table.columns[name] for name in dict.fromkeys(ignore)],
        blocks=block_cells,
        seeds=[cells.name for cells in block_cells if cells.name.bare in SEEDS],
        has_seeds=any(ColumnName(words.get(name, name)).bare in SEEDS for name in blocks),
        performance_name=_name_of_performance(names, units.get("time_to_finish")),
        notes=notes,
    )
    if not table.cells:
        raise IndicatorError(
            f"{table.source} holds no trial: should have a row for each below the names"
        )
    with complaints.noted():
        _refuse_rows_of_robots(table_columns)
    return table_columns


def _names(
    table: Table, columns: Mapping[str, str], ignore: Sequence[str], suspected: dict[str, str]
) -> tuple[dict[str, str], list[str], list[str], list[IndicatorError]]:
    """Return the names of known columns, of those left as parameters, of the block, and errors.

    Args:
        suspected: takes what a column may be whose name is nearly a name of it.
    """
    path = table.source
    header = _with_content(table, columns)
    for column in columns:
        if column not in MEANING:
            raise IndicatorError(f"--column {column}: {_one_of(column, ENGLISH_NAMES)}")
    for name in (*columns.values(), *ignore):
        if name not in table.index:
            raise IndicatorError(f"{path} has no column {name!r}: {_one_of(name, table.header)}")
    names = {MEANING[column]: name for column, name in columns.items()}
    for column, name in table.meanings.items():
        if name in table.index and name not in ignore:
            names.setdefault(column, name)
    chosen = {*names}
    settled = {*ignore, *names.values(), *table.left_out}
    parameters = list[str]()
    of_robots = list[str]()
    errors = list[IndicatorError]()
    blocks = [names["seed"]] if "seed" in names else []
    for name in dict.fromkeys(header):
        if not name or name in settled:
            continue
        if header.count(name) > 1:
            errors.append(
                IndicatorError(f"{path} has two columns {name!r}: should have one of that name")
            )
            continue
        cells = table.columns[name]
        if cells.name.tells_robots or _may_be_robots(cells):
            of_robots.append(name)
            continue
        meaning = cells.name.meaning
        if meaning is None or (meaning in chosen and name not in COLUMN_NAMES):
            word = cells.name.bare
            close = difflib.get_close_matches(word, ENGLISH_NAMES, n=1, cutoff=0.75)
            if close and meaning is None and len(word) > 3 and not table.kind:
                suspected[name] = MEANING[close[0]]
                errors.append(_misspelled(path, name, close[0]))
                continue
            parameters.append(name)
        elif meaning == "seed":
            blocks.append(name)
            names[meaning] = " and ".join(blocks)
        elif meaning in names:
            errors.append(_both(path, meaning, names[meaning], name))
        else:
            names[meaning] = name
    if of_robots and "time" not in names:
        name = quote(of_robots[0])
        errors.append(
            IndicatorError(
                f"{path} has a column {of_robots[0]!r}, so its rows may be robots instead of "
                f"trials: {ONE_TRIAL_A_ROW} by --sum-over {name}, or leave the column out; where "
                f"it is the swarm's size, say --column robots={name}"
            )
        )
    return names, parameters, blocks, errors


def _misspelled(path: str, name: str, word: str) -> IndicatorError:
    return IndicatorError(
        f"{path} has a column {name!r}; did you mean {word!r}? Then say --column "
        f"{quote(f'{word}={name}')}; else rename it, or leave it out by --ignore {quote(name)}"
    )


def _both(path: str, meaning: str, first: str, second: str) -> IndicatorError:
    word = "robots" if meaning == "n_robots" else meaning
    return IndicatorError(
        f"{path} has columns {first!r} and {second!r}, both {word}: leave one of them out by "
        f"--ignore {quote(second)} or --ignore {quote(first)}"
    )


def _may_be_robots(cells: Cells) -> bool:
    """Return whether the German "Roboter" may tell robots apart: it is their number or a robot."""
    if cells.name.bare != "roboter":
        return False
    numbers = sorted({int(text) for text in cells.texts if text.isdecimal() and len(text) < 9})
    return len(numbers) > 2 and numbers == [*range(numbers[0], numbers[0] + len(numbers))]


def _with_content(table: Table, columns: Mapping[str, str]) -> list[str]:
    """Return the columns without those that would be a seed and are empty in every row."""
    return [
        name
        for name in table.header
        if table.columns[name].name.meaning != "seed"
        or name in columns.values()
        or not table.cells
        or any(table.columns[name].texts)
    ]


def _parameters(
    table: Table, names: Sequence[str], *, is_log: bool
) -> tuple[list[Cells], list[Cells]]:
    """Return the columns without a meaning of ours that vary: parameters, and covariates."""
    parameters = []
    covariates = []
    for name in names:
        n_values = len({*table.columns[name].texts})
        is_wide = n_values > min(MOST_LEVELS, len(table.cells) / 2)
        # In an event log a row is a delivery, no trial.
        if is_wide and n_values >= FEWEST_OF_COVARIATE and not is_log:
            covariates.append(table.columns[name])
        elif n_values > 1:
            parameters.append(table.columns[name])
    return parameters, covariates


def _name_of_performance(names: Mapping[str, str], unit: NamedUnit | None) -> str:
    """Return what the file calls P; where it is a rate, with the unit in which it is one.

    Args:
        unit: of the time to finish.
    """
    if "time_to_finish" in names:
        time = names["time_to_finish"]
        if unit and unit.unit in SECONDS:
            time = in_seconds(time, unit)
        return f"{names.get('work', '1')} / {time}"
    if "time" in names:
        return "deliveries"
    name = names.get("performance", "P")
    return "P" if ColumnName(name).bare in ("p", "performance", CELLS) else name


def _refuse_rows_of_robots(columns: Columns) -> None:
    """Refuse rows that differ in an ignored column of robots and in what each delivered alone."""
    table = columns.table
    of_robots = [cells for cells in columns.ignored if cells.name.tells_robots]
    meanings = columns.by_meaning
    if not of_robots or "time" in meanings:  # a row of an event log is a delivery, whoever made it
        return
    compared = [cells for meaning, cells in meanings.items() if meaning != "performance"]
    compared += [*columns.blocks, *columns.parameters, *columns.covariates]
    trials: dict[tuple[str, ...], int] = {}
    for row in range(len(table.cells)):
        first = trials.setdefault(tuple(cells.texts[row] for cells in compared), row)
        for robot in of_robots:
            if robot.texts[row] != robot.texts[first]:
                hint = ""
                if "trial" not in meanings:
                    hint = ", or name each row's trial in a column 'trial'"
                raise IndicatorError(
                    f"{table.location(row)}: differs from {table.line_word} {table.lines[first]} "
                    f"in {robot.name!r} and in what was delivered alone, so these may be robots of "
                    f"one trial: {ONE_TRIAL_A_ROW}, as by --sum-over {robot.name!r}{hint}"
                )


def _one_of(name: str, choices: Iterable[str]) -> str:
    names = [choice for choice in choices if choice]
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean {close[0]!r}?" if close else f"should be one of {', '.join(names)}"
