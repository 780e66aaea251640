"""What each column of a table is, by its name or as somebody says."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .complaints import Complaints
from .table import Cells, Columns, Table
from .units import SECONDS, NamedUnit, in_seconds, is_per_minute, unit_of_time, without_unit
from .words import CELLS, COLUMN_NAMES, ENGLISH_NAMES, MEANING, means_no_number, plain

TEXTS = ("fault", "policy", "trial", "table", "finished")  # columns that hold no numbers
TIMES = ("onset", "time", "time_to_finish", "duration")
SEEDS = ("seed", "pair")  # blocks of one run each in every condition
# A column is a covariate, no parameter, that has so many values at least, and more values than half
# of the trials or than any plan has levels.
FEWEST_OF_COVARIATE = 6
MOST_LEVELS = 50
_ROBOT = re.compile(r"(robot|agent|drone|bot)(_?(id|no|nr|num|number|name|index|label))?|id_robot")
# With a sign between thousands and the other one before decimals.
_BOTH_SIGNS = re.compile(r"[+-]?\d{1,3}((\.\d{3})+,\d+|(,\d{3})+\.\d+)")
# How a decimal comma looks that can stand between no thousands.
_DECIMAL_COMMA = re.compile(r"[+-]?(\d+,(\d{1,2}|\d{4,})|0,\d+|\d{4,},\d+)")
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
        IndicatorError: a column that somebody names is not there, or there are no rows.
    """
    for option, sign in (("--decimal", decimal), ("--thousands", thousands)):
        if sign not in (None, ".", ","):
            raise IndicatorError(f"{option} {sign}: should be . or ,")
    if decimal is not None and decimal == thousands:
        raise IndicatorError(f"--thousands {thousands}: should be another sign than --decimal")
    names, parameters, blocks = _names(table, columns, ignore, complaints)
    numbers = [*(name for column, name in names.items() if column not in TEXTS), *parameters]
    table, notes = _with_signs(table, numbers, decimal, thousands, complaints)
    units = dict[str, NamedUnit]()
    with complaints.noted():
        units = _units_of_times(table, names)
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
        by_meaning["seed"] = Cells(names["seed"], texts, table, "seed")
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
        seeds=[name for name in blocks if bare(name) in SEEDS],
        has_seeds=any(bare(words.get(name, name)) in SEEDS for name in blocks),
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
    table: Table, columns: Mapping[str, str], ignore: Sequence[str], complaints: Complaints
) -> tuple[dict[str, str], list[str], list[str]]:
    """Return the name of each known column, columns left as parameters, and those of the block."""
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
    blocks = [names["seed"]] if "seed" in names else []
    for name in dict.fromkeys(header):
        if not name or name in settled:
            continue
        if header.count(name) > 1:
            complaints.add(
                IndicatorError(f"{path} has two columns {name!r}: should have one of that name")
            )
            continue
        if is_robot(name) or _may_be_robots(table.columns[name]):
            of_robots.append(name)
            continue
        meaning = meaning_of(name)
        if meaning is None or (meaning in chosen and name not in COLUMN_NAMES):
            close = difflib.get_close_matches(bare(name), ENGLISH_NAMES, n=1, cutoff=0.75)
            if close and meaning is None and len(bare(name)) > 3 and not table.kind:
                complaints.suspected[name] = MEANING[close[0]]
                complaints.add(_misspelled(path, name, close[0]))
                continue
            parameters.append(name)
        elif meaning == "seed":
            blocks.append(name)
            names[meaning] = " and ".join(blocks)
        elif meaning in names:
            complaints.add(_both(path, meaning, names[meaning], name))
        else:
            names[meaning] = name
    if of_robots and "time" not in names:
        name = quote(of_robots[0])
        complaints.add(
            IndicatorError(
                f"{path} has a column {of_robots[0]!r}, so its rows may be robots instead of "
                f"trials: {ONE_TRIAL_A_ROW} by --sum-over {name}, or leave the column out; where "
                f"it is the swarm's size, say --column robots={name}"
            )
        )
    return names, parameters, blocks


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
    if bare(cells.name) != "roboter":
        return False
    numbers = sorted({int(text) for text in cells.texts if text.isdecimal() and len(text) < 9})
    return len(numbers) > 2 and numbers == [*range(numbers[0], numbers[0] + len(numbers))]


def _with_content(table: Table, columns: Mapping[str, str]) -> list[str]:
    """Return the columns without those that would be a seed and are empty in every row."""
    return [
        name
        for name in table.header
        if meaning_of(name) != "seed"
        or name in columns.values()
        or not table.cells
        or any(table.columns[name].texts)
    ]


