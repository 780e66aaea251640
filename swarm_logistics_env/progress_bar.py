"""Progress of long work, of a study or a training: a bar at a terminal, a sparse line elsewhere."""

from __future__ import annotations

from time import monotonic
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

LINE_EVERY = 30.0  # seconds between plain lines


class ProgressBar:
    """Shows on standard error how much is done, while it is entered.

    Args:
        label: what is done.
        total: how much there is to do, in `unit`.
        unit: in words, e.g. "runs".
        done: how much of it was done before now.
    """

    def __init__(self, label: str, total: int, unit: str, *, done: int = 0) -> None:
        console = Console(stderr=True, highlight=False)
        self._unit = unit
        self._first = done
        # It draws itself anew twice a second, also while one piece of the work takes long.
        self._bar = Progress(
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
        self._task = self._bar.add_task(label, total=total, completed=done)
        self._last_line = monotonic()

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def extend(self, total: int) -> None:
        """Show that there is so much to do in all."""
        self._bar.update(self._task, total=total)

    def reach(self, done: int, note: str = "") -> None:
        """Show that so much is done.

        Args:
            note: what plain lines say besides.
        """
        self._bar.update(self._task, completed=done)
        if self._bar.disable and monotonic() - self._last_line >= LINE_EVERY:
            self.say(note)

    def say(self, note: str = "") -> None:
        """Print a line: how much is done, and the note."""
        self._last_line = monotonic()
        (task,) = self._bar.tasks
        seconds = task.elapsed or 0.0
        count = f"{task.completed:,} of {task.total:,} {self._unit}"
        parts = [count, f"{clock(seconds)} so far"]
        gained = task.completed - self._first
        # A training ends with a whole round, so that more may be done than was to do.
        if gained and task.remaining and task.remaining > 0:
            parts.append(f"{clock(seconds * task.remaining / gained)} left")
        line = f"{task.description}: {', '.join(filter(None, [*parts, note]))}"
        self._bar.console.print(line, soft_wrap=True, markup=False)


def clock(seconds: float) -> str:
    """Return a time as h:mm:ss, or m:ss below an hour."""
    minutes, seconds_left = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours}:{minutes:02d}:{seconds_left:02d}"
    return f"{minutes}:{seconds_left:02d}"
