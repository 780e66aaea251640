"""Trials recorded anywhere (real robots, another simulator, a paper's tables), read from CSV."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .inputs import IndicatorError, Numbers
from .trials_table import Row, read_rows

NO_FAULT_WORD = "none"
REMOVED_WORD = "removed"
FEWEST_OF_COVARIATE = 6  # rows that all differ in a column are no conditions of a trial each
_IS_A_TIME = re.compile(r"(?i)\b(times?|duration|makespan|latency)\b|\[(s|sec|min|steps?)\]")
REPEATED = "other behaviour"  # no fault, a second time: what chance alone makes of a pair
_NO_FAULT_WORDS = ("", NO_FAULT_WORD, "no fault", "no_fault", "baseline", "healthy", "0", "-", "na")
_FAULT_NAMES = {
    **dict.fromkeys(_NO_FAULT_WORDS, NO_FAULT_WORD),
    REMOVED_WORD: REMOVED_WORD,
    REPEATED: REPEATED,
    "none again": REPEATED,
}


@dataclass(frozen=True)
class Trial:
    """One run.

    Attributes:
        line: of the file that its row begins in, for an event log its first row.
        policy: what controlled the robots.
        table: of the file's tables, each of which has a P_o of its own; "" where none is named.
        n_robots: swarm size N; None: not given.
        fault: "none", "removed" (the m robots are not there), or a failure mode of any name.
        faulty: m, 0 without a fault.
        onset: when they fail [s].
        parameters: name and value of everything else that varies in the file.
        seed: shared by the trials that belong together; a number for each block where the file
            names blocks by a text, as a map; None: the file pairs none.
        performance: P, 0 or more; of an event log the number of deliveries.
        times: of the deliveries [s], ascending; None: not recorded.
        duration: of the trial [s]; None: not given.
        contacts: per robot-minute [1/min]; None: not recorded.
    """

    line: int
    policy: str
    table: str
    n_robots: int | None
    fault: str
    faulty: int
    onset: float
    parameters: tuple[tuple[str, float], ...]
    seed: int | None
    performance: float
    times: tuple[float, ...] | None = None
    duration: float | None = None
    contacts: float | None = None

    @property
    def condition(self) -> tuple[object, ...]:
        """What is equal in the trials of one condition."""
        fault = self.fault, self.faulty, self.onset
        return (self.policy, self.table, self.n_robots, *fault, self.parameters)


@dataclass(frozen=True)
class Trials:
    """All runs of a file, in its order.

    Attributes:
        file: its name.
        digest: of its content, 16 hexadecimal digits.
        rows: the runs.
        notes: sentences on how the file was read.
    """

    file: str
    digest: str
    rows: tuple[Trial, ...]
    notes: tuple[str, ...] = ()

    @property
    def paired(self) -> bool:
        """Whether the runs name their seeds."""
        return self.rows[0].seed is not None

    def select(self, **conditions: object) -> tuple[Trial, ...]:
        """Return the runs that meet all conditions, by seed (in the file's order without seeds).

        Args:
            conditions: attributes of `Trial` or names of parameters, e.g. `fault="none"`,
                `n_robots=8`, `width=1.5`.

        Raises:
            IndicatorError: no run meets them.
        """
        trials = [
            row
            for row in self.rows
            if all(
                dict(row.parameters).get(name, getattr(row, name, None)) == value
                for name, value in conditions.items()
            )
        ]
        if not trials:
            conditions_text = ", ".join(f"{name} = {value!r}" for name, value in conditions.items())
            raise IndicatorError(f"{self.file} has no trial with {conditions_text}")
        return tuple(sorted(trials, key=lambda row: row.seed or 0))

    def performance(self, **conditions: object) -> Numbers:
        """Return P of the runs that `select` gives, shape (n,)."""
        return np.array([row.performance for row in self.select(**conditions)])


def read_trials(
    path: str | Path,
    *,
    columns: Mapping[str, str] | None = None,
    ignore: Sequence[str] = (),
    duration: float | None = None,
    decimal: str | None = None,
) -> Trials:
    """Read one run a row, or one delivery a row (an event log), from a CSV file.

    The delimiter (comma, semicolon, tab) is found out. The columns are `robots`,
    `fault`, `faulty`, `onset`, `policy`, `seed`, `trial`, `contacts` and `performance`, or words of
    `trials_table.NAMES` for them, as far as they apply; any other column of numbers that vary is a
    parameter of that name. An event log has `time` instead of `performance`; a run without any
    delivery is a row with an empty time. A column `table` tells tables apart of which each has
    runs of its own, also without a fault.

    Args:
        columns: what a column is to its name in the file, e.g. {"performance": "boxes"}.
        ignore: columns to leave out.
        duration: of every trial [s], where no column says it; faults in mid-run need it.
        decimal: the sign before decimals, "." or ","; None: ".", and a file is refused in which it
            may stand between thousands.

    Raises:
        IndicatorError: the file cannot be read, or a line of it cannot be; names line, column and
            value.
    """
    path = Path(path)
    rows, parameters, digest = read_rows(path, columns or {}, ignore, decimal)
    is_log = "time" in rows[0].names
    varying, covariates = list[str](), list[str]()
    for name in parameters:
        values = {row.cells[name] for row in rows}
        if len(values) > 1:
            # In an event log a row is a delivery.
            is_covariate = len(values) == len(rows) >= FEWEST_OF_COVARIATE and not is_log
            (covariates if is_covariate else varying).append(name)
    faults = dict.fromkeys(row.text("fault") for row in rows)
    _check_columns(path, rows[0], faults)
    # Each fault in small letters to how its first row has it.
    spelled = {name.casefold(): name for name in reversed(faults)}
    blocks = _blocks(rows)
    trials = [(_trial(row, spelled, varying, duration, blocks), row) for row in rows]
    complete = _events(trials) if is_log else _runs(trials)
    _check_pairing(path, complete)
    takes_times = "time_to_finish" in rows[0].names
    if not takes_times:  # a rate compares trials of any length
        _check_durations(path, complete)
    notes = [
        f"The faults {spelled[name.casefold()]} and {name} are taken for one."
        for name in faults
        if name not in spelled.values()
    ]
    if takes_times:
        work = rows[0].names.get("work", "1")
        notes.append(f"P is {work} divided by {rows[0].names['time_to_finish']}: more is better.")
    notes += [
        f"{name!r} differs in every trial: it tells no conditions apart." for name in covariates
    ]
    notes += _notes_on_pairs(complete, rows[0].names.get("seed", "seed"))
    counts = Counter(trial.condition for trial in complete)
    if varying and min(counts.values()) == 1 < max(counts.values()):
        notes.append(
            f"{len(complete)} trials in {len(counts)} conditions, told apart by "
            f"{' and '.join(varying)}, some of a single trial: leave out what was only noted, as "
            f"by --ignore {varying[0]!r}."
        )
    return Trials(path.name, digest, tuple(complete), tuple(notes))


def _check_columns(path: Path, row: Row, faults: Iterable[str]) -> None:
    """Refuse a file without the columns that no other can stand for, all of them at once."""
    lacking = {}
    if not {"performance", "time", "time_to_finish"} & row.names.keys():
        lacking["performance"] = "column 'performance', or time, for one delivery a row"
    name = row.names.get("performance", "")
    if "time_to_finish" not in row.names and _IS_A_TIME.search(name) and "per" not in name.split():
        raise IndicatorError(
            f"{path}: {name!r} is a time by its name, of which less is better: say --column "
            f"time_to_finish={name!r}, and --column work=NAME if what was done in it varies"
        )
    fails = any(
        _FAULT_NAMES.get(fault.lower()) not in (NO_FAULT_WORD, REPEATED) for fault in faults
    )
    if fails and "faulty" not in row.names:
        lacking["faulty"] = "column 'faulty', for how many robots fail"
    if lacking:
        options = " ".join(f"--column {name}=NAME" for name in lacking)
        raise IndicatorError(
            f"{path} has no {' and no '.join(lacking.values())}: it has "
            f"{', '.join(map(repr, row.cells))}; say which it is by {options}"
        )


def _blocks(rows: Sequence[Row]) -> dict[str, int]:
    """Return a number for each block, in the file's order; none where seeds are numbers."""
    if all(row.is_number("seed") for row in rows):
        return {}
    names = dict.fromkeys(row.text("seed") for row in rows if row.text("seed"))
    return {name: number for number, name in enumerate(names)}


def _trial(
    row: Row,
    spelled: Mapping[str, str],
    varying: Sequence[str],
    duration: float | None,
    blocks: Mapping[str, int],
) -> Trial:
    """Return the trial of a row, without performance and times."""
    n_robots = row.whole_or_none("n_robots", 1)
    fault, faulty = row.text("fault"), row.whole_or_none("faulty", 0) or 0
    fault = _FAULT_NAMES.get(fault.lower(), spelled[fault.casefold()])
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
        row.text("policy") or "recorded",
        row.text("table"),
        n_robots,
        fault,
        faulty,
        # Without a fault nothing fails at any time, whatever the column says.
        onset if is_fault else 0.0,
        tuple((name, row.number(name)) for name in varying),
        blocks.get(row.text("seed")) if blocks else row.whole_or_none("seed", 0),
        0.0,
        duration=duration,
        contacts=row.number_or_none("contacts"),
    )