def _units_of_times(table: Table, names: Mapping[str, str]) -> dict[str, NamedUnit]:
    """Return the units that the names of times have, by what the column is.

    Raises:
        IndicatorError: a time has a unit of something else, times have units that cannot be
            converted into each other, or contacts are not per minute.
    """
    units: dict[str, NamedUnit] = {}
    for column in TIMES:
        name = names.get(column, "")
        try:
            unit = unit_of_time(name)
        except ValueError as error:
            raise IndicatorError(
                f"{table.source}: {name!r} ({column}) has the unit {error}: should have one of "
                f"time, {', '.join(SECONDS)} or steps: rename it, or leave it out by "
                f"--ignore {name!r}"
            ) from None
        if unit:
            units[column] = unit
    in_steps = {column: unit for column, unit in units.items() if unit.unit not in SECONDS}
    if 0 < len(in_steps) < len(units):
        named = " and ".join(repr(names[column]) for column in units)
        raise IndicatorError(
            f"{table.source}: {named} have times in steps and in others: should have one unit"
        )
    contacts = names.get("contacts", "")
    if not is_per_minute(contacts):
        raise IndicatorError(
            f"{table.source}: {contacts!r}: contacts should be per robot and minute"
        )
    return units


def _with_signs(
    table: Table,
    numbers: Sequence[str],
    decimal: str | None,
    thousands: str | None,
    complaints: Complaints,
) -> tuple[Table, list[str]]:
    """Return a table with the signs in its numbers, and notes on what was guessed.

    Args:
        numbers: the names of columns that hold numbers.
        complaints: take a column in which a sign may stand before decimals or between thousands.
    """
    notes = []
    columns = [table.columns[name] for name in numbers if name in table.columns]
    decimal = decimal or table.decimal or ("," if thousands == "." else None)
    if decimal is None and thousands is None and (text := _both_signs(columns)):
        signs = re.sub(r"[\d+-]", "", text)
        thousands = signs[0]
        decimal = signs[-1]
        notes.append(
            f"Numbers are taken to have {thousands} between thousands and {decimal} before "
            f"decimals, as in {text}."
        )
    if decimal is None and (text := _decimal_comma(columns)):
        decimal = ","
        notes.append(f"Decimals are taken to have a comma, as in {text}.")
    if decimal is None and thousands is None:
        for cells in columns:
            with complaints.noted():
                _refuse_thousands(cells)
    return replace(table, decimal=decimal or ".", thousands=thousands), notes


def _both_signs(columns: Sequence[Cells]) -> str | None:
    """Return a cell with a sign between thousands and one before decimals; None: none has both."""
    texts = {text for cells in columns for text in cells.texts}
    return min((text for text in texts if _BOTH_SIGNS.fullmatch(text)), default=None)


def _decimal_comma(columns: Sequence[Cells]) -> str | None:
    """Return a cell whose comma stands before decimals, if no cell has a point; None: none."""
    texts = {text for cells in columns for text in cells.texts if not means_no_number(text)}
    if any("." in text for text in texts):
        return None
    return min((text for text in texts if _DECIMAL_COMMA.fullmatch(text)), default=None)


def _refuse_thousands(cells: Cells) -> None:
    """Refuse a column in which "1.200" beside "980" may be 1200 or 1.2."""
    first = {text: row for row, text in reversed([*enumerate(cells.texts)]) if text}
    plain_numbers = {text: row for text, row in first.items() if text.isdecimal()}
    with_points = [text for text in first if re.fullmatch(r"[1-9]\d{0,2}\.\d{3}", text)]
    if not (plain_numbers and with_points) or len(plain_numbers) + len(with_points) < len(first):
        return
    largest = max(plain_numbers, key=float)
    smallest = min(with_points, key=float)
    if float(largest) >= 10.0 * float(smallest):
        table = cells.table
        raise cells.error(
            first[smallest],
            f"is {smallest.replace('.', '')} or {float(smallest):g}, beside {largest} in "
            f"{table.line_word} {table.lines[plain_numbers[largest]]}: should be without a sign "
            "between thousands; or say --thousands . where it is one, --decimal . where decimals "
            "have a point",
        )


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
    return "P" if bare(name) in ("p", "performance", CELLS) else name


def _refuse_rows_of_robots(columns: Columns) -> None:
    """Refuse rows that differ in an ignored column of robots and in what each delivered alone."""
    table = columns.table
    of_robots = [cells for cells in columns.ignored if is_robot(cells.name)]
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


def is_robot(name: str) -> bool:
    """Return whether a column tells robots apart, by its name."""
    return _ROBOT.fullmatch(bare(name)) is not None


def meaning_of(name: str) -> str | None:
    """Return what a column is by its name, a key of `COLUMN_NAMES`; None: it is not known."""
    word = bare(name)
    stem = without_unit(word)
    is_time = MEANING.get(stem) in TIMES and stem != "length"  # whose "min" may be the least
    return MEANING.get(stem if is_time else word)


def bare(name: str) -> str:
    """Return a column's name in small letters, without accents and unit: "Time [s]" is "time"."""
    without_unit = re.sub(r"\s*[\[(].*?[\])]\s*", " ", name)
    return re.sub(r"\W+", "_", plain(without_unit)).strip("_")


def _one_of(name: str, choices: Iterable[str]) -> str:
    names = [choice for choice in choices if choice]
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean {close[0]!r}?" if close else f"should be one of {', '.join(names)}"
