"""Table: the cells of a file as texts, whatever it was written by; Row: one of its rows."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import NamedTuple

from swarm_logistics_env.spi.inputs import IndicatorError

BLOCK_SIGN = " and "  # between the names of the columns that make a block together
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_LIKE_A_NUMBER = re.compile(r"[+-]?\d*[.,]?\d*([eE][+-]?\d+)?")  # also a decimal comma, or nothing
# With signs between thousands: "1,204", "1.204.000,5" or "1 204".
_GROUPED = re.compile(r"[+-]?\d{1,3}(([.,'’\s])\d{3})(\2\d{3})*([.,]\d+)?")
# Signs that stand between thousands and nowhere else in a number.
_SURELY_GROUPED = re.compile(r"[+-]?\d{1,3}(['’\s])\d{3}(\1\d{3})*([.,]\d+)?")
_MEASURED = ("performance", "time", "time_to_finish", "contacts")  # in each trial anew
LARGEST_EXACT = 2**53  # from here on programs that hold numbers as floats round whole ones


class NoTrialsError(IndicatorError):
    """A file that can be read and holds no trials, as an empty one."""


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
        decimal: the sign before decimals; None: not known.
        notes: sentences on how the file was read.
        origins: of each row, where it stands in which file; empty: in this one.
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

    @cached_property
    def index(self) -> dict[str, int]:
        """The number of each column."""
        return {name: number for number, name in enumerate(self.header)}

    def column(self, name: str) -> list[str]:
        """Return the cells of a column."""
        number = self.index[name]
        return [row[number] for row in self.cells]

    def location(self, row: int) -> str:
        """Return file and line of a row."""
        if self.origins:
            return self.origins[row]
        return f"{self.source}, {self.line_word} {self.lines[row]}"

    def error(self, row: int, name: str, cell: str, should: str) -> IndicatorError:
        """Return the error that a cell in a column of that name cannot be."""
        shown = repr(cell) if cell else "nothing"
        return IndicatorError(f"{self.location(row)}, column {name!r}: {shown}: {should}")


class Columns(NamedTuple):
    """What the columns of a table are.

    Attributes:
        names: what a column is (a key of `COLUMN_NAMES`) to its name in the file.
        parameters: columns that are nothing else, so that they are parameters where they vary.
        ignored: columns that are left out, as somebody says.
        blocks: columns that make a block together.
        decimal: the sign before decimals.
        thousands: the sign between thousands; None: none, but where it can be nothing else.
        seconds: what a column is to how many seconds its unit has; none: it is not converted.
    """

    names: Mapping[str, str]
    parameters: Sequence[str]
    ignored: Sequence[str]
    blocks: Sequence[str]
    decimal: str
    thousands: str | None
    seconds: Mapping[str, float] = MappingProxyType({})


class Row:
    """A row of a table, read by what its columns are."""

    __slots__ = ("_cells", "_columns", "_number", "_positions", "_table")

    def __init__(
        self, table: Table, number: int, columns: Columns, positions: Mapping[str, int]
    ) -> None:
        self._table = table
        self._number = number
        self._columns = columns
        self._positions = positions  # of what a column is, in the row
        self._cells = table.cells[number]

    @property
    def location(self) -> str:
        """File and line."""
        return self._table.location(self._number)

    @property
    def line(self) -> int:
        """The line that it begins in."""
        return self._table.lines[self._number]

    @property
    def names(self) -> Mapping[str, str]:
        """What a column is to its name in the file."""
        return self._columns.names

    def cell(self, name: str) -> str:
        """Return a cell by the column's name in the file."""
        return self._cells[self._table.index[name]]

    def text(self, column: str) -> str:
        """Return a cell by what its column is; empty where there is none."""
        if column == "seed" and len(self._columns.blocks) > 1:
            return ", ".join(map(self.cell, self._columns.blocks))
        position = self._positions.get(column)
        return "" if position is None else self._cells[position]

    def number(
        self, column: str, least: float = -math.inf, *, must_be_whole: bool = False
    ) -> float:
        """Return a cell as a finite number of at least `least`, by what its column is.

        A time is in seconds, whatever its unit in the file.
        """
        value = self._number_in(self.text(column), column, least, must_be_whole, is_parameter=False)
        factor = self._columns.seconds.get(column, 1.0)
        # So that 9 ms are 0.009 s, not the next number.
        return value if factor == 1.0 else round(value * factor, 12)

    def parameter(self, name: str) -> float:
        """Return a cell of a parameter as a finite number, by the column's name in the file."""
        return self._number_in(self.cell(name), name, -math.inf, False, is_parameter=True)

    def _number_in(
        self, cell: str, column: str, least: float, must_be_whole: bool, *, is_parameter: bool
    ) -> float:
        if isinstance(cell, MergedCell) and column in _MEASURED:
            should = "should be of one trial alone, as it is measured; no merged cell"
            raise self._error(cell, self.names.get(column), column, should)
        value = _value_of(cell, self._columns.decimal, self._columns.thousands)
        if math.isfinite(value) and value >= least and (not must_be_whole or value.is_integer()):
            return value
        should = "should be a whole number" if must_be_whole else "should be a number"
        should += f", {least:g} or more" if math.isfinite(least) else ""
        should += self._hint(cell, column, is_parameter)
        raise self._error(cell, column if is_parameter else self.names.get(column), column, should)

    def _hint(self, cell: str, column: str, is_parameter: bool) -> str:
        """Return what would make a cell a number."""
        decimal = self._columns.decimal
        if cell.startswith(("[", "{", '"')):  # as JSON has it
            return ", or a list of numbers alone"
        if "," in cell and decimal == ".":
            return (
                " without a sign between thousands; --decimal , where decimals have a comma, or "
                "--thousands , where it stands between thousands"
            )
        if _GROUPED.fullmatch(cell):
            point = "; --decimal . where decimals have a point" if decimal == "," else ""
            return f" without a sign between thousands{point}, or --thousands ."
        if is_parameter:
            return (
                f", as every column that varies is a parameter; else --ignore {column!r}, or say "
                f"what it is, as by --column table={column!r} where each of its values has runs of "
                "its own"
            )
        if column == "performance":
            return (
                f"; where the robots did nothing, --value {column}:{cell}=0 says so; a trial that "
                "was not recorded has no row"
            )
        return ""

    def number_or_none(self, column: str) -> float | None:
        """Return a cell as a number, 0 or more; None: it is empty or not there."""
        return self.number(column, 0.0) if self.text(column) else None

    def whole_or_none(self, column: str, least: float) -> int | None:
        """Return a cell as a whole number, exactly; None: it is empty or not there."""
        cell = self.text(column)
        if not cell:
            return None
        is_short = len(cell) < 16  # Python refuses to read thousands of digits
        if is_short and cell.isascii() and cell.isdigit() and int(cell) >= least:
            return int(cell)
        value = self.number(column, least, must_be_whole=True)
        if re.fullmatch(r"\+?\d+", cell):
            return int(cell)
        if "e" in cell.lower() or value >= LARGEST_EXACT:
            raise self.error(
                column,
                "should be a whole number with all its digits, as whoever writes it so rounds it",
            )
        return int(value)

    def is_numbered_block(self) -> bool:
        """Return whether the cell of the block is meant as a number, or empty."""
        cell = self.text("seed")
        is_joined = len(self._columns.blocks) > 1
        is_number = _LIKE_A_NUMBER.fullmatch(cell) or _GROUPED.fullmatch(cell)
        return not is_joined and is_number is not None

    def error(self, column: str, should: str) -> IndicatorError:
        """Return the error that a cell cannot be."""
        return self._error(self.text(column), self.names.get(column), column, should)

    def _error(self, cell: str, name: str | None, column: str, should: str) -> IndicatorError:
        if name is None:
            return IndicatorError(f"{self.location}: {column} is missing: {should}")
        return self._table.error(self._number, name, cell, should)


def rows_of(table: Table, columns: Columns) -> Iterator[Row]:
    """Yield the rows of a table."""
    names = columns.names.items()
    positions = {column: table.index[name] for column, name in names if name in table.index}
    return (Row(table, number, columns, positions) for number in range(len(table.cells)))


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
