"""Studies: from a specification to runs, a store, verdicts and a report."""

from .study import Study

__all__ = ["Study"]
