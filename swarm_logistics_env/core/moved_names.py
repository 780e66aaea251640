"""Former names of modules and what they hold: each goes on working, with a warning.

A name in the table is of a module with all that lies under it, or of one thing in a module.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import warnings
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import CodeType, ModuleType
from typing import Any

PACKAGE = __name__.partition(".")[0]
# Former name -> name, both without the package's.
MOVED = {
    "attack": "study.attack",
    "bodies": "world.bodies",
    "cli": "views.cli",
    "demonstrations": "policies.demonstrations",
    "episode": "policies.episode",
    "errors": "core.errors",
    "floor": "world.floor",
    "motion": "world.motion",
    "observations": "world.observations",
    "questions": "study.questions",
    "records": "core.records",
    "rendering": "world.rendering",
    "report": "study.report",
    "runs": "study.runs",
    "scenario": "world.scenario",
    "spi.Trial": "study.Trial",
    "spi.Trials": "study.Trials",
    "spi.read_trials": "study.read_trials",
    "spi.trials": "study.trials",
    "streams": "core.streams",
    "studies": "study.studies",
    "swarm_logistics_v0": "adapters.swarm_logistics_v0",
    "tasks": "study.tasks",
    "testing": "policies.testing",
    "verdicts": "study.verdicts",
    "warehouse": "world.warehouse",
    "watch": "views.watch",
}


def name_today(name: str) -> str | None:
    """Return the full name of today of what had a full name before; None: it never moved."""
    package, _, rest = name.partition(".")
    parts = rest.split(".")
    if package != PACKAGE:
        return None
    for n_parts in range(len(parts), 0, -1):
        moved = MOVED.get(".".join(parts[:n_parts]))
        if moved is not None:
            return ".".join([PACKAGE, moved, *parts[n_parts:]])
    return None


def moved_attribute(module: str, name: str) -> Any:
    """Return what a module once held under a name, with a warning.

    Raises:
        AttributeError: it never did. No other error: `hasattr` asks about any name.
    """
    former_name = f"{module}.{name}"
    today = name_today(former_name)
    if today is None:
        raise AttributeError(f"module {module!r} has no attribute {name!r}")
    warnings.warn(f"{former_name} is now {today}", DeprecationWarning, stacklevel=3)
    if importlib.util.find_spec(today) is not None:
        return importlib.import_module(today)
    holder, _, attribute = today.rpartition(".")
    return getattr(importlib.import_module(holder), attribute)


def install() -> None:
    """Let Python's imports find modules under their former names."""
    if not any(isinstance(finder, _FormerNames) for finder in sys.meta_path):
        # First: a folder that moved has its path, by which its files would be loaded twice.
        sys.meta_path.insert(0, _FormerNames())


class _FormerNames(MetaPathFinder):
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        today = name_today(fullname)
        spec = None if today is None else importlib.util.find_spec(today)
        if spec is None:
            return None
        is_package = spec.submodule_search_locations is not None
        return ModuleSpec(fullname, _ModuleOfToday(spec), is_package=is_package)


class _ModuleOfToday(Loader):
    """Gives the module of today, not a second one."""

    def __init__(self, spec: ModuleSpec) -> None:
        self._spec = spec

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        text = f"{spec.name} is now {self._spec.name}"
        warnings.warn(text, DeprecationWarning, stacklevel=2)  # frames of importlib do not count
        return importlib.import_module(self._spec.name)

    def exec_module(self, module: ModuleType) -> None:
        module.__spec__ = self._spec  # the import wrote that of the former name there

    def get_code(self, fullname: str) -> CodeType | None:
        """Return the code of the module, as `python -m` runs it."""
        loader: Any = self._spec.loader
        return loader.get_code(self._spec.name)  # type: ignore[no-any-return]
