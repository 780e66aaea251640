r"""The tables of a study for a paper: LaTeX that needs \usepackage{booktabs} and nothing else."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import zip_longest

from swarm_logistics_env.core.records import plain

from .figures import CAPPED
from .for_a_paper import HOLM, PaperTables
from .section import SATURATED, Section, Texts, slug

_LETTERS_OF_A_COLUMN = 58  # in a column of 3.5 inch
_LETTERS_OF_A_PAGE = 75  # across a page of one column; with more they are smaller
_LONG = 30  # letters of a column, of which more are broken into lines
_LETTERS_BETWEEN = 1.5  # as wide is the room between two columns of a table
_NUMBER = re.compile(r"(?<![\w.-])-?(?:\d+(?:\.\d+)?|∞)(?![\w.]| (?!to )[a-z])")
_LEVEL = r"(?:> )?[\d.]+ %"
_ROOM = r"(?:\\phantom\{[^}]*\})+"
_ESCAPES = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    "&": r"\&", "%": r"\%", " %": r"\,\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{",
    "}": r"\}", "|": r"\textbar{}", "--": "-{}-", "->": r"$\to$", "→": r"$\to$", "–": "--",
    "∞": r"$\infty$", "†": r"\dag{}", "<": "$<$", ">": "$>$", "≤": r"$\le$", "…": r"\dots{}",
}  # fmt: skip
_SIGNS = "|".join(map(re.escape, sorted(_ESCAPES, key=len, reverse=True)))
_PERFORMANCE = r"\bP_(?:N\+m|new|[A-Za-z])\b"  # P of a condition, e.g. "P_F"
# Besides signs: what stands in math mode, and letters that pdfLaTeX does not know.
_SPECIAL = re.compile(
    rf"({_PERFORMANCE}|{_SIGNS})|((?<![\w.-])-\d+(?:\.\d+)?|\b[Nm] = \d+)|([^\x00-\u017f])"
)


def latex_tables(tables: PaperTables) -> str:
    """Return the tables of a study, each a table environment with caption and label."""
    keys: list[str] = []
    parts = ["% In the preamble: \\usepackage{booktabs}\n"]
    for section in (_readable(section, tables.labels) for section in tables.sections):
        key = slug(section.title).lower()
        label = f"tab:{key}"
        if key in keys:
            label += f"-{keys.count(key) + 1}"
        keys.append(key)
        parts.append("\n".join(_table(section, tables.about, label)) + "\n")
    return "\n".join(parts)


def _readable(section: Section, labels: Mapping[str, str]) -> Section:
    """Return a section whose parameters are called as a reader does, with their units."""
    values = r"(?P<values>(?: = | )[\d.]+(?:(?:→| -> )[\d.]+(?:, [\d.]+)*)?)"

    def readable(text: str) -> str:
        for name, label in labels.items():
            words, _, unit = label.rstrip("]").partition(" [")
            with_unit = f"{words}\\g<values> {unit}".rstrip()
            text = re.sub(rf"\b{re.escape(name)}{values}", with_unit, text).replace(name, words)
        return re.sub(r"(?<=\d)(→| -> )(?=\d)", " to ", text)

    rows = tuple(tuple(map(readable, row)) for row in section.rows)
    return section._replace(title=readable(section.title), rows=rows)


def _table(section: Section, about: str, label: str) -> Iterator[str]:
    levels = [*dict.fromkeys(re.findall(_LEVEL, " ".join(section.columns)))]
    intervals = f"{levels[0]} intervals in brackets." if levels else ""
    if len(levels) > 1 or "level" in section.columns:
        intervals = "Intervals in brackets, at the level in the heading or in the row."
    caption = [f"{section.title}.", about, intervals, *(section.lines or [HOLM])]
    if any(SATURATED in cell for row in section.rows for cell in row):
        caption.append(CAPPED)
    columns = [_aligned(column) for column in zip(*section.rows)]
    columns[0] = [_escape(row[0]) for row in section.rows]
    widths = [max(map(len, column)) for column in zip(section.columns, *section.rows)]
    first, *other_widths = widths  # names of policies cannot be broken
    layout = "l" + "".join(
        "l" if width <= _LONG else r"p{0.16\linewidth}" for width in other_widths
    )
    n_letters = first + sum(min(width, _LONG) + _LETTERS_BETWEEN for width in other_widths)
    # Over both columns of a page that has two, if it needs them.
    environment = "table*" if n_letters > _LETTERS_OF_A_COLUMN else "table"
    yield rf"\begin{{{environment}}}"
    yield r"\centering"
    yield rf"\caption{{{_escape(' '.join(filter(None, caption)))}}}"
    yield rf"\label{{{label}}}"
    yield r"\smallskip"
    is_wide = n_letters > _LETTERS_OF_A_PAGE
    yield r"\scriptsize" if is_wide else r"\footnotesize"
    yield rf"\setlength{{\tabcolsep}}{{{1.5 if is_wide else 3}pt}}"
    yield rf"\begin{{tabular}}{{@{{}}{layout}@{{}}}}"
    yield from (r"\toprule", _row(map(_escape, section.columns)), r"\midrule")
    yield from map(_row, zip(*columns))
    yield from (r"\bottomrule", r"\end{tabular}", rf"\end{{{environment}}}")


def _row(cells: Iterable[str]) -> str:
    row = " & ".join(cells)
    if row.startswith(("[", "*")):  # or it would be read as an option of the line break before it
        row = f"{{}}{row}"
    return rf"{row} \\"


def _aligned(cells: Texts) -> list[str]:
    """Return the cells of a column; their numbers have their points below each other."""
    by_rank = list(zip_longest(*map(_NUMBER.findall, cells), fillvalue=""))
    aligned = []
    for cell in cells:
        row = ""
        end = 0
        for match, numbers_of_rank in zip(_NUMBER.finditer(cell), by_rank):
            row += _escape(cell[end : match.start()]) + _padded(match[0], numbers_of_rank)
            end = match.end()
        row += _escape(cell[end:])
        # Room for digits stands outside of brackets and behind a comma.
        row = re.sub(rf"\[\$({_ROOM})", r"$\1$[$", row)
        aligned.append(re.sub(rf"({_ROOM})\$([],])", r"$\2$\1$", row))
    return aligned


def _padded(number: str, column: Sequence[str]) -> str:
    """Return a number in math mode, as wide before its point and behind it as those of `column`."""
    before, behind = _zeros(number)
    widest_before = max((_zeros(text)[0] for text in column), key=len)
    widest_behind = max((_zeros(text)[1] for text in column), key=len)
    left = _room(widest_before[len(before) :])
    right = _room(widest_behind[len(behind) :])
    sign = ""
    if number.startswith("-"):
        sign = "{-}" if left else "-"  # a bare one would be binary behind that room
    elif any("-" in text for text in column):
        sign = _room("-")
    digits = number.lstrip("-").replace("∞", r"\infty ")
    return f"${left}{sign}{digits}{right}$"


def _zeros(number: str) -> tuple[str, str]:
    """Return zeros as wide as a number without its sign: before its point, and from it on."""
    zeros = re.sub(r"\d", "0", number.lstrip("-").replace("∞", "00"))
    digits, point, decimals = zeros.partition(".")
    return digits, point + decimals


def _room(text: str) -> str:
    """Return room as wide as a text."""
    return rf"\phantom{{{text}}}" if text else ""


def _escape(text: str) -> str:
    text = re.sub(r"(?<!\w)'([^']*)'", r"`\1'", text)  # opening and closing quotes

    def special(match: re.Match[str]) -> str:
        sign, math, letter = match.groups()
        if sign is not None and sign.startswith("P_"):
            return rf"$P_{{\mathrm{{{sign[2:]}}}}}$"
        if sign is not None:
            return _ESCAPES[sign]
        if letter is not None:
            return rf"\texttt{{U+{ord(letter):04X}}}"
        if "=" in math:  # no line ends within
            return f"${{{math}}}$"
        return f"${math}$"

    return _SPECIAL.sub(special, plain(text))
