"""Trials recorded anywhere (real robots, another simulator, a paper's tables), read from CSV."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .inputs import IndicatorError, Numbers
from .trials_table import Table, read_table

NO_FAULT = "none"
REMOVED = "removed"
REPEATED = "other behaviour"  # no fault, a second time: what chance alone makes of a pair
_FAULTS = {
    NO_FAULT: ("", "-", "0", "no", "no fault", "ok", "healthy"),
    REMOVED: ("absent",),
    REPEATED: ("none again",),
}
_FAULT_NAMES = {word: name for name, words in _FAULTS.items() for word in (name, *words)}


@dataclass(frozen=True)
class Trial:
    """One run.

    Attributes:
        line: of the file, for an event log that of its first row.
        policy: what controlled the robots.
        table: of the file's tables, each of which has a P_o of its own; "" where none is named.
        n_robots: swarm size N; None: not given.
        fault: "none", "removed" (the m robots are not there), or a failure mode of any name.
        faulty: m, 0 without a fault.
        onset: when they fail [s].
        parameters: name and value of everything else that varies in the file.
        seed: shared by the trials that belong together; None: the file pairs none.
        performance: P, 0 or more; of an event log the number of deliveries.
        times: of the deliveries [s], ascending; None: not recorded.
        duration: of the trial [s]; None: not given.
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
        found = [
            row
            for row in self.rows
            if all(
                dict(row.parameters).get(name, getattr(row, name, None)) == value
                for name, value in conditions.items()
            )
        ]
        if not found:
            asked = ", ".join(f"{name} = {value!r}" for name, value in conditions.items())
            raise IndicatorError(f"{self.file} has no trial with {asked}")
        return tuple(sorted(found, key=lambda row: row.seed or 0))

    def performance(self, **conditions: object) -> Numbers:
        """Return P of the runs that `select` gives, shape (n,)."""
        return np.array([row.performance for row in self.select(**conditions)])


def read_trials(
    path: str | Path,
    *,
    columns: Mapping[str, str] | None = None,
    ignore: Sequence[str] = (),
    duration: float | None = None,
    decimal: str = ".",
) -> Trials:
    """Read one run a row, or one delivery a row (an event log), from a CSV file.

    The delimiter (comma, semicolon, tab) is found out. The columns are `robots`,
    `fault`, `faulty`, `onset`, `policy`, `seed`, `trial` and `performance`, or words of
    `trials_table.NAMES` for them, as far as they apply; any other column of numbers that vary is a
    parameter of that name. An event log has `time` instead of `performance`; a run without any
    delivery is a row with an empty time. A column `table` tells tables apart of which each has
    runs of its own, also without a fault.

    Args:
        columns: what a column is to its name in the file, e.g. {"performance": "boxes"}.
        ignore: columns to leave out.
        duration: of every trial [s], where no column says it; faults in mid-run need it.
        decimal: the sign before decimals, "." or ",".

    Raises:
        IndicatorError: the file cannot be read, or a line of it cannot be; names line, column and
            value.
    """
    path = Path(path)
    table, content = read_table(path, dict(columns or {}), tuple(ignore), decimal)
    rows = _events(table, duration) if "time" in table.places else _runs(table, duration)
    if not rows:
        raise IndicatorError(f"{path} holds no trial: should have a row for each below the names")
    _check_pairing(path, rows)
    _check_durations(path, rows)
    return Trials(path.name, hashlib.sha256(content).hexdigest()[:16], tuple(rows), table.notes)


def _runs(table: Table, duration: float | None) -> list[Trial]:
    if "performance" not in table.places:
        raise IndicatorError(
            f"{table.path} has no column 'performance', or time, for one delivery a row: it has "
            f"{', '.join(map(repr, table.header))}; say which it is by --column performance=NAME"
        )
    rows: list[Trial] = []
    labels: dict[object, int] = {}
    for line in range(len(table.rows)):
        trial = _trial(table, line, duration, table.number(line, "performance", least=0.0))
        label = table.text(line, "trial")
        if label and (first := labels.setdefault((trial.condition, label), line)) != line:
            raise table.error(
                line, "trial", f"is in line {table.lines[first]} too: should name one run a row"
            )
        rows.append(trial)
    return rows


