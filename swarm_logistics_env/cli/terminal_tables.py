"""Report sections on standard output: drawn at a terminal, Markdown elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from swarm_logistics_env.records import plain
from swarm_logistics_env.report.answer import MOST_LINES, Answer, digest
from swarm_logistics_env.report.section import WORDS, Section
from swarm_logistics_env.report.write import section_markdown
from swarm_logistics_env.spi.estimate import SIGNS

_PLAIN_WIDTH = 80  # of what is read by a program or kept in a file
_COLOURS = {word: SIGNS[verdict].colour for verdict, word in WORDS.items()}
_VERDICTS = re.compile(rf"(?<=  )({'|'.join(_COLOURS)})\b")


def show(section: Section) -> None:
    """Print one section."""
    console = Console(highlight=False)
    if not console.is_terminal:
        # No wrapping: whatever reads this knows no terminal width.
        console.out(section_markdown(section), highlight=False)
        return
    console.rule(escape(plain(section.title)), align="left")
    if section.columns:
        table = Table(box=None, pad_edge=False, header_style="bold")
        for column in section.columns:
            # Folded where a terminal is narrow: a number that is cut is another number.
            table.add_column(escape(plain(column)), overflow="fold")
        for row in section.rows:
            table.add_row(*(escape(plain(value)) for value in row))
        console.print(table)
    for line in section.lines:
        console.print(escape(plain(line)))
    console.print()


def show_table(
    title: str, columns: Sequence[str], rows: Iterable[tuple[str, ...]], *lines: str
) -> None:
    """Print a table, and lines of text below it."""
    show(Section(title, tuple(columns), tuple(rows), lines))


def show_answer(found: Answer, where: Path | None, *, whole: bool = False) -> None:
    """Print the answer of a study on one screen, or with every line of it."""
    console = Console(highlight=False)
    width = console.width if console.is_terminal else _PLAIN_WIDTH
    shown = Text(plain_lines(digest(found, width, where, None if whole else MOST_LINES)))
    for word in _VERDICTS.finditer(shown.plain):
        shown.stylize(_COLOURS[word[1]], *word.span())
    console.print(shown, soft_wrap=True)


def plain_lines(text: str) -> str:
    """Return lines of text without signs that steer a terminal."""
    return "\n".join(map(plain, text.split("\n")))
