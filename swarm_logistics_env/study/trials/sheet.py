"""What people put around the trials of a sheet: a row of units, notes and totals below, percent."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from .table import Formula, Table, are_numbers, like_a_number
from .units import UNIT_OF
from .words import REPETITIONS, TOTALS, means_no_number, plain

_UNITS = {"-", "%", "m", "mm", "cm", "km", "m/s", "hz", *UNIT_OF}
_IN_BRACKETS = re.compile(r"[\[(].*[\])]")
_REPETITION = re.compile(rf"({'|'.join(REPETITIONS)}|#)?[\s._#-]*\d+\.?")
_FEWEST_COLUMNS = 3  # of a table below which a line of one cell is a note


def without_surroundings(table: Table) -> Table:
    """Return the trials of a sheet without what stands around them, and notes on what that is.

    A row of units goes into the names of the columns, and a percent sign behind all numbers of a
    column, too. Below the trials are left out what is written in a single cell, and rows that sum
    up those above.
    """
    table = _without_rows_below(table)
    table = _with_units_in_names(table)
    return _with_percent_in_names(table)


def _without_rows_below(table: Table) -> Table:
    n_trials = len(table.cells)
    notes = []
    while n_trials and (reason := _no_trial(table, n_trials - 1)):
        n_trials -= 1
        line = f"{table.line_word} {table.lines[n_trials]}"
        text = next(filter(None, table.cells[n_trials]))
        notes.append(f"{text!r} ({line}) is left out: {reason}.")
    return replace(
        table,
        cells=table.cells[:n_trials],
        lines=table.lines[:n_trials],
        notes=(*table.notes, *reversed(notes)),
    )


def _no_trial(table: Table, row: int) -> str:
    """Return why the last row is none of a trial; empty: it is one."""
    texts = {column: text for column, text in enumerate(table.cells[row]) if text}
    for column, text in texts.items():
        is_note = len(texts) == 1 and len(table.header) >= _FEWEST_COLUMNS
        is_note &= not (isinstance(text, Formula) or like_a_number(text))
        is_total = plain(text).rstrip(":.") in TOTALS
        if not (is_note or is_total) or any(cells[column] == text for cells in table.cells[:row]):
            continue
        return "it sums up the rows above" if is_total else "a note below the trials"
    return ""


def _with_units_in_names(table: Table) -> Table:
    """Return a table whose first row, if it is one of units or repetitions, is in the names."""
    first, *trials = table.cells or [()]
    columns = [*zip(*trials)]
    numbered = [number for number, texts in enumerate(columns) if are_numbers(texts)]
    units = [first[number] for number in numbered]
    line = table.lines[0] if table.lines else 0
    where = f"{table.line_word} {line}"
    if any(units) and all(_is_repetition(text) for text in units if text):
        # Whatever is merged over several columns has its name in the first of them alone.
        header = _carried_on(table.header, first)
        note = f"{where} numbers repetitions: each of its columns has trials of its own."
    elif {*units} - {"", "-"} and all(_is_unit(text) for text in first if text):
        header = [
            f"{name} [{unit.strip('[]()')}]" if unit not in ("", "-") else name
            for name, unit in zip(table.header, first)
        ]
        note = f"{where} is read as the units of the columns."
    else:
        return table
    notes = (*table.notes, f"{note[0].upper()}{note[1:]}")
    return replace(table, header=header, cells=trials, lines=table.lines[1:], notes=notes)


def _is_unit(text: str) -> bool:
    return _IN_BRACKETS.fullmatch(text) is not None or text.casefold() in _UNITS


def _is_repetition(text: str) -> bool:
    return not like_a_number(text) and _REPETITION.fullmatch(plain(text)) is not None


def _carried_on(header: Sequence[str], first: Sequence[str]) -> list[str]:
    names = list[str]()
    for name, text in zip(header, first):
        names.append(name or (names[-1] if names and _is_repetition(text) else ""))
    return names


def _with_percent_in_names(table: Table) -> Table:
    """Return a table in which a percent sign behind all numbers of a column is in its name."""
    header = [*table.header]
    rows = [*table.cells]
    for number, texts in enumerate(zip(*table.cells)):
        values = [text for text in texts if not means_no_number(text)]
        is_percent = bool(values) and all(text.endswith("%") for text in values)
        if is_percent and all(like_a_number(_without_percent(text)) for text in values):
            header[number] += "" if "%" in header[number] else " [%]"
            rows = [
                [*row[:number], _without_percent(row[number]), *row[number + 1 :]] for row in rows
            ]
    return replace(table, header=header, cells=rows) if rows != table.cells else table


def _without_percent(text: str) -> str:
    return text.removesuffix("%").rstrip()
