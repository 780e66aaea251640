"""Progress of long work, of a study or a training: a bar at a terminal, a sparse line elsewhere."""

from __future__ import annotations

from time import monotonic
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar as Bar
from rich.table import Table
from rich.text import Text

LINE_EVERY = 30.0  # seconds between plain lines


class ProgressBar:
    """Shows on standard error how much is done, while it is entered.

    Args:
        label: what is done.
        total: how much there is to do, in `unit`.
        unit: in words, e.g. "runs".
        done: how much of it was done before now.
        console: the console to write to; None means standard error.
    """

    def __init__(
        self,
        label: str,
        total: int,
        unit: str,
        *,
        done: int = 0,
        console: Console | None = None,
    ) -> None:
        self._label, self._total, self._unit = label, total, unit
        self._first = self._done = done
        self._note = ""
        self._console = console or Console(stderr=True, highlight=False)
        self._live: Live | None = None
        self._start = self._last_line = monotonic()
        self._stopped_at: float | None = None

    def __enter__(self) -> Self:
        self._start = self._last_line = monotonic()
        if self._total and self._console.is_terminal:
            # It draws itself anew twice a second, also while one piece of the work takes long.
            self._live = Live(self, console=self._console, refresh_per_second=2)
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped_at = monotonic()
        if self._live:
            self._live.stop()

    @property
    def seconds(self) -> float:
        """Time since it was entered, or until it was left [s]."""
        return (self._stopped_at or monotonic()) - self._start

    def reach(self, done: int, note: str = "") -> None:
        """Show that so much is done.

        Args:
            note: what plain lines say besides.
        """
        self._done, self._note = done, note
        if not self._live and monotonic() - self._last_line >= LINE_EVERY:
            self.say()

    def say(self, what: str = "") -> None:
        """Print a line: how much is done, and `what`."""
        self._last_line = monotonic()
        told = (self._reached(), self._note, self._pace(), what)
        line = f"{self._label}: {', '.join(part for part in told if part)}"
        self._console.print(line, soft_wrap=True, markup=False)

    def __rich__(self) -> RenderableType:
        """Return the bar as it is now; it takes 80 columns."""
        shown = Table.grid(padding=(0, 1))
        bar = Bar(total=self._total, completed=self._done, width=20)
        shown.add_row(Text(self._label), bar, self._reached())
        return Group(shown, f"{self._pace()}, {clock(self.seconds)} so far")

    def _reached(self) -> str:
        return f"{self._done:,} of {self._total:,} {self._unit}"

    def _pace(self) -> str:
        rate = (self._done - self._first) / max(self.seconds, 1e-9)
        if not rate:
            return "just begun"
        shown = f"{rate:,.2f}" if rate < 10 else f"{rate:,.0f}"
        left = self._total - self._done
        # A training ends with a whole round, so that more may be done than was to do.
        until_end = f", {clock(left / rate)} left" if left > 0 else ""
        return f"{shown} {self._unit}/s{until_end}"


def clock(seconds: float) -> str:
    """Return a time as h:mm:ss, or m:ss below an hour."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"
