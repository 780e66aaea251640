"""What a training or a search tells while it runs: a live table at a terminal, lines elsewhere."""

from __future__ import annotations

from collections.abc import Mapping

from rich.console import Console, Group, RenderableType
from rich.table import Table

from swarm_logistics_env.progress_bar import ProgressBar

Measured = Mapping[str, float]


class LiveTable(ProgressBar):
    """Shows on standard error how far a training is, and what it reached, while it is entered.

    Args:
        label: what is done.
        total: how much there is to do, in `unit`.
        unit: in words.
        done: of it before now.
        about: in what the measures were taken, for the corner of the table.
        references: name -> measures of what stands beside it.
        before: (done, measures) of what was measured before now, in order.
        console: the console to write to; None means standard error.
    """

    def __init__(
        self,
        label: str,
        total: int,
        unit: str,
        *,
        done: int = 0,
        about: str = "",
        references: Mapping[str, Measured] | None = None,
        before: list[tuple[int, Measured]] | None = None,
        console: Console | None = None,
    ) -> None:
        super().__init__(label, total, unit, done=done, console=console)
        self._about, self._references = about, dict(references or {})
        self._latest: tuple[int, Measured] | None = None
        self._best: tuple[int, Measured] | None = None
        for at, measures in before or []:
            self._keep(at, measures)

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
        self.say(", ".join(told))

    def _keep(self, at: int, measures: Measured) -> None:
        self._latest = at, measures
        first = next(iter(measures))
        if self._best is None or measures[first] > self._best[1][first]:
            self._best = self._latest

    def __rich__(self) -> RenderableType:
        """Return the table as it is now; it takes 80 columns."""
        bar = super().__rich__()
        if self._latest and self._best:
            return Group(bar, self._table(self._latest, self._best))
        return bar

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
