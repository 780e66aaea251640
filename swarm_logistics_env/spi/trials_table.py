"""A CSV file as people type it: its delimiter, and what each column is."""

from __future__ import annotations

import codecs
import difflib
import hashlib
import math
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from .inputs import IndicatorError

# What a column is, and the words that name it in files; small letters, "_" for all that is none.
COLUMN_NAMES: dict[str, tuple[str, ...]] = {
    "performance": ("p", "delivered", "items", "score"),
    "n_robots": ("robots", "n", "swarm_size"),
    "fault": ("failure", "mode"),
    "faulty": ("m", "failed"),
    "onset": ("fault_time",),
    "policy": ("controller",),
    "seed": ("pair", "block", "map", "layout", "instance"),
    "trial": ("run", "id"),
    "time": (),
    "time_to_finish": ("finish_time", "completion_time", "makespan"),
    "work": (),
    "duration": ("length",),
    "table": (),
    "contacts": ("contacts_per_robot_minute",),
}
_MEANING = {word: column for column, words in COLUMN_NAMES.items() for word in (column, *words)}
_TEXTS = ("fault", "policy", "trial", "table")  # columns that hold no numbers
BLOCK_SIGN = " and "  # between the names of the columns that make a block together
_ROBOT = re.compile(r"(robot|agent|drone|bot)(_?(id|no|nr|num|number|name|index|label))?|id_robot")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_LIKE_A_NUMBER = re.compile(r"[+-]?[\d.,'’\s]*([eE][+-]?\d+)?")  # however it is written
# With signs between thousands: "1,204", "1.204.000,5" or "1 204".
_GROUPED = re.compile(r"[+-]?\d{1,3}(([.,'’\s])\d{3})(\2\d{3})*([.,]\d+)?")
_LARGEST_EXACT = 2**53  # from here on programs that hold numbers as floats round whole ones
_LINE_END = re.compile(r"\r\n|\r|\n")
_LINE_SIGNS = "\n\v\f\r\x85\u2028\u2029"  # what some program or other takes for a line's end
_QUOTED = r'"(?:[^"]|"")*+"'
_HEADER = re.compile(rf'(?:{_QUOTED}|[^\r\n"])*+')
_EXCEL = re.compile(r'\s*"?sep=(\t|[^\w\s"\'])"?[;,\t ]*(?:\r\n|\r|\n)', re.IGNORECASE)
# What a spreadsheet computes; an apostrophe before it makes it a text there.
_FORMULA = re.compile(r"[\s']*[=+\-@\t\r\n]")


