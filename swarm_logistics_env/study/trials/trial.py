"""Trial: one recorded run; Trials: all runs of a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swarm_logistics_env.spi.inputs import IndicatorError, Numbers

NO_FAULT_WORD = "none"
REMOVED_WORD = "removed"
REPEATED = "other behaviour"  # no fault, a second time: what chance alone makes of a pair


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
        seed: shared by the trials that belong together; a number for each block, in the order of
            their names, where the file names blocks by a text, as a map; None: the file pairs none.
        performance: P, 0 or more; of an event log the number of deliveries.
        times: of the deliveries [s], ascending; None: not recorded.
        duration: of the trial [s]; None: not given.
        contacts: per robot-minute [1/min]; None: not recorded.
        n_trials: of the file, of which it is the mean: several of one block and condition.
        least: P at least, of a trial that was stopped and in which nobody counted what was done:
            `performance` is the most that P may be; None: P is known.
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
    n_trials: int = 1
    least: float | None = None

    @property
    def condition(self) -> tuple[object, ...]:
        """What is equal in the trials of one condition."""
        fault = self.fault, self.faulty, self.onset
        return (self.policy, self.table, self.n_robots, *fault, self.parameters)


class Column(NamedTuple):
    """What a column of a file was taken for.

    Attributes:
        name: in the file.
        use: what it is, a key of `trial_columns.COLUMN_NAMES`, or why it is left out.
        values: the first of its different cells.
        n_values: how many different cells it has.
    """

    name: str
    use: str
    values: tuple[str, ...]
    n_values: int


@dataclass(frozen=True)
class Trials:
    """All runs of a file, in its order; of several in one block and condition their mean.

    Attributes:
        file: its name.
        digest: of its content, 16 hexadecimal digits.
        rows: the runs.
        notes: sentences on how the file was read.
        columns: what each of its columns was taken for.
        performance_name: what it calls P, with its unit where it names one.
        references: table, parameter and its value that A is relative to, where it is settled.
        blocks: the names of the blocks that `seed` numbers; none where the file numbers them.
    """

    file: str
    digest: str
    rows: tuple[Trial, ...]
    notes: tuple[str, ...] = ()
    columns: tuple[Column, ...] = ()
    performance_name: str = "P"
    references: tuple[tuple[str, str, float], ...] = ()
    blocks: tuple[str, ...] = ()

    @property
    def n_trials(self) -> int:
        """How many trials the file holds."""
        return sum(row.n_trials for row in self.rows)

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
