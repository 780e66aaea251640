"""Progress of a study, policy by policy: bars at a terminal, a sparse line elsewhere."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Self

from rich.console import Console

from swarm_logistics_env.studies.runs import Run
from swarm_logistics_env.tasks.task import Outcome

if TYPE_CHECKING:
    from rich.progress import Progress as Bars
    from rich.progress import TaskID

LINE_EVERY = 30.0  # seconds between plain lines


class Progress:
    """Shows on standard error how many of the runs are done, while it is entered.

    Args:
        runs: the runs that are going to be played.
        label: the study's name.
        console: the console to write to; None means standard error.
    """

    def __init__(self, runs: Iterable[Run], label: str, console: Console | None = None) -> None:
        self.label = label
        self.done = Counter[str]()
        self.failed = 0
        self._totals = Counter(run.condition.policy.label for run in runs)
        self._console = console or Console(stderr=True, highlight=False)
        self._bars: Bars | None = None
        self._tasks: dict[str | None, TaskID] = {}
        self._start = self._last_line = time.monotonic()

    def __enter__(self) -> Self:
        self._start = self._last_line = time.monotonic()
        if self._totals and self._console.is_terminal:
            self._bars = _bars(self._console)
            for policy, total in self._shown().items():
                name = self.label if policy is None else policy
                self._tasks[policy] = self._bars.add_task(name, total=total, note="")
            self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bars:
            self._bars.stop()

    @property
    def seconds(self) -> float:
        """Time since it was entered [s]."""
        return time.monotonic() - self._start

    def advance(self, run: Run, outcome: Outcome) -> None:
        """Count one finished run."""
        self.done[run.condition.policy.label] += 1
        self.failed += outcome.error is not None
        if self._bars:
            for policy, total in self._shown().items():
                done = self.done.total() if policy is None else self.done[policy]
                self._bars.update(self._tasks[policy], completed=done, note=self._pace(done, total))
        elif time.monotonic() - self._last_line >= LINE_EVERY:
            self._last_line = time.monotonic()
            self._console.print(self._line(), soft_wrap=True)

    def _shown(self) -> dict[str | None, int]:
        """Return the totals of the bars: of all runs (None), and of each of several policies."""
        shown: dict[str | None, int] = {None: self._totals.total()}
        if len(self._totals) > 1:
            shown.update(self._totals)
        return shown

    def _pace(self, done: int, total: int) -> str:
        rate = done / max(self.seconds, 1e-9)
        left = f", {clock((total - done) / rate)} left" if 0 < done < total else ""
        return f"{rate:.2f} runs/s{left}"

    def _line(self) -> str:
        total, done = self._totals.total(), self.done.total()
        policies = [f"{name} {self.done[name]} of {n}" for name, n in self._totals.items()]
        each = f" ({', '.join(policies)})" if len(policies) > 1 else ""
        return (
            f"{self.label}: {done} of {total} runs{each}, {self.failed} failed, "
            f"{self._pace(done, total)}"
        )


def clock(seconds: float) -> str:
    """Return a time as h:mm:ss, or m:ss below an hour."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def _bars(console: Console) -> Bars:
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
    )

    return Progress(
        # Their names are not Rich's markup.
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}", markup=False),
        console=console,
    )
