"""Lines of C: comments, declarations, and lines that are not too long."""

from __future__ import annotations

import io
import textwrap
import tokenize
from collections.abc import Iterator

from .c_values import ArrayOf, Kind

WIDTH = 100  # of a line
INDENT = "    "


def comments_of(source: str) -> dict[int, str]:
    """Return the comments of Python source by their lines; those of several lines as one."""
    comments: dict[int, str] = {}
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT and not token.string.startswith(("# fmt", "# type")):
            comments[token.start[0]] = token.string.removeprefix("#").strip()
    for line in sorted(comments, reverse=True):
        if line + 1 in comments:
            comments[line] += " " + comments.pop(line + 1)
    return comments


def comment_lines(text: str, indent: str) -> list[str]:
    """Return the lines of a comment of C."""
    text = text.replace("`", "").replace("*/", "* /")
    width = WIDTH - len(indent) - len("/*  */")
    lines = [line for part in text.splitlines() for line in textwrap.wrap(part, width) or [""]]
    if not lines:
        return []
    lines = [f"{indent} * {line}".rstrip() for line in lines]
    lines[0] = lines[0].replace(" *", "/*", 1)
    lines[-1] += " */"
    return lines


def wrapped_lines(line: str) -> Iterator[str]:
    """Yield a line of C as lines of at most `WIDTH` characters, broken at commas or else spaces."""
    indent = line[: len(line) - len(line.lstrip())] + 2 * INDENT
    while len(line) > WIDTH:
        end = line.rfind(", ", len(indent), WIDTH) + 1 or line.rfind(" ", len(indent), WIDTH)
        if end <= 0:
            break
        yield line[:end]
        line = indent + line[end:].lstrip()
    yield line


def declared(name: str, kind: Kind, *, is_constant: bool = False) -> str:
    """Return the declaration of a variable, or of a parameter that is an array."""
    if isinstance(kind, ArrayOf):
        return f"{'const ' if is_constant else ''}{kind.element.name} *{name}"
    return f"{kind.name} {name}"
