"""Version of the code that decides what a run gives: when it changes, stored runs are stale."""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from pathlib import Path

# Policies are not here, only what calls them: each policy has an identity of its own.
SOURCES = (
    "scenario.py",
    "streams.py",
    "kernels.py",
    "observations.py",
    "hearing.py",
    "episode.py",
    "policies/policy.py",
    "warehouse",
)
# These files share out the worlds of a vector environment; a run is one world.
LEFT_OUT = ("warehouse/crew.py", "warehouse/atomic.py")


@cache
def code_version() -> str:
    """Return the digest of the package's simulation, 16 hexadecimal digits.

    Docstrings, comments on lines of their own and blank lines do not count.
    """
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for name in SOURCES:
        source = package / name
        for file in sorted(source.rglob("*.py")) if source.is_dir() else [source]:
            path = file.relative_to(package).as_posix()
            if path in LEFT_OUT:
                continue
            digest.update(path.encode() + b"\0")
            digest.update(without_prose(file.read_text(encoding="utf-8")).encode() + b"\0")
    return digest.hexdigest()[:16]


def without_prose(source: str) -> str:
    """Return Python source without docstrings, lines that only comment, and blank lines."""
    prose: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            first = node.body[0] if node.body else None
            if isinstance(first, ast.Expr) and ast.get_docstring(node, clean=False) is not None:
                prose.update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    lines = enumerate(source.splitlines(), start=1)
    return "\n".join(
        line.rstrip()
        for number, line in lines
        if number not in prose and line.strip() and not line.lstrip().startswith("#")
    )
