"""A CSV file as people type it: its delimiter, and what each column is."""

from __future__ import annotations

import csv
import difflib
import math
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from .inputs import IndicatorError

# What a column is, and the words that name it in files; small letters, "_" for all that is none.
NAMES: dict[str, tuple[str, ...]] = {
    "performance": ("p", "delivered", "deliveries", "items", "score", "throughput"),
    "n_robots": ("robots", "n", "swarm_size", "swarmsize"),
    "fault": ("failure", "mode", "failure_mode", "fault_mode"),
    "faulty": ("m", "failed", "n_faulty", "faulty_robots"),
    "onset": ("fault_onset", "fault_time", "fault_at"),
    "policy": ("controller", "algorithm", "behaviour", "behavior"),
    "seed": ("pair", "block"),
    "trial": ("run", "id", "repetition"),
    "time": ("t", "delivery_time", "delivered_at"),
    "duration": ("length", "trial_length"),
    "table": (),
}
_MEANING = {word: column for column, words in NAMES.items() for word in (column, *words)}
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Table:
    """The cells of a file, found by what their column is.

    Attributes:
        path: of the file.
        header: the columns' names as the file has them.
        places: number of each known column by what it is (a key of `NAMES`).
        others: numbers of the columns that may be parameters.
        rows, lines: the cells, and the line that each row ends in.
        decimal: the sign before decimals.
    """

    path: Path
    header: tuple[str, ...]
    places: dict[str, int]
    others: tuple[int, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    decimal: str = "."

    def text(self, row: int, column: str) -> str:
        """Return a cell; empty where there is none."""
        return self.rows[row][self.places[column]] if column in self.places else ""

    def number(self, row: int, column: str, *, least: float = -math.inf) -> float:
        """Return a cell as a finite number of at least `least`."""
        return self._number(row, self.places[column], least)

    def whole(self, row: int, column: str, *, least: int) -> int | None:
        """Return a cell as a whole number of at least `least`; None: it is empty or not there."""
        if not (cell := self.text(row, column)):
            return None
        value = self._parsed(cell)
        if value is None or not (value >= least and value == int(min(value, 1e15))):
            raise self.error(row, column, f"should be a whole number, {least} or more")
        return int(value)

    def parameters(self, row: int) -> tuple[tuple[str, float], ...]:
        """Return name and value of every other column that varies over the file."""
        return tuple((self.header[place], self._number(row, place)) for place in self._varying)

    def error(self, row: int, column: str, should: str) -> IndicatorError:
        """Return the error that a cell cannot be."""
        if column not in self.places:
            return IndicatorError(
                f"{self.path}, line {self.lines[row]}: {column} is missing: {should}"
            )
        return self._error(row, self.places[column], should)

    def _error(self, row: int, place: int, should: str) -> IndicatorError:
        cell = self.rows[row][place]
        return IndicatorError(
            f"{self.path}, line {self.lines[row]}, column {self.header[place]!r}: "
            f"{repr(cell) if cell else 'nothing'}: {should}"
        )

    def _number(self, row: int, place: int, least: float = -math.inf) -> float:
        value = self._parsed(self.rows[row][place])
        if value is None or value < least:
            bound = f", {least:g} or more" if math.isfinite(least) else ""
            hint = ""
            if value is None and "," in self.rows[row][place]:
                hint = " without a sign between thousands; --decimal , where decimals have a comma"
            elif value is None and place in self.others:
                hint = ", as every column that varies is a parameter; else --ignore " + repr(
                    self.header[place]
                )
            raise self._error(row, place, f"should be a number{bound}{hint}")
        return value

    def _parsed(self, cell: str) -> float | None:
        if self.decimal != ".":
            cell = cell.replace(".", " ").replace(self.decimal, ".")
        value = float(cell) if _NUMBER.fullmatch(cell) else math.nan
        return value if math.isfinite(value) else None

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on faults that are spelled in several ways and taken for one."""
        faults = dict.fromkeys(self.text(row, "fault") for row in range(len(self.rows)))
        others = (name for name in faults if name != self.spellings[name.casefold()])
        return tuple(
            f"The faults {self.spellings[name.casefold()]} and {name} are taken for one."
            for name in others
        )

    @cached_property
    def spellings(self) -> dict[str, str]:
        """Each fault in small letters to the way in which its first row has it."""
        faults = [self.text(row, "fault") for row in range(len(self.rows))]
        return {fault.casefold(): fault for fault in reversed(faults)}

    @cached_property
    def _varying(self) -> tuple[int, ...]:
        return tuple(place for place in self.others if len({row[place] for row in self.rows}) > 1)


def read_table(
    path: Path, columns: dict[str, str], ignore: tuple[str, ...], decimal: str
) -> tuple[Table, bytes]:
    """Return the table in a file, and the file's bytes.

    Args:
        columns: what a column is (a word of `NAMES`) to its name in the file.
        ignore: names of columns to leave out.
        decimal: the sign before decimals, "." or ",".

    Raises:
        IndicatorError: the file cannot be read or is no such table, or a column is not there.
    """
    if decimal not in (".", ","):
        raise IndicatorError(f"--decimal {decimal}: should be . or ,")
    try:
        content = path.read_bytes()
        text = content.decode("utf-8-sig")
    except OSError as error:
        raise IndicatorError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise IndicatorError(
            f"{path} is not a CSV file in UTF-8 ({error.reason}): save it as CSV UTF-8"
        ) from error
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        for sign in line.replace("\t", ""):
            if unicodedata.category(sign) in ("Cc", "Cf"):
                raise IndicatorError(
                    f"{path}, line {number}: holds {sign!r}: should be plain text, without control "
                    "signs"
                )
    # Spreadsheets may say the delimiter in a first line such as "sep=;".
    empty = ("", "sep=;", "sep=,", "sep=")
    start = next((n for n, line in enumerate(lines) if line.strip().lower() not in empty), None)
    if start is None:
        raise IndicatorError(f"{path} is empty: should have a row of column names, then the trials")
    delimiter = max(";\t,", key=lines[start].count)
    reader = csv.reader(lines[start:], delimiter=delimiter, skipinitialspace=True)
    rows, numbers = [], []
    try:
        header = tuple(cell.strip() for cell in next(reader))
        for cells in reader:
            stripped = tuple(cell.strip() for cell in cells)
            number = start + reader.line_num
            if not any(stripped):
                continue
            if any(stripped[len(header) :]):
                raise IndicatorError(
                    f"{path}, line {number}: has {len(stripped)} values, more values than the "
                    f"{len(header)} columns: if decimals have a comma, put ; between the columns"
                )
            rows.append((*stripped, *("",) * (len(header) - len(stripped)))[: len(header)])
            numbers.append(number)
    except csv.Error as error:
        raise IndicatorError(f"{path} is not a CSV file: {error}") from error
    places, others = _columns(path, header, columns, ignore)
    return Table(path, header, places, others, tuple(rows), tuple(numbers), decimal), content


def _columns(
    path: Path, header: tuple[str, ...], columns: dict[str, str], ignore: tuple[str, ...]
) -> tuple[dict[str, int], tuple[int, ...]]:
    """Return where each known column is, and which columns are left as parameters."""
    for column in columns:
        if column not in _MEANING:
            raise IndicatorError(f"--column {column}: {_one_of(column, _MEANING)}")
    columns = {_MEANING[column]: name for column, name in columns.items()}
    for name in (*columns.values(), *ignore):
        if name not in header:
            raise IndicatorError(f"{path} has no column {name!r}: {_one_of(name, header)}")
    for name in header:
        if name and header.count(name) > 1:
            raise IndicatorError(f"{path} has two columns {name!r}: should have one of that name")
    places = {column: header.index(name) for column, name in columns.items()}
    others = []
    for place, name in enumerate(header):
        if not name or name in ignore or name in columns.values():
            continue
        word = _word(name)
        known = _MEANING.get(word)
        if known is None or known in columns:
            close = difflib.get_close_matches(word, _MEANING, n=1, cutoff=0.75)
            if close and known is None and len(word) > 3:
                raise IndicatorError(
                    f"{path} has a column {name!r}; did you mean {close[0]!r}? Else rename it, or "
                    f"leave it out by --ignore {name!r}"
                )
            others.append(place)
        elif known in places:
            raise IndicatorError(
                f"{path} has columns {header[places[known]]!r} and {name!r}, both {known}: say "
                f"which it is by --column {known}=NAME, and leave the other out by --ignore NAME"
            )
        else:
            places[known] = place
    return places, tuple(others)


def _word(name: str) -> str:
    """Return a column's name in small letters, without unit: "Time [s]" is "time"."""
    bare = re.sub(r"\s*[\[(].*?[\])]\s*", " ", name)
    return re.sub(r"\W+", "_", bare.strip().lower()).strip("_")


def _one_of(name: str, known: Iterable[str]) -> str:
    names = [each for each in known if each]
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean {close[0]!r}?" if close else f"should be one of {', '.join(names)}"
