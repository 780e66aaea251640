"""Progress of a study: a bar at a terminal, a sparse line elsewhere."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console

from swarm_logistics_env.studies.execution import Outcome

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

LINE_EVERY = 30.0  # seconds between plain lines


class Progress:
    """Shows how many of `total` runs are done, on standard error, while it is entered."""

    def __init__(self, total: int, label: str) -> None:
        self.total = total
        self.label = label
        self.done = 0
        self.failed = 0
        self._console = Console(stderr=True, highlight=False)
        self._bar: Bar | None = None
        self._start = self._last_line = time.monotonic()

    def __enter__(self) -> Self:
        self._start = self._last_line = time.monotonic()
        if self.total and self._console.is_terminal:
            self._bar = _bar(self._console)
            self._bar.add_task(self.label, total=self.total, note="")
            self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar:
            self._bar.stop()

    @property
    def seconds(self) -> float:
        """Time since it was entered [s]."""
        return time.monotonic() - self._start

    def advance(self, outcome: Outcome) -> None:
        """Count one finished run."""
        self.done += 1
        self.failed += outcome.error is not None
        rate = self.done / max(self.seconds, 1e-9)
        if self._bar:
            failed = f", {self.failed} failed" if self.failed else ""
            self._bar.update(self._bar.task_ids[0], advance=1, note=f"{rate:.2f} runs/s{failed}")
        elif time.monotonic() - self._last_line >= LINE_EVERY:
            self._last_line = time.monotonic()
            left = (self.total - self.done) / rate
            self._console.print(
                f"{self.label}: {self.done} of {self.total} runs, {self.failed} failed, "
                f"{rate:.2f} runs/s, about {left:.0f} s left"
            )


def _bar(console: Console) -> Bar:
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
    )
