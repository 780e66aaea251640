"""Progress of long work: a bar at a terminal or in a notebook, a sparse line elsewhere."""

from __future__ import annotations

import sys
from time import monotonic
from typing import Any, Self

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
        self._cell_bar = _bar_of_a_notebook(label, total, unit, done)

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()
        if self._cell_bar is not None:
            self._cell_bar.close()

    def extend(self, total: int) -> None:
        """Show that there is so much to do in all."""
        self._bar.update(self._task, total=total)
        if self._cell_bar is not None:
            self._cell_bar.reset(total)

    def reach(self, done: int, note: str = "") -> None:
        """Show that so much is done.

        Args:
            note: what plain lines say besides.
        """
        self._bar.update(self._task, completed=done)
        if self._cell_bar is not None:
            self._cell_bar.update(done - self._cell_bar.n)
        elif self._bar.disable and monotonic() - self._last_line >= LINE_EVERY:
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


def _bar_of_a_notebook(label: str, total: int, unit: str, done: int) -> Any:
    """Return a bar of tqdm, which notebooks draw in the cell; None: this is no notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if type(shell).__name__ != "ZMQInteractiveShell":
        return None
    try:
        from tqdm.auto import tqdm
    except ModuleNotFoundError:
        return None
    return tqdm(desc=label, total=total, unit=f" {unit}", initial=done)


def clock(seconds: float) -> str:
    """Return a time as h:mm:ss, or m:ss below an hour."""
    minutes, seconds_left = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours}:{minutes:02d}:{seconds_left:02d}"
    return f"{minutes}:{seconds_left:02d}"
