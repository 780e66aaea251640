"""What a study asks, plays and answers: tasks, questions, runs, trials, verdicts, reports.

`Study` joins them, in `studies.py`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from swarm_logistics_env.study.studies import Study
    from swarm_logistics_env.study.trials import Trial, Trials, read_trials

__all__ = ["Study", "Trial", "Trials", "read_trials"]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # Imported when first asked for: who reads trials pays for no report.
    module = "studies" if name == "Study" else "trials"
    return getattr(importlib.import_module(f"{__name__}.{module}"), name)
