"""Progress of long work, of a study or a training: bars at a terminal, a sparse line elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from time import monotonic
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

LINE_EVERY = 30.0  # seconds between plain lines
_NOTHING: Mapping[str, int] = {}


class ProgressBar:
    """Shows on standard error how much is done, while it is entered.

    Args:
        label: what is done.
        total: how much there is to do, in `unit`.
        unit: in words, e.g. "runs".
        done: how much of it was done before now.
        parts: how much there is to do of each part of it, by the part's name; several have a bar
            each.
        console: the console to write to; None means standard error.
    """

    def __init__(
        self,
        label: str,
        total: int,
        unit: str,
        *,
        done: int = 0,
        parts: Mapping[str, int] = _NOTHING,
        console: Console | None = None,
    ) -> None:
        console = console or Console(stderr=True, highlight=False)
        self._unit, self._first, self._note = unit, done, ""
        # The bars draw themselves anew twice a second, also while one piece of the work takes long.
        self._bars = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=20),
            TextColumn(f"{{task.completed:,}} of {{task.total:,}} {unit}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            refresh_per_second=2,
            speed_estimate_period=3600.0,
            disable=not (total and console.is_terminal),
        )
        self._whole = self._bars.add_task(label, total=total, completed=done)
        several = parts if len(parts) > 1 else {}
        self._parts = {name: self._bars.add_task(name, total=n) for name, n in several.items()}
        self._start = self._last_line = monotonic()
        self._stopped_at: float | None = None

    def __enter__(self) -> Self:
        self._start = self._last_line = monotonic()
        self._bars.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped_at = monotonic()
        self._bars.stop()

    @property
    def seconds(self) -> float:
        """Time since it was entered, or until it was left [s]."""
        return (self._stopped_at or monotonic()) - self._start

    def reach(self, done: int, note: str = "", parts: Mapping[str, int] = _NOTHING) -> None:
        """Show that so much is done.

        Args:
            note: what plain lines say besides.
            parts: how much is done of each part.
        """
        self._note = note
        self._bars.update(self._whole, completed=done)
        for name, task in self._parts.items():
            self._bars.update(task, completed=parts.get(name, 0))
        if self._bars.disable and monotonic() - self._last_line >= LINE_EVERY:
            self.say()

    def say(self, what: str = "") -> None:
        """Print a line: how much is done, and `what`."""
        self._last_line = monotonic()
        whole, *parts = self._bars.tasks
        count = f"{whole.completed:,} of {whole.total:,} {self._unit}"
        each = [f"{part.description} {part.completed:,} of {part.total:,}" for part in parts]
        told = [count, *each, self._note, f"{clock(self.seconds)} so far"]
        gained = whole.completed - self._first
        # A training ends with a whole round, so that more may be done than was to do.
        if gained and whole.remaining and whole.remaining > 0:
            told.append(f"{clock(self.seconds * whole.remaining / gained)} left")
        line = f"{whole.description}: {', '.join(filter(None, [*told, what]))}"
        self._bars.console.print(line, soft_wrap=True, markup=False)


def clock(seconds: float) -> str:
    """Return a time as h:mm:ss, or m:ss below an hour."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
