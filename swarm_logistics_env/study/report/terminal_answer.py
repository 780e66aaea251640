"""The answer for a terminal: in columns, folded to its width."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from textwrap import wrap

from more_itertools import map_reduce

from .answer import MOST_LINES, Answer, Line

_NO_BREAK = "\N{NO-BREAK SPACE}"


def terminal_answer(answer: Answer, width: int, most: int | None = MOST_LINES) -> str:
    """Return the answer for a terminal.

    Args:
        width: of the terminal [characters]; no line is longer.
        most: lines at most; None: as many as it takes.
    """
    above = (answer.comparison, answer.scope, answer.performance)
    head = [line for text in above for line in _fold(text, width)]
    tail = _fold(answer.notes, width)
    rows = _rows(answer, width)
    n_rows = len(rows) if most is None else most - len(head) - len(tail)
    if len(rows) > n_rows:
        rows = [*rows[: n_rows - 1], f"and {len(rows) - n_rows + 1} lines more: --full"]
    return "\n".join([*head, *rows, *tail])


def _rows(answer: Answer, width: int) -> list[str]:
    """Return the lines in columns, as few as questions and verdicts can be folded into."""
    level = answer.level
    columns = zip(*((line.question, line.value, line.interval(level)) for line in answer.lines))
    question_width, *other_widths = [max(map(len, column)) for column in columns]
    widest = min(question_width, max(8, width - sum(other_widths) - 16))
    layouts = (
        list(_in_columns(answer, [narrower, *other_widths], width))
        for narrower in range(min(20, widest), widest + 1)
    )
    return min(layouts, key=len)


def _in_columns(answer: Answer, widths: Sequence[int], width: int) -> Iterator[str]:
    lines_by_policy: dict[str, list[Line]] = map_reduce(answer.lines, lambda line: line.policy)
    for policy, lines in lines_by_policy.items():
        if len(lines_by_policy) > 1:
            yield f"{policy}:"
        for line in lines:
            question, *question_rest = _fold_question(line.question, widths[0])
            interval = line.interval(answer.level)
            left = f"{question:{widths[0]}}  {line.value:>{widths[1]}}  {interval:{widths[2]}}"
            verdict, *verdict_rest = wrap(line.verdict_text, max(10, width - len(left) - 2)) or [""]
            yield f"{left}  {verdict}".rstrip()
            for question, verdict in zip_longest(question_rest, verdict_rest, fillvalue=""):
                yield f"{question:{len(left)}}  {verdict}".rstrip()


def _fold_question(question: str, width: int) -> list[str]:
    unbroken = values_unbroken(question)
    if max(map(len, unbroken.split(" "))) + 2 > width:  # where there is no room for that
        unbroken = question
    folded = wrap(unbroken, width, subsequent_indent="  ")
    return [part.replace(_NO_BREAK, " ") for part in folded]


def values_unbroken(question: str) -> str:
    """Return a question that is folded beside its values, "1, 2, 3 of 25", not within them."""
    return re.sub(r"(?<= )[\d., ]+ of \d+", lambda m: m[0].replace(" ", _NO_BREAK), question)


def _fold(text: str, width: int) -> list[str]:
    # Paths and names are longer than a line sometimes: they are broken, never cut.
    return wrap(text, width, subsequent_indent="  ", break_on_hyphens=False)