def _runs(rows: Sequence[tuple[Trial, Row]]) -> list[Trial]:
    labels: dict[object, int] = {}
    for trial, row in rows:
        label = row.text("trial")
        if label and (line := labels.setdefault((trial.condition, label), row.line)) != row.line:
            raise row.error("trial", f"is in line {line} too: should name one run a row")
    rate = _rate if "time_to_finish" in rows[0][1].names else None
    return [
        replace(trial, performance=rate(row) if rate else row.number("performance", 0.0))
        for trial, row in rows
    ]


def _rate(row: Row) -> float:
    """Return what was done in a trial by the time that it took."""
    if row.text("time_to_finish"):
        time = row.number("time_to_finish", 0.0)
        if not time:
            raise row.error("time_to_finish", "should be more than 0")
        return (row.number("work", 0.0) if "work" in row.names else 1.0) / time
    if not (row.text("performance") and row.text("duration")):
        raise row.error(
            "time_to_finish",
            "of a trial that did not finish, columns should say how long it lasted (duration) and "
            "what was done by then (performance)",
        )
    return row.number("performance", 0.0) / row.number("duration", 0.0)


def _events(rows: Sequence[tuple[Trial, Row]]) -> list[Trial]:
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


def _check_pairing(path: Path, rows: Sequence[Trial]) -> None:
    """Refuse runs without a seed beside others, and two of one seed in a condition."""
    if all(row.seed is None for row in rows):
        return
    conditions: dict[object, dict[int | None, Trial]] = {}
    for row in rows:
        if row.seed is None:
            raise IndicatorError(
                f"{path}, line {row.line}: has no seed, as other rows have: give every run one, or "
                "leave the column out"
            )
        of_seed = conditions.setdefault(row.condition, {})
        if (first := of_seed.setdefault(row.seed, row)) is not row:
            raise IndicatorError(
                f"{path}, line {row.line}: has seed {row.seed} like line {first.line}, "
                "two rows of one seed in one condition: should be one, or leave the column out"
            )


