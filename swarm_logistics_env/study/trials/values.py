"""Values as people write them: cells replaced where somebody says so, rows of robots summed."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from swarm_logistics_env.spi.inputs import IndicatorError

from .column_name import ColumnName
from .table import Table, like_a_number
from .trial import NO_FAULT_WORD
from .words import CONSTANTS, MEANING, NOT_KNOWN

_REPLACEMENT = re.compile(r"([^:]+):(.*)=([^=]*)", re.DOTALL)


def with_constants(table: Table, columns: dict[str, str]) -> Table:
    """Return a table with a column for each number that is the same in all trials.

    Args:
        columns: what a column is to its name in the table, or to such a number, which becomes a
            name here. How many robots fail it is in trials with a fault.
    """
    for column, value in columns.items():
        meaning = MEANING.get(column)
        if value in table.index or meaning not in CONSTANTS or not like_a_number(value):
            continue
        texts = [value] * len(table.cells)
        faults = [cells.name for cells in table.columns_in_order if cells.name.meaning == "fault"]
        fault = columns.get("fault", next(iter(faults), ""))
        if meaning == "faulty" and fault in table.index:
            cells = table.columns[fault]
            usual = cells.usual_faults
            texts = [
                "" if usual[text] == NO_FAULT_WORD or text in NOT_KNOWN else value
                for text in cells.texts
            ]
        rows = [[*row, text] for row, text in zip(table.cells, texts)]
        table = replace(table, header=[*table.header, column], cells=rows)
        columns[column] = column
    return table


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
    by_meaning = {ColumnName(name).meaning: name for name in table.header} | {**table.meanings}
    by_meaning |= {MEANING.get(word): name for word, name in columns.items()}
    name = column if column in table.index else by_meaning.get(MEANING.get(column, column))
    if name not in table.index:
        raise IndicatorError(
            f"{option} {column}: {table.source} has no such column, but "
            f"{', '.join(map(repr, table.header))}"
        )
    return table.index[name]


def summed_over(table: Table, robots: str | None, columns: Mapping[str, str]) -> Table:
    """Return a table with a row for each trial, of one with a row for each of its robots.

    Rows that are equal but for what was delivered and the robot are of one trial. It stands where
    the first of them stood.

    Args:
        robots: the column that tells a trial's robots apart; None: rows are of no robots.
        columns: what a column is to its name in the table, as somebody says.

    Raises:
        IndicatorError: there is no such column, none holds what was delivered, or a robot is in a
            trial twice.
    """
    if robots is None:
        return table
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
    delivered = replace(table.columns[table.header[performance]], meaning="performance")
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
        totals[trial] = totals.get(trial, 0.0) + delivered.number(number, 0.0)
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
        table, header=header, cells=summed, lines=lines, notes=(*table.notes, note), origins=origins
    )
