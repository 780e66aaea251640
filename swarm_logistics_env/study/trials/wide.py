"""Wide tables, with a column for each condition or repetition: made one with a row for each trial.

What the columns differ in is read where their names say it beyond doubt: sizes ("N=4"), values
("width=2"), faults with how many robots fail ("none", "wheel 1 of 8"), repetitions ("run 1"). Else
somebody has to say it, by --wide.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .column_name import ColumnName
from .signs import sign_before_decimals
from .table import Table
from .trial import NO_FAULT_WORD
from .units import KNOWN_UNITS, UNIT_OF
from .words import CELLS, COLUMN_NAMES, MEANING, REPETITIONS, plain, usual_fault

MEASURED = ("performance", "time", "time_to_finish")
_ROBOTS = "|".join(word.replace("_", " ") for word in COLUMN_NAMES["n_robots"])
# "N=4" or "4 robots", but not "Roboter 4", which may be one of them.
_SIZE = re.compile(rf"(?:{_ROBOTS}) ?[=:] ?(\d+)|(\d+) (?:{_ROBOTS}|robot)")
_VALUE = re.compile(r"(.*\D)\s*=\s*([+-]?[\d.,]+)\s*(\S*)")
_REPETITION = re.compile(rf"(?:{'|'.join(REPETITIONS)}|#) ?[.:#]? ?\d+")
# "wheel, m = 1", "wheel 1 of 8", "wheel (2/8)"
_COUNTED = re.compile(
    r"(.*?)[\s,;:(]+(?:m\s*=\s*(\d+)|(\d+)\s*(?:of|von|de|sur|di|van|/)\s*(\d+))\)?",
    re.IGNORECASE,
)
_UNIT = re.compile(r"\s*(\[.*\]|\([^\d)]+\))\s*$")
_NUMBER = re.compile(r"\d+(?:[.,]\d+)?")

_LABELS = ("policy", "table", "seed", "fault")  # what is no number

Condition = dict[str, str]  # what a column is of: the cell of each new column, by its name


def long_of(
    table: Table,
    columns: Mapping[str, str],
    ignore: Sequence[str],
    wide: str | None,
    decimal: str | None,
    thousands: str | None,
) -> Table:
    """Return a table with a row for each trial, of one with a column for each condition.

    A table with a column of what was measured is no wide one, and returned as it is.

    Args:
        columns: what a column is to its name in the table, as somebody says.
        ignore: names of columns to leave out.
        wide: what the columns differ in: a word of `COLUMN_NAMES`, or the name of a parameter;
            None: what their names say.
        decimal: the sign before decimals in cells, as somebody says; None: nobody does.
        thousands: the sign between thousands, likewise.

    Raises:
        IndicatorError: `wide` is said of columns whose names do not tell it, or of no columns.
    """
    named = {name: MEANING.get(column) for column, name in columns.items()}
    named |= {name: meaning for meaning, name in table.meanings.items()}
    all_cells = table.columns_in_order
    meanings = [named.get(cells.name) or cells.name.meaning for cells in all_cells]
    is_long = any(
        meaning in MEASURED and cells.name not in ignore
        for cells, meaning in zip(all_cells, meanings)
    )
    numbers = [
        number
        for number, (cells, meaning) in enumerate(zip(all_cells, meanings))
        if cells.name not in ("", *ignore, *table.left_out)
        and not (meaning or cells.name.tells_robots)
        and cells.are_mostly_numbers
    ]
    if wide is not None:
        if is_long or len(numbers) < 2:
            raise IndicatorError(
                f"--wide {wide}: {table.source} has no two columns that could be conditions: it "
                f"has {', '.join(map(repr, table.header))}"
            )
        conditions = {number: _as_said(table, number, wide) for number in numbers}
    else:
        names = {number: _UNIT.sub("", table.header[number]) for number in numbers}
        conditions = {} if is_long else _read_off(names)
    condition_cells = [all_cells[number] for number in numbers]
    if sign_before_decimals(table, condition_cells, decimal, thousands) == ",":
        conditions = {n: _with_commas(condition) for n, condition in conditions.items()}
    return _melted(table, conditions, columns) if conditions else table


def _with_commas(condition: Condition) -> Condition:
    """Return a condition whose numbers have a decimal comma, as the cells have."""
    return {
        name: value if MEANING.get(name) in _LABELS else value.replace(".", ",")
        for name, value in condition.items()
    }


def _read_off(names: Mapping[int, str]) -> dict[int, Condition]:
    """Return what columns are of by their names; empty: these do not tell it."""
    for read in (_size, _value, _repetition):
        conditions = {number: read(name) for number, name in names.items()}
        read_off = {n: condition for n, condition in conditions.items() if condition is not None}
        parts = {name for condition in read_off.values() for name in condition}
        if len(read_off) > 1 and len(parts) < 2:
            return read_off
    faults = {number: _fault(name) for number, name in names.items()}
    is_told = all("faulty" in x or x["fault"] == NO_FAULT_WORD for x in faults.values())
    has_sound = any(x["fault"] == NO_FAULT_WORD for x in faults.values())
    return faults if len(faults) > 1 and is_told and has_sound else {}


def options_for_wide(names: Sequence[str]) -> str:
    """Return the options that say what columns differ in, as far as their names may tell it."""
    has_numbers = all(len(_NUMBER.findall(name)) == 1 for name in names)
    words = ("robots", "trial") if has_numbers else ("policy", "fault")
    return " or ".join(f"--wide {word}" for word in words)


def _size(name: str) -> Condition | None:
    match = _SIZE.fullmatch(plain(name))
    return {"robots": match[1] or match[2]} if match else None


def _value(name: str) -> Condition | None:
    match = _VALUE.fullmatch(name)
    if match is None or ColumnName(match[1]).bare in ("m", "run", "trial"):
        return None
    unit = f" [{match[3]}]" if match[3] else ""
    return {f"{match[1].strip()}{unit}": match[2].replace(",", ".")}


def _repetition(name: str) -> Condition | None:
    return {} if _REPETITION.fullmatch(plain(name)) else None


def _fault(name: str) -> Condition:
    """Return the fault that a column is of; with how many robots fail, where the name tells it."""
    match = _COUNTED.fullmatch(name.strip())
    if match is None:
        return {"fault": usual_fault(name) or name}
    condition = {"fault": usual_fault(match[1]) or match[1], "faulty": match[2] or match[3]}
    return condition | ({"robots": match[4]} if match[4] else {})


def _as_said(table: Table, number: int, wide: str) -> Condition:
    """Return what a column is of, where somebody says in what the columns differ."""
    name = _UNIT.sub("", table.header[number])
    meaning = MEANING.get(wide)
    if meaning == "fault":
        return _fault(name)
    if meaning == "trial":
        return {}
    if meaning in ("policy", "table", "seed"):
        return {meaning: name}
    numbers = _NUMBER.findall(name)
    if len(numbers) != 1:
        raise IndicatorError(
            f"--wide {wide}: {table.source} has a column {name!r}: should have one number in its "
            f"name, else say {options_for_wide([name])}, or leave it out by --ignore {quote(name)}"
        )
    return {"robots" if meaning == "n_robots" else wide: numbers[0].replace(",", ".")}


def _melted(table: Table, conditions: Mapping[int, Condition], columns: Mapping[str, str]) -> Table:
    """Return a table with a row for each cell of the columns of conditions, but for their ends."""
    sizes = {condition["robots"] for condition in conditions.values() if "robots" in condition}
    if len(sizes) == 1:  # "none" beside "wheel 1 of 8"
        conditions = {n: {**condition, "robots": min(sizes)} for n, condition in conditions.items()}
    units = {match[0] for n in conditions if (match := _UNIT.search(table.header[n]))}
    _refuse_several_units(table, [table.header[number] for number in conditions], units)
    measured = CELLS + (units.pop().rstrip() if len(units) == 1 else "")
    new = [*dict.fromkeys(name for condition in conditions.values() for name in condition)]
    for name in (*new, measured):
        if name in table.header:
            raise IndicatorError(
                f"{table.source} has a column {name!r} beside columns of conditions: leave it out "
                f"by --ignore {quote(name)}, or rename it"
            )
    # By their numbers, as several columns of one condition may have one name.
    labels = [number for number in range(len(table.header)) if number not in conditions]
    ends = _empty_ends(table, conditions)
    cells = []
    rows = []
    for number, condition in conditions.items():
        of_condition = [condition.get(name, "") for name in new]
        for row, texts in enumerate(table.cells):
            if (row, number) not in ends:
                cells.append([*(texts[label] for label in labels), *of_condition, texts[number]])
                rows.append(row)
    note = _note([table.header[n] for n in conditions], [*conditions.values()])
    if measured not in columns.values():
        note += " Their cells are read as P, of which more is better; where they are times until "
        note += f"all was done, say --column {quote(f'time_to_finish={measured}')}."
    if ends:
        note += f" Empty cells at an end ({len(ends)}) are no trials."
    meanings = {} if measured in columns.values() else {"performance": measured}
    return replace(
        table,
        meanings={**table.meanings, **meanings},
        header=[*(table.header[label] for label in labels), *new, measured],
        cells=cells,
        lines=[table.lines[row] for row in rows],
        origins=[table.origins[row] for row in rows] if table.origins else (),
        notes=(*table.notes, note),
    )


def _refuse_several_units(table: Table, names: Sequence[str], units: Collection[str]) -> None:
    """Refuse columns of conditions, by their names, whose units are known and differ."""
    words = {unit.strip(" []()").casefold(): unit.strip() for unit in units}
    if len({UNIT_OF.get(word, word) for word in words if word in KNOWN_UNITS}) > 1:
        raise IndicatorError(
            f"{table.source}: {', '.join(map(repr, names))} have several units, "
            f"{' and '.join(sorted(words.values()))}: should have one; leave some out by --ignore "
            "NAME"
        )


def _empty_ends(table: Table, conditions: Mapping[int, Condition]) -> set[tuple[int, int]]:
    """Return row and column of the cells that are empty, as a condition has less trials.

    Those are at the end of a column, or of the repetitions in a row. An empty cell before others
    is a value that is missing.
    """
    ends = set()
    for number, condition in conditions.items():
        for row in reversed(range(len(table.cells))):
            if table.cells[row][number]:
                break
            ends.add((row, number))
        repetitions = [other for other in conditions if conditions[other] == condition]
        if len(repetitions) > 1:
            ends |= {
                (row, number)
                for row, texts in enumerate(table.cells)
                if not any(texts[other] for other in repetitions if other >= number)
            }
    return ends


def _note(names: Sequence[str], conditions: Sequence[Condition]) -> str:
    """Return which columns became which conditions."""
    described = []
    for name, condition in zip(names, conditions):
        values = ", ".join(f"{what} {value}" for what, value in condition.items())
        described.append(f"{name!r} ({values})" if values else repr(name))
    what = "condition" if any(conditions) else "repetition"
    columns = ", ".join(dict.fromkeys(described))
    return f"A wide table: each of these columns is a {what}: {columns}."
