"""A CSV file as people type it: its delimiter, and what each column is."""

from __future__ import annotations

import csv
import difflib
import hashlib
import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from .inputs import IndicatorError

# What a column is, and the words that name it in files; small letters, "_" for all that is none.
NAMES: dict[str, tuple[str, ...]] = {
    "performance": ("p", "delivered", "items", "score"),
    "n_robots": ("robots", "n", "swarm_size"),
    "fault": ("failure", "mode"),
    "faulty": ("m", "failed"),
    "onset": ("fault_time",),
    "policy": ("controller",),
    "seed": ("pair", "block"),
    "trial": ("run", "id"),
    "time": (),
    "duration": ("length",),
    "table": (),
}
_MEANING = {word: column for column, words in NAMES.items() for word in (column, *words)}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


class Row(NamedTuple):
    """One row of a file.

    Attributes:
        place: file and line.
        line: that it ends in.
        cells: by the name of the column in the file.
        names: what a column is (a key of `NAMES`) to its name in the file.
        decimal: the sign before decimals.
    """

    place: str
    line: int
    cells: Mapping[str, str]
    names: Mapping[str, str]
    decimal: str

    def text(self, column: str) -> str:
        """Return a cell; empty where there is none."""
        return self.cells.get(self.names.get(column, column), "")

    def number(self, column: str, least: float = -math.inf, *, whole: bool = False) -> float:
        """Return a cell as a finite number of at least `least`."""
        cell = self.text(column)
        plain = cell if self.decimal == "." else cell.replace(".", " ").replace(self.decimal, ".")
        value = float(plain) if _NUMBER.fullmatch(plain) else math.inf
        if math.isfinite(value) and value >= least and (not whole or value.is_integer()):
            return value
        should = f"should be a {'whole ' * whole}number"
        should += f", {least:g} or more" if math.isfinite(least) else ""
        if "," in cell and self.decimal == ".":
            should += " without a sign between thousands; --decimal , where decimals have a comma"
        elif column not in NAMES:
            should += f", as every column that varies is a parameter; else --ignore {column!r}"
        raise self.error(column, should)

    def number_or_none(self, column: str) -> float | None:
        """Return a cell as a number, 0 or more; None: it is empty or not there."""
        return self.number(column, 0.0) if self.text(column) else None

    def whole_or_none(self, column: str, least: float) -> int | None:
        """Return a cell as a whole number; None: it is empty or not there."""
        return int(self.number(column, least, whole=True)) if self.text(column) else None

    def error(self, column: str, should: str) -> IndicatorError:
        """Return the error that a cell cannot be."""
        name, cell = self.names.get(column, column), self.text(column)
        if name not in self.cells:
            return IndicatorError(f"{self.place}: {column} is missing: {should}")
        shown = repr(cell) if cell else "nothing"
        return IndicatorError(f"{self.place}, column {name!r}: {shown}: {should}")


def read_rows(
    path: Path, columns: Mapping[str, str], ignore: Sequence[str], decimal: str
) -> tuple[list[Row], list[str], str]:
    """Return the rows of a file, the columns that may be parameters, and the file's digest.

    Args:
        columns: what a column is (a word of `NAMES`) to its name in the file.
        ignore: names of columns to leave out.
        decimal: the sign before decimals, "." or ",".

    Raises:
        IndicatorError: the file cannot be read, holds no row or is no such table, or a column is
            not there.
    """
    if decimal not in (".", ","):
        raise IndicatorError(f"--decimal {decimal}: should be . or ,")
    lines, digest = _lines(path)
    header, cells = _cells(path, lines)
    names, others = _columns(path, header, columns, ignore)
    if not cells:
        raise IndicatorError(f"{path} holds no trial: should have a row for each below the names")
    rows = [Row(f"{path}, line {line}", line, row, names, decimal) for line, row in cells]
    return rows, others, digest


def _lines(path: Path) -> tuple[list[str], str]:
    """Return the lines of a file and the digest of its content."""
    try:
        content = path.read_bytes()
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise IndicatorError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError:
        raise IndicatorError(f"{path} is not UTF-8 text: save it as CSV UTF-8") from None
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        for sign in line.replace("\t", ""):
            if unicodedata.category(sign) in ("Cc", "Cf"):
                raise IndicatorError(
                    f"{path}, line {number}: holds {sign!r}: should be plain text, without control "
                    "signs"
                )
    return lines, hashlib.sha256(content).hexdigest()[:16]


def _cells(path: Path, lines: list[str]) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Return the columns' names, and line and cells by these names of every row with any."""
    start = next((n for n, line in enumerate(lines) if line.strip()), None)
    if start is None:
        raise IndicatorError(f"{path} is empty: should have a row of column names, then the trials")
    delimiter = max(";\t,", key=lines[start].count)
    reader = csv.reader(lines[start:], delimiter=delimiter, skipinitialspace=True)
    rows = []
    try:
        header = [cell.strip() for cell in next(reader)]
        for values in reader:
            cells = [cell.strip() for cell in values]
            line = start + reader.line_num
            if any(cells[len(header) :]):
                raise IndicatorError(
                    f"{path}, line {line}: has {len(cells)} values, more values than the "
                    f"{len(header)} columns: if decimals have a comma, put ; between the columns"
                )
            if any(cells):
                rows.append((line, dict.fromkeys(header, "") | dict(zip(header, cells))))
    except csv.Error as error:
        raise IndicatorError(f"{path} is not a CSV file: {error}") from error
    return header, rows


def _columns(
    path: Path, header: Sequence[str], columns: Mapping[str, str], ignore: Sequence[str]
) -> tuple[dict[str, str], list[str]]:
    """Return the name of each known column, and the columns that are left as parameters."""
    for column in columns:
        if column not in _MEANING:
            raise IndicatorError(f"--column {column}: {_one_of(column, _MEANING)}")
    for name in (*columns.values(), *ignore):
        if name not in header:
            raise IndicatorError(f"{path} has no column {name!r}: {_one_of(name, header)}")
    names = {_MEANING[column]: name for column, name in columns.items()}
    given, others = {*names}, []
    for name in header:
        if not name or name in ignore or name in columns.values():
            continue
        if header.count(name) > 1:
            raise IndicatorError(f"{path} has two columns {name!r}: should have one of that name")
        word = _word(name)
        known = _MEANING.get(word)
        if known is None or (known in given and name not in NAMES):
            close = difflib.get_close_matches(word, _MEANING, n=1, cutoff=0.75)
            if close and known is None and len(word) > 3:
                raise IndicatorError(
                    f"{path} has a column {name!r}; did you mean {close[0]!r}? Else rename it, or "
                    f"leave it out by --ignore {name!r}"
                )
            others.append(name)
        elif known in names:
            raise IndicatorError(
                f"{path} has columns {names[known]!r} and {name!r}, both {known}: say "
                f"which it is by --column {known}=NAME, and leave the other out by --ignore NAME"
            )
        else:
            names[known] = name
    return names, others


def _word(name: str) -> str:
    """Return a column's name in small letters, without unit: "Time [s]" is "time"."""
    bare = re.sub(r"\s*[\[(].*?[\])]\s*", " ", name)
    return re.sub(r"\W+", "_", bare.strip().lower()).strip("_")


def _one_of(name: str, known: Iterable[str]) -> str:
    names = [each for each in known if each]
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean {close[0]!r}?" if close else f"should be one of {', '.join(names)}"
