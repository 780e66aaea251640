"""Table: the cells of a file as texts, whatever it was written by; Cells: those of a column."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from shlex import quote
from typing import NamedTuple

from swarm_logistics_env.spi.inputs import IndicatorError

from .column_name import ColumnName
from .words import means_no_number, usual_fault

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_LIKE_A_NUMBER = re.compile(r"[+-]?\d*[.,]?\d*([eE][+-]?\d+)?")  # also a decimal comma, or nothing
# With signs between thousands: "1,204", "1.204.000,5" or "1 204".
_GROUPED = re.compile(r"[+-]?\d{1,3}(([.,'’\s])\d{3})(\2\d{3})*([.,]\d+)?")
# Signs that stand between thousands and nowhere else in a number.
_SURELY_GROUPED = re.compile(r"[+-]?\d{1,3}(['’\s])\d{3}(\1\d{3})*([.,]\d+)?")
_MEASURED = ("performance", "time", "time_to_finish", "contacts")  # in each trial anew
WORKBOOK = "a workbook"  # as the kind of a table
LARGEST_EXACT = 2**53  # from here on programs that hold numbers as floats round whole ones


class NoTrialsError(IndicatorError):
    """A file that can be read and holds no trials, as an empty one."""


class CellError(IndicatorError):
    """A cell that cannot be.

    Attributes:
        column: the name of its column.
        row: its number in the table.
    """

    def __init__(self, message: str, column: str, row: int) -> None:
        super().__init__(message)
        self.column = column
        self.row = row


class MergedCell(str):
    """A cell to which a sheet carries the value of another one, by merging both."""


class Formula(str):
    """A formula whose value a workbook does not have."""


@dataclass(frozen=True)
class Table:
    """The cells of a file, as texts.

    Attributes:
        source: what messages call the file.
        digest: of its content, 16 hexadecimal digits.
        header: names of the columns.
        cells: a sequence of texts for each row, in the order of the columns.
        lines: where each row stands in the file.
        line_word: what the file's kind calls that, e.g. "line" or "record".
        kind: what the file is, in words; "" for a table of text.
        meanings: what a column is (a key of `COLUMN_NAMES`) to its name, as far as the kind of file
            tells.
        left_out: columns that are read only where somebody says what they are.
        decimal: the sign before decimals; None: not known, so that it is a point.
        notes: sentences on how the file was read.
        origins: of each row, where it stands in which file; empty: in this one.
        thousands: the sign between thousands; None: none, but where it can be nothing else.
    """

    source: str
    digest: str
    header: Sequence[str]
    cells: Sequence[Sequence[str]]
    lines: Sequence[int]
    line_word: str = "line"
    kind: str = ""
    meanings: Mapping[str, str] = field(default_factory=dict)
    left_out: frozenset[str] = frozenset()
    decimal: str | None = None
    notes: tuple[str, ...] = ()
    origins: Sequence[str] = ()
    thousands: str | None = None

    @cached_property
    def index(self) -> dict[str, int]:
        """The number of each column."""
        return {name: number for number, name in enumerate(self.header)}

    @cached_property
    def columns(self) -> dict[str, Cells]:
        """The cells of each column, by its name."""
        return {cells.name: cells for cells in self.columns_in_order}

    @cached_property
    def columns_in_order(self) -> list[Cells]:
        """The cells of each column; several may have one name."""
        return [
            Cells(ColumnName(name), [row[number] for row in self.cells], self)
            for number, name in enumerate(self.header)
        ]

    def location(self, row: int) -> str:
        """Return file and line of a row."""
        if self.origins:
            return self.origins[row]
        return f"{self.source}, {self.line_word} {self.lines[row]}"


@dataclass(frozen=True)
class Cells:
    """The cells of a column, with all that it takes to read them.

    Attributes:
        name: of the column in the file; of a block of several columns, their names together.
        texts: a cell for each row.
        table: that they stand in.
        meaning: what the column is, a key of `COLUMN_NAMES`; "": nothing that is known.
        seconds: that the unit of a time has; 1 where it is not converted.
    """

    name: ColumnName
    texts: Sequence[str]
    table: Table
    meaning: str = ""
    seconds: float = 1.0

    def error(self, row: int, should: str) -> CellError:
        """Return the error that the cell of a row cannot be."""
        shown = repr(self.texts[row]) if self.texts[row] else "nothing"
        message = f"{self.table.location(row)}, column {self.name!r}: {shown}: {should}"
        return CellError(message, self.name, row)

    @cached_property
    def are_like_numbers(self) -> bool:
        """Whether each cell is meant as a number, or empty."""
        return all(map(like_a_number, self.texts))

    @cached_property
    def are_numbers(self) -> bool:
        """Whether all cells with a value are meant as numbers, and there is one."""
        return are_numbers(self.texts)

    @cached_property
    def are_mostly_numbers(self) -> bool:
        """Whether most cells with a value are meant as numbers."""
        values = [text for text in self.texts if not means_no_number(text)]
        return 2 * sum(map(like_a_number, values)) > len(values)

    @cached_property
    def usual_faults(self) -> dict[str, str | None]:
        """What each cell is as a fault, see `usual_fault`."""
        return {text: usual_fault(text) for text in dict.fromkeys(self.texts)}

    def number(self, row: int, least: float = -math.inf, *, must_be_whole: bool = False) -> float:
        """Return the cell of a row as a finite number of at least `least`; a time in seconds."""
        text = self.texts[row]
        if isinstance(text, MergedCell) and self.meaning in _MEASURED:
            raise self.error(row, "should be of one trial alone, as it is measured; no merged cell")
        value = _value_of(text, self.table.decimal or ".", self.table.thousands)
        if math.isfinite(value) and value >= least and (not must_be_whole or value.is_integer()):
            # So that 9 ms are 0.009 s, not the next number.
            return value if self.seconds == 1.0 else round(value * self.seconds, 12)
        should = "should be a whole number" if must_be_whole else "should be a number"
        should += f", {least:g} or more" if math.isfinite(least) else ""
        raise self.error(row, should + self._hint(text))

    def whole_number(self, row: int, least: float) -> int:
        """Return the cell of a row as a whole number of at least `least`, exactly."""
        text = self.texts[row]
        is_short = len(text) < 16  # Python refuses to read thousands of digits
        if is_short and text.isascii() and text.isdigit() and int(text) >= least:
            return int(text)
        value = self.number(row, least, must_be_whole=True)
        if re.fullmatch(r"\+?\d+", text):
            return int(text)
        if "e" in text.lower() or value >= LARGEST_EXACT:
            raise self.error(
                row,
                "should be a whole number with all its digits, as whoever writes it so rounds it",
            )
        return int(value)

    def _hint(self, text: str) -> str:
        """Return what would make a cell a number."""
        if text.startswith(("[", "{", '"')):  # as JSON has it
            return ", or a list of numbers alone"
        if "," in text and self.table.decimal != ",":
            return (
                " without a sign between thousands; --decimal , where decimals have a comma, or "
                "--thousands , where it stands between thousands"
            )
        if _GROUPED.fullmatch(text):
            point = "; --decimal . where decimals have a point" if self.table.decimal == "," else ""
            return f" without a sign between thousands{point}, or --thousands ."
        if not self.meaning:
            return (
                f", as every column that varies is a parameter; else --ignore {quote(self.name)}, "
                f"or say what it is, as by --column {quote(f'table={self.name}')} where each of "
                "its values has runs of its own"
            )
        if self.meaning == "performance":
            option = quote(f"performance:{text}=0")
            return (
                f"; where the robots did nothing, --value {option} says so; a trial that was not "
                "recorded has no row"
            )
        return ""


class Columns(NamedTuple):
    """What the columns of a table are, with their cells.

    Attributes:
        table: that they are of.
        by_meaning: the cells of each column that is known, by what it is (a key of `COLUMN_NAMES`);
            for "seed" those of all columns that make a block, together.
        parameters: columns that are nothing known and tell conditions apart.
        covariates: columns that are nothing known and differ from trial to trial.
        ignored: columns that are left out, as somebody says.
        blocks: columns that make a block together.
        seeds: those of them, by name, that are called seeds in the file.
        has_seeds: whether a condition has one run of each block, as of a seed.
        performance_name: what the file calls P.
        notes: sentences on what was guessed.
    """

    table: Table
    by_meaning: Mapping[str, Cells]
    parameters: Sequence[Cells]
    covariates: Sequence[Cells]
    ignored: Sequence[Cells]
    blocks: Sequence[Cells]
    seeds: Sequence[str]
    has_seeds: bool
    performance_name: str
    notes: Sequence[str]


def like_a_number(text: str) -> bool:
    """Return whether a text is meant as a number, or empty."""
    return bool(_LIKE_A_NUMBER.fullmatch(text) or _GROUPED.fullmatch(text))


def are_numbers(texts: Sequence[str]) -> bool:
    """Return whether all cells with a value are meant as numbers, and there is one."""
    values = [text for text in texts if not means_no_number(text)]
    return bool(values) and all(map(like_a_number, values))


@lru_cache(100_000)  # most cells are some of a few numbers
def _value_of(cell: str, decimal: str, thousands: str | None) -> float:
    """Return a cell's number, or infinity where it is none."""
    if thousands and _GROUPED.fullmatch(cell) and thousands in cell:
        cell = cell.replace(thousands, "")
    elif _SURELY_GROUPED.fullmatch(cell):
        cell = re.sub(r"['’\s]", "", cell)
    # As Python writes numbers: a point, and nothing between thousands.
    plain = cell if decimal == "." else cell.replace(".", " ").replace(decimal, ".")
    return float(plain) if _NUMBER.fullmatch(plain) else math.inf