class Row(NamedTuple):
    """One row of a file.

    Attributes:
        place: file and line.
        line: that it begins in.
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
        name = self._name(column)
        return "" if name is None else self.cells[name]

    def _name(self, column: str) -> str | None:
        """Return the name of a column in the file; None: it is not there, or left out."""
        return self.names.get(column) if column in COLUMN_NAMES else column

    def number(
        self, column: str, least: float = -math.inf, *, must_be_whole: bool = False
    ) -> float:
        """Return a cell as a finite number of at least `least`."""
        cell = self.text(column)
        plain = cell if self.decimal == "." else cell.replace(".", " ").replace(self.decimal, ".")
        value = float(plain) if _NUMBER.fullmatch(plain) else math.inf
        if math.isfinite(value) and value >= least and (not must_be_whole or value.is_integer()):
            return value
        should = f"should be a {'whole ' * must_be_whole}number"
        should += f", {least:g} or more" if math.isfinite(least) else ""
        if "," in cell and self.decimal == ".":
            should += " without a sign between thousands; --decimal , where decimals have a comma"
        elif _GROUPED.fullmatch(cell):
            should += " without a sign between thousands"
            if self.decimal == ",":
                should += "; --decimal . where decimals have a point"
        elif column not in COLUMN_NAMES:
            should += f", as every column that varies is a parameter; else --ignore {column!r}"
        raise self.error(column, should)

    def number_or_none(self, column: str) -> float | None:
        """Return a cell as a number, 0 or more; None: it is empty or not there."""
        return self.number(column, 0.0) if self.text(column) else None

    def whole_or_none(self, column: str, least: float) -> int | None:
        """Return a cell as a whole number, exactly; None: it is empty or not there."""
        cell = self.text(column)
        if not cell:
            return None
        value = self.number(column, least, must_be_whole=True)
        if re.fullmatch(r"\+?\d+", cell):
            return int(cell)
        if "e" in cell.lower() or value >= _LARGEST_EXACT:
            raise self.error(
                column,
                "should be a whole number with all its digits, as whoever writes it so rounds it",
            )
        return int(value)

    def is_number(self, column: str) -> bool:
        """Return whether a cell of one column is meant as a number, or empty."""
        is_joined = BLOCK_SIGN in (self._name(column) or "")
        return not is_joined and _LIKE_A_NUMBER.fullmatch(self.text(column)) is not None

    def error(self, column: str, should: str) -> IndicatorError:
        """Return the error that a cell cannot be."""
        name, cell = self._name(column), self.text(column)
        if name is None:
            return IndicatorError(f"{self.place}: {column} is missing: {should}")
        shown = repr(cell) if cell else "nothing"
        return IndicatorError(f"{self.place}, column {name!r}: {shown}: {should}")


def inert(text: str) -> str:
    """Return a text as a cell that no spreadsheet computes; `read_rows` reads the text itself."""
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text


def read_rows(
    path: Path, columns: Mapping[str, str], ignore: Sequence[str], decimal: str | None
) -> tuple[list[Row], list[str], str]:
    """Return the rows of a file, the columns that may be parameters, and the file's digest.

    Args:
        columns: what a column is (a word of `NAMES`) to its name in the file.
        ignore: names of columns to leave out.
        decimal: the sign before decimals, "." or ","; None: ".", unless it may stand between
            thousands.

    Raises:
        IndicatorError: the file cannot be read, holds no row or is no such table, a column is not
            there, or rows are of robots instead of trials.
    """
    if decimal not in (None, ".", ","):
        raise IndicatorError(f"--decimal {decimal}: should be . or ,")
    text, digest = _text(path)
    header, cells = _cells(path, text)
    names, parameters = _columns(path, _with_content(header, cells, columns), columns, ignore)
    if not cells:
        raise IndicatorError(f"{path} holds no trial: should have a row for each below the names")
    rows = [
        Row(f"{path}, line {line}", line, _with_block(row, names), names, decimal or ".")
        for line, row in cells.items()
    ]
    _refuse_rows_of_robots(rows, [name for name in header if name in ignore], parameters)
    if decimal is None:
        for column in (*(column for column in names if column not in _TEXTS), *parameters):
            _refuse_thousands(rows, column)
    return rows, parameters, digest


def _with_content(
    header: Sequence[str], cells: Mapping[int, Mapping[str, str]], columns: Mapping[str, str]
) -> list[str]:
    """Return the columns without those that would be a seed and are empty in every row."""
    return [
        name
        for name in header
        if _MEANING.get(_word(name)) != "seed"
        or name in columns.values()
        or not cells
        or any(row[name] for row in cells.values())
    ]


def _with_block(row: dict[str, str], names: Mapping[str, str]) -> dict[str, str]:
    """Return a row with a cell for its block where several columns make it, as map and seed."""
    block = names.get("seed", "")
    if block in row or not block:
        return row
    return {**row, block: ", ".join(row[name] for name in block.split(BLOCK_SIGN))}


def _text(path: Path) -> tuple[str, str]:
    """Return the text of a file and the digest of its content."""
    try:
        content = path.read_bytes()
        is_utf_16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = content.decode("utf-16" if is_utf_16 else "utf-8-sig")
    except OSError as error:
        raise IndicatorError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError:
        raise IndicatorError(f"{path} is not UTF-8 text: save it as CSV UTF-8") from None
    signs = {*text} - {"\t", *_LINE_SIGNS}
    if steering := {sign for sign in signs if unicodedata.category(sign) in ("Cc", "Cf")}:
        first = min(map(text.index, steering))
        line = len(_LINE_END.findall(text, 0, first)) + 1
        raise IndicatorError(
            f"{path}, line {line}: holds {text[first]!r}: should be plain text, without control "
            "signs"
        )
    return text, hashlib.sha256(content).hexdigest()[:16]


def _cells(path: Path, text: str) -> tuple[list[str], dict[int, dict[str, str]]]:
    """Return the columns' names, and the cells by these names of every row with any, by line."""
    if not text.strip():
        raise IndicatorError(f"{path} is empty: should have a row of column names, then the trials")
    excel = _EXCEL.match(text)
    start = excel.end() if excel else len(text) - len(text.lstrip(" \r\n"))
    if excel:
        delimiter = excel[1]
    else:
        head = next(_HEADER.finditer(text, start))[0]
        delimiter = max(";\t,", key=re.sub(_QUOTED, "", head).count)
    rows = {line: cells for line, cells in _rows(path, text, start, delimiter) if any(cells)}
    if not rows:
        raise IndicatorError(f"{path} is empty: should have a row of column names, then the trials")
    header = rows.pop(min(rows))
    for line, cells in rows.items():
        if any(cells[len(header) :]):
            comma = ": if decimals have a comma, put ; between the columns" * (delimiter == ",")
            raise IndicatorError(
                f"{path}, line {line}: has {len(cells)} values, more values than the "
                f"{len(header)} columns{comma}"
            )
    named = dict.fromkeys(header, "")
    return header, {line: named | dict(zip(header, cells)) for line, cells in rows.items()}


