"""The errors of the checks: each raises its own kind of AssertionError."""

from __future__ import annotations


class ConformanceError(AssertionError):
    """An environment does not hold what this package promises of one."""


class DeterminismError(ConformanceError):
    """The same seed gave two trajectories."""


class SpaceError(ConformanceError):
    """An observation or a state that its space does not contain."""


class ConservationError(ConformanceError):
    """An item was lost, doubled or created."""


class OverlapError(ConformanceError):
    """Two robots stand in one place."""


class FaultsError(ConformanceError):
    """A failed robot did what it can no longer do, or nobody failed at all."""
