"""Trials made of a table's rows: one run a row, or one delivery a row."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .complaints import Complaints
from .fault_names import FaultNames
from .table import CellError, Columns, Table
from .trial import NO_FAULT_WORD, REPEATED, Trial


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a table, read by what its columns are.

    Attributes:
        columns: of the table.
        position: of the row in it.
    """

    columns: Columns
    position: int

    @property
    def line(self) -> int:
        """The line of the file that it begins in."""
        return self.columns.table.lines[self.position]

    def text(self, meaning: str) -> str:
        """Return a cell by what its column is; empty where there is none."""
        cells = self.columns.by_meaning.get(meaning)
        return "" if cells is None else cells.texts[self.position]

    def number(self, meaning: str, least: float = -math.inf) -> float:
        """Return a cell as a number, by what its column is; a time in seconds."""
        return self.columns.by_meaning[meaning].number(self.position, least)

    def number_or_none(self, meaning: str) -> float | None:
        """Return a cell as a number, 0 or more; None: it is empty or not there."""
        return self.number(meaning, 0.0) if self.text(meaning) else None

    def whole_or_none(self, meaning: str, least: float) -> int | None:
        """Return a cell as a whole number, exactly; None: it is empty or not there."""
        if not self.text(meaning):
            return None
        return self.columns.by_meaning[meaning].whole_number(self.position, least)

    def error(self, meaning: str, should: str) -> IndicatorError:
        """Return the error that a cell cannot be."""
        if meaning not in self.columns.by_meaning:
            location = self.columns.table.location(self.position)
            return IndicatorError(f"{location}: {meaning} is missing: {should}")
        return self.columns.by_meaning[meaning].error(self.position, should)


def numbered_blocks(columns: Columns) -> dict[str, int]:
    """Return a number for each block, by its name; none where blocks are numbers."""
    seed = columns.by_meaning.get("seed")
    if seed is None or (len(columns.blocks) == 1 and seed.are_like_numbers):
        return {}
    return {name: number for number, name in enumerate(sorted({*seed.texts} - {""}))}


def trials_of(
    columns: Columns,
    faults: FaultNames,
    finished: Mapping[str, bool],
    blocks: Mapping[str, int],
    duration: float | None,
    complaints: Complaints,
) -> tuple[list[Trial], list[object]]:
    """Return the trials of a table, and the condition of each of its rows.

    Args:
        faults: of the file.
        finished: what each cell of the column `finished` says; none where nothing does.
        blocks: a number for each block; none where they are numbers.
        duration: of every trial [s], where no column says it.
        complaints: take the first row that is no trial for each column.

    Raises:
        IndicatorError: a row is no trial, two of a condition have one label, or some trials lasted
            longer than others where P is no rate.
    """
    unnamed = Path(columns.table.source).stem or columns.table.source  # a policy without a name
    rows = [Row(columns, position) for position in range(len(columns.table.cells))]
    pairs = []
    for row in rows:
        try:
            pairs.append((trial_of(row, unnamed, faults, finished, blocks, duration), row))
        except CellError as error:
            if error.column not in complaints.columns:
                complaints.add(error)
    complaints.raise_all()
    if "time" in columns.by_meaning:
        trials = events_of(pairs)
    else:
        check_labels(pairs)
        trials = [trial for trial, _ in pairs]
    if "time_to_finish" not in columns.by_meaning:  # a rate compares trials of any length
        _check_durations(columns.table, trials)
    return trials, [trial.condition for trial, _ in pairs]


def trial_of(
    row: Row,
    unnamed: str,
    faults: FaultNames,
    finished: Mapping[str, bool],
    blocks: Mapping[str, int],
    duration: float | None,
) -> Trial:
    """Return the trial of a row, of an event log without its times; arguments as of `trials_of`."""
    _refuse_two_durations(row, duration)
    performance, least = performance_of(row, finished, duration)
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
        tuple((cells.name, cells.number(row.position)) for cells in row.columns.parameters),
        blocks.get(row.text("seed")) if blocks else row.whole_or_none("seed", 0),
        performance,
        duration=duration,
        contacts=row.number_or_none("contacts"),
        least=least,
    )


def _refuse_two_durations(row: Row, duration: float | None) -> None:
    """Refuse a row that says another duration than the option, but for times to finish.

    Of these the option says the limit, and the column how long a trial lasted.
    """
    if duration is None or not row.text("duration") or "time_to_finish" in row.columns.by_meaning:
        return
    if row.number("duration", 0.0) != duration:
        raise row.error(
            "duration",
            f"should be the {duration:.15g} of --duration; leave out either the option, or the "
            f"column by --ignore {quote(row.columns.by_meaning['duration'].name)}",
        )


def check_labels(rows: Sequence[tuple[Trial, Row]]) -> None:
    """Refuse runs of one condition that have one label."""
    labels: dict[object, Row] = {}
    for trial, row in rows:
        label = row.text("trial")
        if label and (first := labels.setdefault((trial.condition, label), row)) is not row:
            raise row.error("trial", f"is in line {first.line} too: should name one run a row")


def performance_of(
    row: Row, finished: Mapping[str, bool], limit: float | None
) -> tuple[float, float | None]:
    """Return P of a row, and the least that it may be if it is not known; see `Trial`.

    It is what the column says, or work by time; 0 where the row is a delivery.
    """
    if "time" in row.columns.by_meaning:
        return 0.0, None
    if "time_to_finish" in row.columns.by_meaning:
        return _rate(row, finished.get(row.text("finished")), limit)
    return row.number("performance", 0.0), None


def _rate(row: Row, finished: bool | None, limit: float | None) -> tuple[float, float | None]:
    """Return what was done in a trial by the time that it took [1/s, or 1/step], as above.

    Args:
        limit: at which trials end at the latest, where no column says it; None: nobody does.
    """
    is_timed = bool(row.text("time_to_finish"))
    is_counted = "performance" in row.columns.by_meaning
    if row.text("duration"):
        limit = row.number("duration")
    elif is_timed and limit is not None and finished is None and not is_counted:
        finished = row.number("time_to_finish") < limit
    finished = is_timed if finished is None else finished
    if is_timed and limit is not None and row.number("time_to_finish") > limit:
        raise row.error("time_to_finish", f"should not be after its duration {limit:g}")
    work = row.number("work", 0.0) if "work" in row.columns.by_meaning else 1.0
    if finished:
        time = _time(row, "time_to_finish")
        done = row.number_or_none("performance")
        if "work" in row.columns.by_meaning and done is not None and done < work:
            raise row.error(
                "performance",
                f"should be its work of {work:g}, as the trial counts as finished; a column "
                "'finished' says which did not",
            )
        return work / time, None
    if row.text("duration"):
        lasted = _time(row, "duration")
    elif is_timed:
        lasted = _time(row, "time_to_finish")
    else:
        lasted = limit or 0.0
    if not lasted or (is_counted and not row.text("performance")):
        raise row.error(
            "time_to_finish",
            "of a trial that did not finish, columns should say how long it lasted (duration), or "
            "--duration SECONDS, and what was done by then (performance), if anybody counted it",
        )
    if is_counted:
        return row.number("performance", 0.0) / lasted, None
    return work / lasted, 0.0


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


def _check_durations(table: Table, trials: Sequence[Trial]) -> None:
    """Refuse trials of which some lasted longer than others."""
    for trial in trials:
        if trial.duration != trials[0].duration:
            raise IndicatorError(
                f"{table.source}, {table.line_word} {trial.line}: is not as long as "
                f"{table.line_word} {trials[0].line}: runs compared should be of one length; else "
                "let P be a rate, and leave the column out"
            )
