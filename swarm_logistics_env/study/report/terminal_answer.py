"""The answer for a terminal, a pipe or a file: sentences, then a row a question, in columns."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from textwrap import wrap

from .answer import Answer

PLAIN_WIDTH = 80  # of what is read by a program or kept in a file
_NO_BREAK = "\N{NO-BREAK SPACE}"
_SHORTEST = 8  # letters of a question


def terminal_answer(answer: Answer, width: int = PLAIN_WIDTH, *, shortens: bool = False) -> str:
    """Return the answer as text. Sentences are folded to the width; no row is folded or left out.

    Args:
        width: of the terminal [characters].
        shortens: whether questions are shortened so that no row is wider.
    """
    widest = width if shortens else None
    parts = _fold_all(answer.opening, width)
    if answer.overview is not None:
        parts += _in_columns([answer.overview.columns, *answer.overview.rows], widest)
    parts += _fold_all(answer.summary, width)
    cells = [("", *answer.columns[1:]), *(answer.row(line, line.question) for line in answer.lines)]
    heading, *rows = _in_columns(cells, widest, right=1)
    parts.append(heading)
    groups = answer.lines_by_subject
    for line, row in zip(answer.lines, rows):
        if len(groups) > 1 and line is groups[line.subject][0]:
            parts.append(f"{line.subject}:")
        parts.append(row)
    return "\n".join([*parts, *_fold_all(answer.notes, width)])


def _in_columns(
    rows: Sequence[tuple[str, ...]], width: int | None, right: int | None = None
) -> Iterator[str]:
    """Yield rows in columns, no wider than `width` if the first column can be shortened so far.

    Args:
        right: the index of a column that is flush right; None: none is.
    """
    first_width, *widths = [max(map(len, column)) for column in zip(*rows)]
    if width is not None:
        rest = sum(widths) + 2 * len(widths)
        first_width = max(_SHORTEST, min(first_width, width - rest))
    for question, *cells in rows:
        padded = [
            f"{cell:>{w}}" if index == right else f"{cell:{w}}"
            for index, (cell, w) in enumerate(zip(cells, widths), start=1)
        ]
        yield "  ".join([f"{_shortened(question, first_width):{first_width}}", *padded]).rstrip()


def _shortened(text: str, width: int) -> str:
    """Return a text of at most so many letters: its middle is left out, as its ends tell most."""
    if len(text) > width:
        text = text.replace(", ", " ").replace(" of ", "/")
    if len(text) <= width:
        return text
    behind = (width - 1) * 3 // 5
    return f"{text[: width - 1 - behind]}…{text[-behind:]}"


def _fold_all(texts: Sequence[str], width: int) -> list[str]:
    return [line for text in texts for line in _fold(text, width)]


def _fold(text: str, width: int) -> list[str]:
    # No line ends within "N = 25", "< 10 %" or "95 %".
    unbroken = re.sub(r"(?<=[Nmn=<]) (?=[=<\d])| (?=%)", _NO_BREAK, text)
    # Paths and names are longer than a line sometimes: they are broken, never cut.
    folded = wrap(unbroken, width, subsequent_indent="  ", break_on_hyphens=False)
    return [line.replace(_NO_BREAK, " ") for line in folded]
