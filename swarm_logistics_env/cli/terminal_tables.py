"""Report sections on standard output: drawn at a terminal, Markdown elsewhere."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from swarm_logistics_env.report.markup import section_markdown
from swarm_logistics_env.report.result_tables import Section


def show(section: Section) -> None:
    """Print one section."""
    console = Console(highlight=False)
    if not console.is_terminal:
        # No wrapping: whatever reads this knows no terminal width.
        console.out(section_markdown(section), highlight=False)
        return
    console.rule(escape(section.title), align="left")
    if section.columns:
        table = Table(box=None, pad_edge=False, header_style="bold")
        for column in section.columns:
            # Folded where a terminal is narrow: a number that is cut is another number.
            table.add_column(escape(column), overflow="fold")
        for row in section.rows:
            table.add_row(*(escape(value) for value in row))
        console.print(table)
    for line in section.lines:
        console.print(escape(line))
    console.print()
