"""The progress of a training, at a terminal or in a log file."""

from __future__ import annotations

import time
from typing import Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

LINE_EVERY = 30.0  # seconds between plain lines


class ProgressBar:
    """Shows on standard error how far a training is: a bar at a terminal, sparse lines elsewhere.

    Args:
        label: what is done.
        total: how much there is to do, in `unit`.
        done: of it before now.
        unit: in words.
    """

    def __init__(self, label: str, total: int, done: int = 0, unit: str = "agent-steps") -> None:
        self._label, self._total, self._unit = label, total, unit
        self._first = self._done = done
        self._console = Console(stderr=True, highlight=False)
        self._bar: Progress | None = None
        self._start = self._last_line = time.monotonic()

    def __enter__(self) -> Self:
        self._start = self._last_line = time.monotonic()
        if self._console.is_terminal:
            self._bar = Progress(
                *(TextColumn("{task.description}"), BarColumn()),
                TextColumn("{task.percentage:3.0f} %  {task.fields[note]}"),
                *(TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn()),
                console=self._console,
            )
            self._bar.add_task(self._label, total=self._total, completed=self._done, note="")
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar:
            self._bar.stop()

    @property
    def rate(self) -> float:
        """What was done per second since it was entered."""
        return (self._done - self._first) / max(time.monotonic() - self._start, 1e-9)

    def reach(self, done: int, what: str = "") -> None:
        """Show that so much is done; print `what` came of it, if anything is to be said."""
        self._done = done
        if self._bar:
            note = f"{self.rate:,.0f} {self._unit}/s"
            self._bar.update(self._bar.task_ids[0], completed=done, note=note)
        if what or (not self._bar and time.monotonic() - self._last_line >= LINE_EVERY):
            self.say(what)

    def say(self, what: str) -> None:
        """Print a line: how far it is, and `what`."""
        self._last_line = time.monotonic()
        parts = [
            f"{self._done:,} of {self._total:,} {self._unit}",
            f"{self.rate:,.3g}/s" if self.rate < 10 else f"{self.rate:,.0f}/s",
            what,
        ]
        self._console.print(f"{self._label}: {', '.join(part for part in parts if part)}")
