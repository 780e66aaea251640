"""What a training or a search tells while it runs: a live table at a terminal, lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from swarm_logistics_env.progress_bar import clock

LINE_EVERY = 30.0  # seconds between plain lines

Measured = Mapping[str, float]


class LiveTable:
    """Shows on standard error how far a training is, and what it reached, while it is entered.

    Args:
        label: what is done.
        total: how much there is to do, in `unit`.
        done: of it before now.
        unit: in words.
        about: in what the measures were taken, for the corner of the table.
        references: name -> measures of what stands beside it.
        before: (done, measures) of what was measured before now, in order.
        console: the console to write to; None means standard error.
    """

    def __init__(
        self,
        label: str,
        total: int,
        done: int = 0,
        *,
        unit: str = "agent-steps",
        about: str = "",
        references: Mapping[str, Measured] | None = None,
        before: list[tuple[int, Measured]] | None = None,
        console: Console | None = None,
    ) -> None:
        self._label, self._total, self._unit, self._about = label, total, unit, about
        self._first = self._done = done
        self._references = dict(references or {})
        self._latest: tuple[int, Measured] | None = None
        self._best: tuple[int, Measured] | None = None
        for at, measures in before or []:
            self._keep(at, measures)
        self._console = console or Console(stderr=True, highlight=False)
        self._live: Live | None = None
        self._start = self._last_line = time.monotonic()
        self._stopped_at: float | None = None

    def __enter__(self) -> Self:
        self._start = self._last_line = time.monotonic()
        if self._console.is_terminal:
            # The table draws itself anew twice a second, also while an evaluation is played.
            self._live = Live(self, console=self._console, refresh_per_second=2)
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped_at = time.monotonic()
        if self._live:
            self._live.stop()

    def reach(self, done: int) -> None:
        """Show that so much is done."""
        self._done = done
        if not self._live and time.monotonic() - self._last_line >= LINE_EVERY:
            self._print_line("")

    def measured(self, measures: Measured) -> None:
        """Show what was measured; the first measure decides what counts as the best."""
        self._keep(self._done, measures)
        if self._live:
            return
        told = []
        for name, value in measures.items():
            others = ", ".join(
                f"{other} {values[name]:.4g}"
                for other, values in self._references.items()
                if name in values
            )
            told.append(f"{name} = {value:.4g}" + (f" ({others})" if others else ""))
        self._print_line(", ".join(told))

    def _keep(self, at: int, measures: Measured) -> None:
        self._latest = at, measures
        first = next(iter(measures))
        if self._best is None or measures[first] > self._best[1][first]:
            self._best = self._latest

    @property
    def _seconds(self) -> float:
        return max((self._stopped_at or time.monotonic()) - self._start, 1e-9)

    def _pace(self) -> str:
        rate = (self._done - self._first) / self._seconds
        shown = f"{rate:,.3g}" if rate < 10 else f"{rate:,.0f}"
        left = (self._total - self._done) / rate if rate else 0.0
        return f"{shown} {self._unit}/s, {clock(left)} left" if rate else "just begun"

    def _print_line(self, what: str) -> None:
        self._last_line = time.monotonic()
        told = f"{self._done:,} of {self._total:,} {self._unit}, {self._pace()}"
        line = f"{self._label}: {told}" + (f": {what}" if what else "")
        self._console.print(line, soft_wrap=True, markup=False)

    def __rich__(self) -> RenderableType:
        """Return the table as it is now; it takes 80 columns."""
        bar = Table.grid(padding=(0, 1))
        bar.add_row(
            Text(self._label, style="bold"),
            ProgressBar(total=self._total, completed=self._done, width=20),
            f"{self._done:,} of {self._total:,} {self._unit}",
        )
        parts: list[RenderableType] = [bar, f"{self._pace()}, {clock(self._seconds)} so far"]
        if self._latest and self._best:
            parts.append(self._table(self._latest, self._best))
        return Group(*parts)

    def _table(self, latest: tuple[int, Measured], best: tuple[int, Measured]) -> Table:
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column(self._about)
        for name in ("latest", "best", *self._references):
            table.add_column(name, justify="right")
        columns = (latest[1], best[1], *self._references.values())
        for name in latest[1]:
            row = (f"{column[name]:.4g}" if name in column else "" for column in columns)
            table.add_row(name, *row)
        table.add_row(self._unit, f"{latest[0]:,}", f"{best[0]:,}")
        return table