def _rows(path: Path, text: str, start: int, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line that each row begins in, and its cells, of which one may hold several lines.

    `csv.reader` does not tell where a quote opens that is never closed.
    """
    cell_pattern = re.compile(rf" *({_QUOTED}) *|[^{re.escape(delimiter)}\r\n]*")
    position, line = start, len(_LINE_END.findall(text, 0, start)) + 1
    first, row, n_columns = line, list[str](), 0
    while True:
        match = cell_pattern.match(text, position)
        assert match is not None  # it matches nothing, too
        quoted, position = match[1], match.end()
        after = text[position : position + 1]
        if quoted is None and match[0].lstrip().startswith('"'):
            raise IndicatorError(
                f"{path}, line {line}: opens a quote that is never closed, and what follows would "
                'be one cell: close it by ", or take it out'
            )
        if quoted is not None and after not in (delimiter, "\r", "\n", ""):
            raise IndicatorError(
                f"{path}, line {line}: opens a quote that is closed within a cell: should be "
                'closed at its end; a " within is written ""'
            )
        lines = _LINE_END.split(quoted or "")
        if n_columns > 1 and any(part.count(delimiter) >= n_columns - 1 for part in lines[1:]):
            raise IndicatorError(
                f"{path}, line {line}: opens a quote that holds whole rows: should be closed in "
                "the row that it opens in"
            )
        row.append(_read(quoted[1:-1].replace('""', '"') if quoted else match[0]))
        line += len(lines) - 1
        if after == delimiter:
            position += 1
            continue
        yield first, row
        n_columns = n_columns or len(row) * any(row)
        if not after:
            return
        position += 2 if text.startswith("\r\n", position) else 1
        line += 1
        first, row = line, []


def _read(cell: str) -> str:
    """Return a cell in one line, and without what `inert` put before it."""
    cell = cell.lstrip(" ")
    if cell.startswith("'") and _FORMULA.match(cell):
        cell = cell[1:]
    return re.sub(rf"[{_LINE_SIGNS}]+", " ", cell.strip())


def _is_robot(name: str) -> bool:
    """Return whether a column tells robots apart, by its name."""
    return _ROBOT.fullmatch(_word(name)) is not None


def _refuse_rows_of_robots(
    rows: Sequence[Row], ignored: Sequence[str], parameters: Sequence[str]
) -> None:
    """Refuse rows that differ in an ignored column of robots and in what each delivered alone."""
    of_robots = [name for name in ignored if _is_robot(name)]
    names = rows[0].names
    if not of_robots or "time" in names:  # a row of an event log is a delivery, whoever made it
        return
    compared = [name for column, name in names.items() if column != "performance"]
    trials: dict[tuple[str, ...], Row] = {}
    for row in rows:
        trial = tuple(row.cells[name] for name in (*compared, *parameters))
        first = trials.setdefault(trial, row)
        for robot in of_robots:
            if row.cells[robot] != first.cells[robot]:
                hint = ", or name each row's trial in a column 'trial'" * ("trial" not in names)
                raise IndicatorError(
                    f"{row.place}: differs from line {first.line} in {robot!r} and in what was "
                    f"delivered alone, so these may be robots of one trial: {_ONE_TRIAL_A_ROW}"
                    f"{hint}"
                )


_ONE_TRIAL_A_ROW = (
    "the unit is the trial, never the robot; sum the deliveries of a trial's robots into one row"
)


def _refuse_thousands(rows: Sequence[Row], column: str) -> None:
    """Refuse a column in which "1.200" beside "980" may be 1200 or 1.2."""
    first = {row.text(column): row for row in reversed(rows) if row.text(column)}
    plain_numbers = {cell: row for cell, row in first.items() if cell.isdecimal()}
    with_points = [cell for cell in first if re.fullmatch(r"[1-9]\d{0,2}\.\d{3}", cell)]
    if not (plain_numbers and with_points) or len(plain_numbers) + len(with_points) < len(first):
        return
    largest, smallest = max(plain_numbers, key=float), min(with_points, key=float)
    if float(largest) >= 10.0 * float(smallest):
        raise first[smallest].error(
            column,
            f"is {smallest.replace('.', '')} or {float(smallest):g}, beside {largest} in line "
            f"{plain_numbers[largest].line}: should be without a sign between thousands; or say "
            "--decimal . where decimals have a point",
        )


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
    chosen, parameters, of_robots = {*names}, list[str](), list[str]()
    for name in header:
        if not name or name in ignore or name in columns.values():
            continue
        if header.count(name) > 1:
            raise IndicatorError(f"{path} has two columns {name!r}: should have one of that name")
        word = _word(name)
        if _is_robot(name):
            of_robots.append(name)
            continue
        meaning = _MEANING.get(word)
        if meaning is None or (meaning in chosen and name not in COLUMN_NAMES):
            close = difflib.get_close_matches(word, _MEANING, n=1, cutoff=0.75)
            if close and meaning is None and len(word) > 3:
                raise IndicatorError(
                    f"{path} has a column {name!r}; did you mean {close[0]!r}? Else rename it, or "
                    f"leave it out by --ignore {name!r}"
                )
            parameters.append(name)
        elif meaning == "seed" and meaning in names:
            names[meaning] += f"{BLOCK_SIGN}{name}"
        elif meaning in names:
            raise IndicatorError(
                f"{path} has columns {names[meaning]!r} and {name!r}, both {meaning}: say "
                f"which it is by --column {meaning}=NAME, and leave the other out by --ignore NAME"
            )
        else:
            names[meaning] = name
    if of_robots and "time" not in names:
        raise IndicatorError(
            f"{path} has a column {of_robots[0]!r}, so its rows may be robots instead of trials: "
            f"{_ONE_TRIAL_A_ROW}, and leave the column out; where it is the swarm's size, say "
            f"--column robots={of_robots[0]!r}"
        )
    return names, parameters


def _word(name: str) -> str:
    """Return a column's name in small letters, without unit: "Time [s]" is "time"."""
    bare = re.sub(r"\s*[\[(].*?[\])]\s*", " ", name)
    return re.sub(r"\W+", "_", bare.strip().lower()).strip("_")


def _one_of(name: str, choices: Iterable[str]) -> str:
    names = [choice for choice in choices if choice]
    close = difflib.get_close_matches(name, names, n=1)
    return f"did you mean {close[0]!r}?" if close else f"should be one of {', '.join(names)}"