def _notes_on_pairs(trials: Sequence[Trial], block: str) -> Iterator[str]:
    """Yield which policies have less than all blocks, and how many runs have no partner.

    Args:
        block: what the file calls a seed.
    """
    every = {trial.seed for trial in trials} - {None}
    by_table: dict[tuple[str, str], dict[object, set[int | None]]] = {}
    for trial in trials:
        conditions = by_table.setdefault((trial.policy, trial.table), {})
        conditions.setdefault(trial.condition, set()).add(trial.seed)
    for (policy, table), conditions in by_table.items():
        title = f"{policy}, {table}" if table else policy
        in_any, in_all = set.union(*conditions.values()), set.intersection(*conditions.values())
        if len(in_any) < len(every):
            yield f"{title} has runs of {len(in_any)} of {len(every)} ({block})."
        alone = sum(len(seeds - in_all) for seeds in conditions.values())
        if alone:
            yield (
                f"{title}: no partner of the same {block} in some condition for {alone} of its "
                "runs: they count for P, and are left out where such a condition is compared."
            )


def _check_durations(path: Path, rows: Sequence[Trial]) -> None:
    """Refuse trials of which some lasted longer than others."""
    for row in rows:
        if row.duration != rows[0].duration:
            raise IndicatorError(
                f"{path}, line {row.line}: is not as long as line {rows[0].line}: runs compared "
                "should be of one length; else let P be a rate, and leave the column out"
            )
