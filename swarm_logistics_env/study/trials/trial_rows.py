"""Trials made of a table's rows: one run a row, or one delivery a row."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .table import Columns, Formula, Row, Table
from .trial import NO_FAULT_WORD, REPEATED, Trial
from .values import NOT_KNOWN, ZERO, FaultNames

# What a spreadsheet shows in place of a value, in any language: "#DIV/0!", "#NV", "Err:502".
_ERROR = re.compile(r"#[¡¿]?[\w/ ]+[!?]|#N/[AD]|#NV|#{3,}|Err:\d{3}")
_ROUNDED = re.compile(r"\d([.,]\d+)?[eE]\+\d\d")  # as a spreadsheet shows a long number
_DIGITS = 15  # that a spreadsheet keeps of a number


def check_cells(table: Table, columns: Columns, varying: Sequence[str], *, is_summed: bool) -> None:
    """Refuse what a spreadsheet put in place of a value, and labels that only some rows have.

    A table without rows is refused, too.

    Args:
        varying: names of the parameters.
        is_summed: whether rows of robots were summed.

    Raises:
        IndicatorError: there is such a cell, of which the first of its column is named.
    """
    if not table.cells:
        raise IndicatorError(
            f"{table.source} holds no trial: should have a row for each below the names"
        )
    names = columns.names
    used = {*names.values(), *columns.blocks, *varying}
    for name in table.header:
        if name in used:
            _refuse_spoiled(table, name)
        if name in columns.blocks or name == names.get("trial"):
            _refuse_rounded(table, name)
        if name in columns.blocks:
            _refuse_unknown_number(table, name)
    labels = [names.get(label) for label in ("policy", "table", "n_robots")]
    if is_summed or "time" in names:  # several rows make a trial
        labels.append(names.get("trial"))
    if len(columns.blocks) > 1:  # one alone is checked with the pairs
        labels += columns.blocks
    every_row = range(len(table.cells))
    for label in filter(None, labels):
        _refuse_gaps(table, label, every_row)
    if {"onset", "faulty"} <= names.keys():
        faulty = table.column(names["faulty"])
        with_fault = [row for row in every_row if faulty[row] not in ("", *ZERO)]
        _refuse_gaps(table, names["onset"], with_fault)


def _refuse_spoiled(table: Table, name: str) -> None:
    """Refuse the error of a formula, and a formula that nobody computed."""
    for row, cell in enumerate(table.column(name)):
        if isinstance(cell, Formula):
            should = (
                "should be a value, as nobody computed this formula: open the file in a "
                "spreadsheet and save it"
            )
            raise table.error(row, name, cell, should)
        if cell.startswith(("#", "Err:")) and _ERROR.fullmatch(cell):
            should = "should be a value, where a spreadsheet shows the error of a formula"
            raise table.error(row, name, cell, should)


def _refuse_rounded(table: Table, name: str) -> None:
    """Refuse labels that a spreadsheet has rounded, so that several may have become one."""
    cells = table.column(name)
    long = {cell for cell in cells if cell.isdecimal() and len(cell) > _DIGITS}
    is_rounded = not any(cell[_DIGITS:].strip("0") for cell in long)
    for row, cell in enumerate(cells):
        if _ROUNDED.fullmatch(cell) or (is_rounded and cell in long):
            should = (
                f"should have all its digits, of which a spreadsheet keeps {_DIGITS}: let the "
                "column be of texts before they are put in"
            )
            raise table.error(row, name, cell, should)


def _refuse_unknown_number(table: Table, name: str) -> None:
    """Refuse a word for no value among numbers; among names it is one."""
    cells = table.column(name)
    unknown = [row for row, cell in enumerate(cells) if cell and cell.casefold() in NOT_KNOWN]
    numbers = {*cells} - {cells[row] for row in unknown} - {""}
    if unknown and numbers and all(map(str.isdecimal, numbers)):
        row = unknown[0]
        raise table.error(row, name, cells[row], "should be a number, as in other rows")


def _refuse_gaps(table: Table, name: str, rows: Sequence[int]) -> None:
    """Refuse an empty cell where other rows have a label: it belongs to each row."""
    cells = table.column(name)
    empty = [row for row in rows if not cells[row]]
    if empty and len(empty) < len(rows):
        should = (
            "should be there in each row, as in others, also where a group has it in its first "
            f"row alone; --value {quote(f'{name}:=NEW')} fills all such cells"
        )
        raise table.error(empty[0], name, "", should)


def trial_of(
    row: Row,
    faults: FaultNames,
    varying: Sequence[str],
    duration: float | None,
    blocks: Mapping[str, int],
    unnamed: str,
    *,
    performance: float = 0.0,
) -> Trial:
    """Return the trial of a row, without the times of an event log.

    Args:
        faults: of the file.
        varying: names of the parameters.
        duration: of every trial [s], where no column says it.
        blocks: a number for each block; none where they are numbers.
        unnamed: what a policy is called that the file does not name.
        performance: P of it.
    """
    n_robots = row.whole_or_none("n_robots", 1)
    fault = faults[row.text("fault")]
    faulty = row.whole_or_none("faulty", 0) or 0
    is_fault = fault not in (NO_FAULT_WORD, REPEATED)
    onset = row.number_or_none("onset") or 0.0
    if row.text("duration"):
        duration = row.number("duration", 0.0)
    if is_fault and not faulty:
        raise row.error("faulty", f"should be how many robots fail by {fault!r}, 1 or more")
    if faulty and not is_fault:
        raise row.error("faulty", "should be 0 without a fault, or the fault be named")
    if is_fault and n_robots is None:
        raise row.error("n_robots", "should be the swarm's size, or R is undefined")
    if n_robots is not None and faulty >= n_robots:
        raise row.error("faulty", f"should be less than the {n_robots} robots")
    if duration is not None and onset >= duration:
        raise row.error("onset", f"should be before the trial ends at {duration:g} s")
    return Trial(
        row.line,
        row.text("policy") or unnamed,
        row.text("table"),
        n_robots,
        fault,
        faulty,
        # Without a fault nothing fails at any time, whatever the column says.
        onset if is_fault else 0.0,
        tuple((name, row.parameter(name)) for name in varying),
        blocks.get(row.text("seed")) if blocks else row.whole_or_none("seed", 0),
        performance,
        duration=duration,
        contacts=row.number_or_none("contacts"),
    )


def check_labels(rows: Sequence[tuple[Trial, Row]]) -> None:
    """Refuse runs of one condition that have one label.

    Raises:
        IndicatorError: there are some.
    """
    labels: dict[object, Row] = {}
    for trial, row in rows:
        label = row.text("trial")
        if label and (first := labels.setdefault((trial.condition, label), row)) is not row:
            raise row.error("trial", f"is in line {first.line} too: should name one run a row")


def performance_of(row: Row, finished: Mapping[str, bool]) -> float:
    """Return P of a row that is a run: what the column says, or work by time.

    Args:
        finished: what each cell of the column `finished` says; none where nothing does.
    """
    if "time_to_finish" in row.names:
        return _rate(row, finished.get(row.text("finished")))
    return row.number("performance", 0.0)


def _rate(row: Row, finished: bool | None) -> float:
    """Return what was done in a trial by the time that it took [1/s, or 1/step]."""
    if finished is None:
        finished = bool(row.text("time_to_finish"))
    if finished:
        time = _time(row, "time_to_finish")
        if row.text("duration") and time > row.number("duration"):
            raise row.error(
                "time_to_finish",
                f"should not be after its duration {row.number('duration'):g}",
            )
        if "work" not in row.names:
            return 1.0 / time
        work = row.number("work", 0.0)
        if row.text("performance") and row.number("performance") < work:
            raise row.error(
                "performance",
                f"should be its work of {work:g}, as the trial counts as finished; a column "
                "'finished' says which did not",
            )
        return work / time
    lasted = "duration" if row.text("duration") else "time_to_finish"
    if not (row.text("performance") and row.text(lasted)):
        raise row.error(
            "time_to_finish",
            "of a trial that did not finish, columns should say how long it lasted (duration) and "
            "what was done by then (performance)",
        )
    return row.number("performance", 0.0) / _time(row, lasted)


def _time(row: Row, column: str) -> float:
    time = row.number(column, 0.0)
    if not time:
        raise row.error(column, "should be more than 0")
    return time


def events_of(rows: Sequence[tuple[Trial, Row]]) -> list[Trial]:
    """Return the trials of a table with one delivery a row, with their times."""
    runs: dict[object, tuple[Trial, list[float]]] = {}
    for trial, row in rows:
        if row.text("performance"):
            raise row.error("performance", "should not stand beside times: ignore one of them")
        if not row.text("trial") and trial.seed is None:
            raise row.error("trial", "should say which run a delivery belongs to, or a seed do")
        time = row.number_or_none("time")
        if time is not None and trial.duration is not None and time > trial.duration:
            raise row.error("time", f"should not be after its duration {trial.duration:g}")
        if trial.onset and trial.duration is None:
            raise row.error(
                "duration",
                "should say when a trial ends [s], as a fault begins during it; "
                "a column of it, or --duration SECONDS",
            )
        key = (trial.condition, trial.seed, row.text("trial"))
        runs.setdefault(key, (trial, []))[1].extend([] if time is None else [time])
    return [
        replace(trial, times=tuple(sorted(times)), performance=float(len(times)))
        for trial, times in runs.values()
    ]
