"""Texts as cells of a CSV file that no spreadsheet computes."""

from __future__ import annotations

import re

# What a spreadsheet computes; an apostrophe before it makes it a text there.
_FORMULA = re.compile(r"[\s']*[=+\-@\t\r\n]")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def inert(text: str) -> str:
    """Return a text as a cell that no spreadsheet computes; `text_of_inert` undoes it."""
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def text_of_inert(cell: str) -> str:
    """Return a cell's text, without the apostrophe that `inert` put before it."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell
