"""Complaints: all that is wrong with a file, told at once, and the rows that lack a value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from swarm_logistics_env.spi.inputs import IndicatorError

from .table import CellError


class Complaints:
    """What is wrong with a file, a line each.

    Attributes:
        missing: rows that lack a value, by the name of the column.
        suspected: what a column may be whose name is nearly a name of it, by its own name.
        columns: names of the columns of which a cell is complained about.
    """

    def __init__(self) -> None:
        self.missing: Mapping[str, Sequence[int]] = {}
        self.suspected: dict[str, str] = {}
        self.columns: set[str] = set()
        self._lines: dict[str, None] = {}

    def add(self, error: IndicatorError) -> None:
        """Note what is wrong; of a missing value, too, how to leave such rows out."""
        text = str(error)
        if isinstance(error, CellError):
            self.columns.add(error.column)
        if isinstance(error, CellError) and error.row in self.missing.get(error.column, ()):
            n_rows = len({row for rows in self.missing.values() for row in rows})
            lack = "1 row that lacks" if n_rows == 1 else f"{n_rows} rows that lack"
            text += f"; --skip-missing leaves out {lack} a value: {self.counts}"
        self._lines[text] = None

    @property
    def counts(self) -> str:
        """How many values each column lacks, in words."""
        return ", ".join(f"{len(rows)} in {name!r}" for name, rows in self.missing.items())

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Note what is raised within."""
        try:
            yield
        except IndicatorError as error:
            self.add(error)

    def raise_all(self) -> None:
        """Raise what is noted, if anything is.

        Raises:
            IndicatorError: with a line for each.
        """
        if self._lines:
            error = IndicatorError("\n".join(self._lines))
            error.lines = (*self._lines,)
            raise error
