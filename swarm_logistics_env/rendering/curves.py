"""Deliveries and failures of a run over time; without pygame, for the browser view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .palette import MARKS


@dataclass(frozen=True)
class Curve:
    """Deliveries of one run.

    Attributes:
        name: the name of the run.
        times: the times of its deliveries [s], ascending.
        until: the time that the run has reached [s].
        style: an index of `palette.RUNS`; runs differ by thickness and lightness as well.
    """

    name: str
    times: Sequence[float]
    until: float
    style: int


@dataclass(frozen=True)
class Event:
    """A robot that failed, or was repaired: a mark on the time axis."""

    time: float  # [s]
    robot: int
    mode: str | None  # None if it was repaired

    @property
    def label(self) -> str:
        """The text of the mark."""
        return "ok" if self.mode is None else MARKS.get(self.mode, self.mode)
