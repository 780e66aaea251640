"""Checks of cells: what a spreadsheet put in place of a value, and labels that some rows lack."""

from __future__ import annotations

import re
from collections.abc import Sequence
from shlex import quote

from .fault_names import NOT_KNOWN, ZERO
from .table import Cells, Columns, Formula

# What a spreadsheet shows in place of a value, in any language: "#DIV/0!", "#NV", "Err:502".
_ERROR = re.compile(r"#[¡¿]?[\w/ ]+[!?]|#N/[AD]|#NV|#{3,}|Err:\d{3}")
_ROUNDED = re.compile(r"\d([.,]\d+)?[eE]\+\d\d")  # as a spreadsheet shows a long number
_DIGITS = 15  # that a spreadsheet keeps of a number


def check_cells(columns: Columns, *, is_summed: bool) -> None:
    """Refuse what a spreadsheet put in place of a value, and labels that only some rows have.

    Args:
        is_summed: whether rows of robots were summed.

    Raises:
        IndicatorError: there is such a cell, of which the first of its column is named.
    """
    meanings = columns.by_meaning
    blocks = {cells.name for cells in columns.blocks}
    used = {cells.name for cells in (*meanings.values(), *columns.parameters)} | blocks
    trial = meanings.get("trial")
    for name, cells in columns.table.columns.items():
        if name in used:
            _refuse_spoiled(cells)
        if name in blocks or (trial and name == trial.name):
            _refuse_rounded(cells)
        if name in blocks:
            _refuse_unknown_number(cells)
    labels = [meanings.get(label) for label in ("policy", "table", "n_robots")]
    if is_summed or "time" in meanings:  # several rows make a trial
        labels.append(trial)
    if len(columns.blocks) > 1:  # one alone is checked with the pairs
        labels += columns.blocks
    every_row = range(len(columns.table.cells))
    for label in filter(None, labels):
        _refuse_gaps(label, every_row)
    if {"onset", "faulty"} <= meanings.keys():
        faulty = meanings["faulty"].texts
        with_fault = [row for row in every_row if faulty[row] not in ("", *ZERO)]
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


def _refuse_gaps(cells: Cells, rows: Sequence[int]) -> None:
    """Refuse an empty cell where other rows have a label: it belongs to each row."""
    empty = [row for row in rows if not cells.texts[row]]
    if empty and len(empty) < len(rows):
        raise cells.error(
            empty[0],
            "should be there in each row, as in others, also where a group has it in its first "
            f"row alone; --value {quote(f'{cells.name}:=NEW')} fills all such cells",
        )
