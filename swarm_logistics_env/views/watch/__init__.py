"""Live runs in the browser, with failures and changes by hand, and films of runs."""

from .session import Session

__all__ = ["Session"]
