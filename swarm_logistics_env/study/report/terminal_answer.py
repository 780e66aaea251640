"""The answer for a terminal, a pipe or a file: sentences, then a row a question, in columns."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import wrap

from .answer import Answer

PLAIN_WIDTH = 80  # of what is read by a program or kept in a file
_SHORTEST = 8  # letters of a question


def terminal_answer(answer: Answer, width: int = PLAIN_WIDTH, *, shortens: bool = False) -> str:
    """Return the answer as text. Sentences are folded to the width; no row is folded or left out.

    Args:
        width: of the terminal [characters].
        shortens: whether questions are shortened so that no row is wider.
    """
    head = [line for text in answer.head for line in _fold(text, width)]
    return "\n".join(
        [*head, *_rows(answer, width if shortens else None), *_fold(answer.notes, width)]
    )


def _rows(answer: Answer, width: int | None) -> Iterator[str]:
    """Yield the lines in columns, below their headings; those on each policy and task together."""
    columns = [
        answer.columns,
        *map(answer.row, answer.lines, [line.question for line in answer.lines]),
    ]
    question_width, *widths = [max(map(len, column)) for column in zip(*columns)]
    if width is not None:
        rest = sum(widths) + 2 * len(widths)
        question_width = max(_SHORTEST, min(question_width, width - rest))

    def row(cells: tuple[str, ...]) -> str:
        question, value, *others = cells
        padded = [f"{cell:{width}}" for cell, width in zip(others, widths[1:])]
        left = f"{_shortened(question, question_width):{question_width}}"
        return "  ".join([left, f"{value:>{widths[0]}}", *padded]).rstrip()

    yield row(("", *answer.columns[1:]))
    groups = answer.lines_by_subject
    for subject, lines in groups.items():
        if len(groups) > 1:
            yield f"{subject}:"
        yield from (row(answer.row(line, line.question)) for line in lines)


def _shortened(text: str, width: int) -> str:
    """Return a text of at most so many letters: its middle is left out, as its ends tell most."""
    if len(text) > width:
        text = text.replace(", ", " ").replace(" of ", "/")
    if len(text) <= width:
        return text
    behind = (width - 1) * 3 // 5
    return f"{text[: width - 1 - behind]}…{text[-behind:]}"


def _fold(text: str, width: int) -> list[str]:
    # Paths and names are longer than a line sometimes: they are broken, never cut.
    return wrap(text, width, subsequent_indent="  ", break_on_hyphens=False)
