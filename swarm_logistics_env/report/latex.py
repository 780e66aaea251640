r"""Sections of a report as LaTeX tables (with \usepackage{booktabs})."""

from __future__ import annotations

import re
from collections.abc import Iterable

from swarm_logistics_env.report.result_tables import Section

_SIGNS = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "->": r"$\to$",
    "–": "--",
    "∞": r"$\infty$",
    "†": r"\dag{}",
    "<": "$<$",
    ">": "$>$",
}
_FOUND = re.compile("|".join(map(re.escape, sorted(_SIGNS, key=len, reverse=True))))


def latex_tables(sections: Iterable[Section]) -> str:
    """Return the tables of sections, each a table environment with its title as caption."""
    return "\n".join(_table(section) for section in sections if section.rows)


def _table(section: Section) -> str:
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{_escaped(section.title)}}}",
        rf"\begin{{tabular}}{{{'l' * len(section.columns)}}}",
        r"\toprule",
        _row(section.columns),
        r"\midrule",
        *map(_row, section.rows),
        r"\bottomrule",
        r"\end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _row(cells: Iterable[str]) -> str:
    # In braces: a row that starts with "[" would be read as an option of the line break before it.
    return " & ".join(f"{{{_escaped(cell)}}}" for cell in cells) + r" \\"


def _escaped(text: str) -> str:
    return _FOUND.sub(lambda found: _SIGNS[found[0]], text)
