"""Checks of the cells of a table, column by column."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from shlex import quote

from .complaints import Complaints
from .fault_names import ZERO
from .table import Cells, Columns, Formula
from .words import NOT_KNOWN

# What a spreadsheet shows in place of a value, in any language: "#DIV/0!", "#NV", "Err:502".
_ERROR = re.compile(r"#[¡¿]?[\w/ ]+[!?]|#N/[AD]|#NV|#{3,}|Err:\d{3}")
_ROUNDED = re.compile(r"\d([.,]\d+)?[eE]\+\d\d")  # as a spreadsheet shows a long number
_WHOLE = ("n_robots", "faulty", "seed")
_NUMBERS = (
    *_WHOLE,
    "performance",
    "onset",
    "time",
    "time_to_finish",
    "work",
    "duration",
    "contacts",
)
_DIGITS = 15  # that a spreadsheet keeps of a number


def check_cells(columns: Columns, complaints: Complaints, *, is_summed: bool) -> None:
    """Check each column by itself: values, labels that only some rows have, and numbers.

    Args:
        complaints: take the first cell of a column that cannot be.
        is_summed: whether rows of robots were summed.
    """
    meanings = columns.by_meaning
    blocks = {cells.name for cells in columns.blocks}
    used = {cells.name for cells in (*meanings.values(), *columns.parameters)} | blocks
    trial = meanings.get("trial")
    checked: dict[str, Cells] = {
        cells.name: cells for cells in (*meanings.values(), *columns.parameters)
    }
    for name, cells in columns.table.columns.items():
        with complaints.noted():
            if name in used:
                _refuse_spoiled(cells)
            if name in blocks or (trial and name == trial.name):
                _refuse_rounded(cells)
            if name in blocks:
                _refuse_unknown_number(cells)
            if name in checked and name not in complaints.columns:
                _refuse_other_than_numbers(checked[name], columns)
    if {"fault", "faulty"} <= meanings.keys():
        with complaints.noted():
            _refuse_uncounted(meanings["fault"], meanings["faulty"], complaints)
    labels = [meanings.get(label) for label in ("policy", "table", "n_robots")]
    if is_summed or "time" in meanings:  # several rows make a trial
        labels.append(trial)
    if len(columns.blocks) > 1:  # one alone is checked with the pairs
        labels += columns.blocks
    every_row = range(len(columns.table.cells))
    for label in filter(None, labels):
        with complaints.noted():
            _refuse_gaps(label, every_row)
    if {"onset", "faulty"} <= meanings.keys():
        faulty = meanings["faulty"].texts
        with_fault = [row for row in every_row if faulty[row] not in ("", *ZERO)]
        with complaints.noted():
            _refuse_gaps(meanings["onset"], with_fault)


def _refuse_spoiled(cells: Cells) -> None:
    """Refuse the error of a formula, and a formula that nobody computed."""
    for row, text in enumerate(cells.texts):
        if isinstance(text, Formula):
            raise cells.error(
                row,
                "should be a value, as nobody computed this formula: open the file in a "
                "spreadsheet and save it",
            )
        if text.startswith(("#", "Err:")) and _ERROR.fullmatch(text):
            raise cells.error(
                row, "should be a value, where a spreadsheet shows the error of a formula"
            )


def _refuse_other_than_numbers(cells: Cells, columns: Columns) -> None:
    """Refuse what is no number in a column of numbers; an empty cell only where one is needed."""
    meaning = cells.meaning
    least = 0.0 if meaning else -math.inf  # a parameter may be any number
    if meaning == "n_robots":
        least = 1.0
    is_named = meaning == "seed" and not (len(columns.blocks) == 1 and cells.are_like_numbers)
    if (meaning and meaning not in _NUMBERS) or is_named:
        return
    is_needed = not meaning or (meaning == "work" and "time_to_finish" in columns.by_meaning)
    if meaning == "performance":
        is_needed = not {"time", "time_to_finish"} & columns.by_meaning.keys()
    # Of equal cells the first one; a merged cell is equal to no other.
    first_rows = {(type(text), text): row for row, text in reversed([*enumerate(cells.texts)])}
    rows = [row for row in first_rows.values() if cells.texts[row] or is_needed]
    for row in sorted(rows, key=lambda row: (not cells.texts[row], row)):
        if meaning in _WHOLE:
            cells.whole_number(row, least)
        else:
            cells.number(row, least)


def _refuse_rounded(cells: Cells) -> None:
    """Refuse labels that a spreadsheet has rounded, so that several may have become one."""
    long = {text for text in cells.texts if text.isdecimal() and len(text) > _DIGITS}
    is_rounded = not any(text[_DIGITS:].strip("0") for text in long)
    for row, text in enumerate(cells.texts):
        if _ROUNDED.fullmatch(text) or (is_rounded and text in long):
            raise cells.error(
                row,
                f"should have all its digits, of which a spreadsheet keeps {_DIGITS}: let the "
                "column be of texts before they are put in",
            )


def _refuse_unknown_number(cells: Cells) -> None:
    """Refuse a word for no value among numbers; among names it is one."""
    texts = cells.texts
    unknown = [row for row, text in enumerate(texts) if text and text.casefold() in NOT_KNOWN]
    numbers = {*texts} - {texts[row] for row in unknown} - {""}
    if unknown and numbers and all(map(str.isdecimal, numbers)):
        raise cells.error(unknown[0], "should be a number, as in other rows")


def _refuse_uncounted(fault: Cells, faulty: Cells, complaints: Complaints) -> None:
    """Refuse a fault without the number of robots that fail by it."""
    rows = complaints.missing.get(faulty.name, ())
    if rows and faulty.name not in complaints.columns:
        name = fault.texts[rows[0]]
        raise faulty.error(rows[0], f"should be how many robots fail by {name!r}, 1 or more")


def _refuse_gaps(cells: Cells, rows: Sequence[int]) -> None:
    """Refuse an empty cell where other rows have a label: it belongs to each row."""
    empty = [row for row in rows if not cells.texts[row]]
    if empty and len(empty) < len(rows):
        raise cells.error(
            empty[0],
            "should be there in each row, as in others, also where a group has it in its first "
            f"row alone; --value {quote(f'{cells.name}:=NEW')} fills all such cells",
        )
