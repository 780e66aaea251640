"""Which versions a run was made with."""

from __future__ import annotations

import platform
from importlib.metadata import version


def versions(*distributions: str) -> str:
    """Return Python's version and those of these installed distributions, in one line."""
    installed = [f"{name} {version(name)}" for name in distributions]
    return ", ".join([f"Python {platform.python_version()}", *installed])
