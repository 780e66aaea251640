"""What a study asks, plays and answers: tasks, questions, runs, trials, verdicts, reports.

`Study` is the door: `studies.py` joins the rooms.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swarm_logistics_env.study.studies import Study

__all__ = ["Study"]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # A policy that reads trials or a task pays for no report.
    return getattr(importlib.import_module(f"{__name__}.studies"), name)
