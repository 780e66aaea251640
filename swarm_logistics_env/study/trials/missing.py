"""Missing values: the rows of a table that lack one, and the table without them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from swarm_logistics_env.spi.inputs import IndicatorError

from .complaints import Complaints
from .fault_names import ZERO
from .table import Cells, Columns, Table
from .trial import NO_FAULT_WORD
from .words import NOT_KNOWN, means_no_number

_NAMES = ("policy", "table", "finished")  # of which "NA" may be one
# Numbers that a row need not have; a word for no value in their place is missing.
_MAY_BE_EMPTY = ("duration", "contacts", "onset", "faulty", "time")


def missing_rows(columns: Columns) -> dict[str, list[int]]:
    """Return the rows that lack a value which a trial must have, by the name of the column.

    An empty time is none of these: it says that nothing was delivered, or that a trial did not
    finish. Nor is a word in place of the time to finish, as it may mean the same.
    """
    meanings = columns.by_meaning
    has_time = bool({"time", "time_to_finish"} & meanings.keys())
    needed = ("n_robots", "work") if has_time else ("n_robots", "work", "performance")
    rows = dict[str, list[int]]()
    for meaning, cells in meanings.items():
        if meaning in _NAMES:
            rows[cells.name] = _empty_among_others(cells)
        elif meaning in needed and cells.are_numbers:
            rows[cells.name] = _without_number(cells)
        elif meaning in _MAY_BE_EMPTY:
            rows[cells.name] = [row for row in _without_number(cells) if cells.texts[row]]
    for cells in (*columns.parameters, *columns.blocks):
        if cells.are_numbers:
            rows[cells.name] = _without_number(cells)
        elif cells in columns.blocks:
            rows[cells.name] = _empty_among_others(cells)
    if "fault" in meanings:
        _add_of_faults(meanings["fault"], meanings.get("faulty"), rows)
    return {name: rows[name] for name in columns.table.header if rows.get(name)}


def without_rows(table: Table, complaints: Complaints) -> Table:
    """Return a table without the rows that lack a value, and with a note that counts them.

    Raises:
        IndicatorError: none is left.
    """
    left_out = {row for rows in complaints.missing.values() for row in rows}
    complete = [row for row in range(len(table.cells)) if row not in left_out]
    if not complete:
        raise IndicatorError(
            f"--skip-missing: no row of {table.source} has all values: {complaints.counts} are "
            "missing; --ignore NAME leaves a column out"
        )
    lack = "lacks a value and is" if len(left_out) == 1 else "lack a value and are"
    words = f"{len(left_out)} of {len(table.cells)} rows {lack} left out"
    return replace(
        table,
        cells=[table.cells[row] for row in complete],
        lines=[table.lines[row] for row in complete],
        origins=[table.origins[row] for row in complete] if table.origins else (),
        notes=(*table.notes, f"{words}: {complaints.counts}."),
    )


def _without_number(cells: Cells) -> list[int]:
    return [row for row, text in enumerate(cells.texts) if means_no_number(text)]


def _empty_among_others(cells: Cells) -> list[int]:
    return [row for row, text in enumerate(cells.texts) if not text] if any(cells.texts) else []


def _add_of_faults(fault: Cells, faulty: Cells | None, rows: dict[str, list[int]]) -> None:
    """Add the rows that do not say what failed, or how many robots did."""
    numbers = faulty.texts if faulty else [""] * len(fault.texts)
    if not all(text.casefold() in NOT_KNOWN for text in fault.texts):
        rows[fault.name] = [
            row
            for row, (text, number) in enumerate(zip(fault.texts, numbers))
            if text.casefold() in NOT_KNOWN and number not in ZERO
        ]
    if faulty:
        rows[faulty.name] = sorted({*rows.get(faulty.name, ()), *_uncounted(fault, numbers)})


def _uncounted(fault: Cells, numbers: Sequence[str]) -> Iterator[int]:
    for row, (text, number) in enumerate(zip(fault.texts, numbers)):
        is_fault = text.casefold() not in NOT_KNOWN and fault.usual_faults[text] != NO_FAULT_WORD
        if is_fault and means_no_number(number):
            yield row
