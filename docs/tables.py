"""Blocks of a page between markers, and Markdown tables to put there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

BLOCK = "<!-- tables: {name} -->"
END = "<!-- end of tables -->"


def block_of(text: str, name: str) -> str:
    """Return what stands between the markers of a block.

    Raises:
        SystemExit: the page has no such block.
    """
    _, found, rest = text.partition(BLOCK.format(name=name))
    block, ended, _ = rest.partition(END)
    if not (found and ended):
        raise SystemExit(f"the page has no {BLOCK.format(name=name)} followed by {END}")
    return block.strip()


def rewritten(text: str, blocks: Mapping[str, str]) -> str:
    """Return a page with other text between the markers of each block.

    Raises:
        SystemExit: a block has no pair of markers.
    """
    for name, block in blocks.items():
        block_of(text, name)  # it is there
        before, start, rest = text.partition(BLOCK.format(name=name))
        text = f"{before}{start}\n\n{block}\n\n{END}{rest.partition(END)[2]}"
    return text


def table(head: tuple[str, ...], rows: Sequence[tuple[object, ...]]) -> str:
    """Return a Markdown table."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(str(cell) for cell in line)} |" for line in lines)
