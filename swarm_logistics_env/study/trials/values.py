"""Values as people write them: replaced where somebody says so, robots summed, words for faults."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .table import Columns, Row, Table
from .trial import NO_FAULT_WORD, REMOVED_WORD, REPEATED
from .trial_columns import MEANING, meaning_of

_NO_FAULT_WORDS = (NO_FAULT_WORD, "no fault", "no_fault", "baseline", "healthy", "0", "-")
_FAULT_NAMES = {
    **dict.fromkeys(_NO_FAULT_WORDS, NO_FAULT_WORD),
    REMOVED_WORD: REMOVED_WORD,
    REPEATED: REPEATED,
    "none again": REPEATED,
}
NOT_KNOWN = ("", "na", "n/a", "nan", "null")  # what programs and people write for no value
ZERO = ("0", "0.0")  # of robots that fail, by a row's word
_REPLACEMENT = re.compile(r"([^:]+):(.*)=([^=]*)", re.DOTALL)


def with_values(table: Table, columns: Mapping[str, str], values: Sequence[str]) -> Table:
    """Return a table in which cells are replaced.

    Args:
        columns: what a column is to its name in the table, as somebody says.
        values: each "COLUMN:CELL=NEW", e.g. "fault:kein=none"; the column by its name in the table
            or by what it is.

    Raises:
        IndicatorError: one is written otherwise, or the table has no such column or cell.
    """
    cells = [[*row] for row in table.cells] if values else table.cells
    for value in values:
        parts = _REPLACEMENT.fullmatch(value)
        if parts is None:
            raise IndicatorError(f"--value {value}: should be COLUMN:CELL=NEW, as fault:kein=none")
        column, old, new = (part.strip() for part in parts.groups())
        number = _column_number(table, columns, column, "--value")
        # By the cells of the file, so that two of them can be exchanged.
        rows = [row for row, read in zip(cells, table.cells) if read[number] == old]
        if not rows:
            raise IndicatorError(
                f"--value {value}: {table.source} has no cell {old!r} in the column "
                f"{table.header[number]!r}"
            )
        for row in rows:
            assert isinstance(row, list)
            row[number] = new
    return replace(table, cells=cells)


def _column_number(table: Table, columns: Mapping[str, str], column: str, option: str) -> int:
    by_meaning = {meaning_of(name): name for name in table.header} | {**table.meanings}
    by_meaning |= {MEANING.get(word): name for word, name in columns.items()}
    name = column if column in table.index else by_meaning.get(MEANING.get(column, column))
    if name not in table.index:
        raise IndicatorError(
            f"{option} {column}: {table.source} has no such column, but "
            f"{', '.join(map(repr, table.header))}"
        )
    return table.index[name]


def summed_over(table: Table, robots: str, columns: Mapping[str, str]) -> Table:
    """Return a table with a row for each trial, of one with a row for each of its robots.

    Rows that are equal but for what was delivered and the robot are of one trial. It stands where
    the first of them stood.

    Args:
        robots: the column that tells a trial's robots apart.
        columns: what a column is to its name in the table, as somebody says.

    Raises:
        IndicatorError: there is no such column, none holds what was delivered, or a robot is in a
            trial twice.
    """
    if robots not in table.index:
        raise IndicatorError(
            f"--sum-over {robots}: {table.source} has no such column, but "
            f"{', '.join(map(repr, table.header))}"
        )
    performance = _column_number(table, columns, "performance", "--sum-over needs the column")
    robot = table.index[robots]
    other_columns = [
        number for number in range(len(table.header)) if number not in (performance, robot)
    ]
    view = Columns({"performance": table.header[performance]}, (), (), (), ".", None)
    totals: dict[tuple[str, ...], float] = {}
    first_rows: dict[tuple[str, ...], int] = {}
    rows_of_robots: dict[tuple[tuple[str, ...], str], int] = {}
    for number, cells in enumerate(table.cells):
        trial = tuple(cells[column] for column in other_columns)
        first = rows_of_robots.setdefault((trial, cells[robot]), number)
        if first != number:
            raise IndicatorError(
                f"{table.location(number)}: {robots} {cells[robot]!r} is in {table.line_word} "
                f"{table.lines[first]} too: name each row's trial in a column 'trial'"
            )
        first_rows.setdefault(trial, number)
        delivered = Row(table, number, view, {"performance": performance}).number(
            "performance", 0.0
        )
        totals[trial] = totals.get(trial, 0.0) + delivered
    header = [name for name in table.header if name != robots]
    summed = []
    for trial, number in first_rows.items():
        row = [*table.cells[number]]
        row[performance] = f"{totals[trial]:.15g}"
        del row[robot]
        summed.append(row)
    n_robots = len(table.cells) / max(1, len(summed))
    note = (
        f"{len(table.cells)} rows of robots are summed into {len(summed)} trials, {n_robots:g} "
        "robots each on average."
    )
    lines = [table.lines[number] for number in first_rows.values()]
    origins = [table.location(number) for number in first_rows.values()] if table.origins else ()
    return replace(
        table,
        header=header,
        cells=summed,
        lines=lines,
        notes=(*table.notes, note),
        origins=origins,
    )


class FaultNames:
    """What the faults of a file are called in the study.

    Args:
        rows: of the file.

    Attributes:
        notes: sentences on what was taken for what.
    """

    def __init__(self, rows: Sequence[Row]) -> None:
        counts = Counter(row.text("fault") for row in rows)
        faults = sorted(counts, key=lambda name: (-counts[name], name))
        # Each fault in small letters to how most rows have it.
        spelled = {name.casefold(): name for name in reversed(faults)}
        has_column = "fault" in rows[0].names
        harmless = _without_faulty_robots(rows) if "faulty" in rows[0].names else set[str]()
        self.notes: list[str] = []
        self._names: dict[str, str] = {}
        for name in faults:
            self._names[name] = _FAULT_NAMES.get(name.casefold(), spelled[name.casefold()])
            if name.casefold() in NOT_KNOWN:
                _refuse_unnamed(rows, name)
                self._names[name] = NO_FAULT_WORD
                if has_column:
                    shown = repr(name) if name else "An empty cell"
                    self.notes.append(
                        f"{shown} in {rows[0].names['fault']!r} is taken for no fault."
                    )
            elif self._names[name] not in (NO_FAULT_WORD, REPEATED) and name.casefold() in harmless:
                self._names[name] = NO_FAULT_WORD
                self.notes.append(
                    f"The fault {name!r} is taken for no fault, as no robot fails by it; "
                    f"--value fault:{name}={NO_FAULT_WORD} says so."
                )
            elif name not in spelled.values():
                self.notes.append(
                    f"The faults {spelled[name.casefold()]} and {name} are taken for one."
                )
        self.notes += _notes_on_misspelled(Counter(self[row.text("fault")] for row in rows))

    def __getitem__(self, name: str) -> str:
        """Return what a fault is called, by its cell."""
        return self._names[name]

    @property
    def any_fails(self) -> bool:
        """Whether robots fail in some trial."""
        return any(name not in (NO_FAULT_WORD, REPEATED) for name in self._names.values())


def _refuse_unnamed(rows: Sequence[Row], name: str) -> None:
    """Refuse a row that names no fault where others do, unless it says that no robot failed."""
    if all(row.text("fault").casefold() in NOT_KNOWN for row in rows):
        return
    for row in rows:
        if row.text("fault") == name and row.text("faulty") not in ZERO:
            replacement = quote(f"{row.names['fault']}:{name}={NO_FAULT_WORD}")
            raise row.error(
                "fault",
                f"should name what failed, as other rows do, or be {NO_FAULT_WORD}; --value "
                f"{replacement} says so of all such cells, unless a group has its name in its "
                "first row alone",
            )


def _notes_on_misspelled(counts: Counter[str]) -> Iterator[str]:
    """Yield the faults of one row whose names are nearly those of faults of several rows."""
    frequent = sorted(name for name, count in counts.items() if count > 1)
    for name, count in sorted(counts.items()):
        similar = get_close_matches(name, frequent, n=1, cutoff=0.8)
        if count == 1 and similar:
            yield (
                f"The fault {name!r} stands in one row alone: if {similar[0]!r} is meant, "
                f"--value {quote(f'fault:{name}={similar[0]}')} says so."
            )


def _without_faulty_robots(rows: Sequence[Row]) -> set[str]:
    """Return the faults, in small letters, by which no robot fails, where by others some do."""
    harmless: dict[str, bool] = {}
    for row in rows:
        fault = row.text("fault").casefold()
        harmless[fault] = harmless.get(fault, True) and row.text("faulty") in ZERO
    names = {name for name, value in harmless.items() if value}
    return names if len(names) < len(harmless) else set()