def _events(table: Table, duration: float | None) -> list[Trial]:
    if "performance" in table.places:
        raise IndicatorError(
            f"{table.path} has a column of times and one of performance: should have one of them; "
            "ignore the other"
        )
    if "trial" not in table.places and "seed" not in table.places:
        raise IndicatorError(
            f"{table.path} has no column trial or seed: should say which run a delivery belongs to"
        )
    runs: dict[object, list[tuple[Trial, float | None]]] = {}
    for line in range(len(table.rows)):
        trial = _trial(table, line, duration, 0.0)
        time = table.number(line, "time", least=0.0) if table.text(line, "time") else None
        if time is not None and trial.duration is not None and time > trial.duration:
            raise table.error(line, "time", f"should not be after its duration {trial.duration:g}")
        if trial.onset and trial.duration is None:
            raise table.error(
                line,
                "duration",
                "should say when a trial ends [s], as a fault begins during it; "
                "a column of it, or --duration SECONDS",
            )
        key = (trial.condition, trial.seed, table.text(line, "trial"))
        runs.setdefault(key, []).append((trial, time))
    found = []
    for deliveries in runs.values():
        times = tuple(sorted(time for _, time in deliveries if time is not None))
        found.append(replace(deliveries[0][0], times=times, performance=float(len(times))))
    return found


def _trial(table: Table, line: int, duration: float | None, performance: float) -> Trial:
    n_robots = table.whole(line, "n_robots", least=1)
    fault, faulty = table.text(line, "fault"), table.whole(line, "faulty", least=0) or 0
    fault = _FAULT_NAMES.get(fault.lower(), table.spellings[fault.casefold()])
    is_fault = fault not in (NO_FAULT, REPEATED)
    if is_fault and not faulty:
        raise table.error(line, "faulty", f"should be how many robots fail by {fault!r}, 1 or more")
    if faulty and not is_fault:
        raise table.error(line, "faulty", "should be 0 without a fault, or the fault be named")
    if is_fault and n_robots is None:
        raise table.error(line, "n_robots", "should be the swarm's size, or R is undefined")
    if n_robots is not None and faulty >= n_robots:
        raise table.error(line, "faulty", f"should be less than the {n_robots} robots")
    onset = table.number(line, "onset", least=0.0) if table.text(line, "onset") else 0.0
    if table.text(line, "duration"):
        duration = table.number(line, "duration", least=0.0)
    if duration is not None and onset >= duration:
        raise table.error(line, "onset", f"should be before the trial ends at {duration:g} s")
    return Trial(
        table.lines[line],
        table.text(line, "policy") or "recorded",
        table.text(line, "table"),
        n_robots,
        fault,
        faulty,
        # Without a fault nothing fails at any time, whatever the column says.
        onset if is_fault else 0.0,
        table.parameters(line),
        table.whole(line, "seed", least=0),
        performance,
        duration=duration,
    )


def _check_pairing(path: Path, rows: Sequence[Trial]) -> None:
    """Refuse seeds that do not pair the runs of all conditions one to one."""
    seeded = [row for row in rows if row.seed is not None]
    if not seeded:
        return
    if len(seeded) < len(rows):
        bare = next(row for row in rows if row.seed is None)
        raise IndicatorError(
            f"{path}, line {bare.line}: has no seed, as other rows have: give every run one, or "
            "leave the column out"
        )
    conditions: dict[object, dict[int | None, Trial]] = {}
    for row in seeded:
        of_seed = conditions.setdefault(row.condition, {})
        if row.seed in of_seed:
            raise IndicatorError(
                f"{path}, line {row.line}: has seed {row.seed} like line {of_seed[row.seed].line}, "
                "two rows of one seed in one condition: should be one, or leave the column out"
            )
        of_seed[row.seed] = row
    everywhere = {row.seed for row in seeded}
    for of_seed in conditions.values():
        if set(of_seed) != everywhere:
            lacking = min(seed for seed in everywhere if seed is not None and seed not in of_seed)
            raise IndicatorError(
                f"{path}, line {min(row.line for row in of_seed.values())}: its condition has no "
                f"run of seed {lacking}: give every condition the same seeds, or leave the column "
                "out"
            )


def _check_durations(path: Path, rows: Sequence[Trial]) -> None:
    first = rows[0]
    for row in rows:
        if row.duration != first.duration:
            raise IndicatorError(
                f"{path}, line {row.line}: has duration {_told(row.duration)}, line {first.line} "
                f"{_told(first.duration)}: runs compared should be of one length; else let P be a "
                "rate, and leave the column out"
            )


def _told(duration: float | None) -> str:
    return "nothing" if duration is None else f"{duration:g}"
