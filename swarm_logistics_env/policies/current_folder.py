"""Modules of the folder in which a command runs: found where somebody named them, else never.

A command may run in a folder of somebody else's files. On `sys.path`, that folder would give a file
of its own for each optional module that a library looks for and does not have.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import FrameType, ModuleType


class CurrentFolder(MetaPathFinder):
    """Finds a module of the current folder that was named, and what such a module imports.

    Attributes:
        named: modules of the top level that may be found, whoever imports them.
        found: those that were: they find their neighbours, also later, while a policy decides.
        is_open: whether everything is found.
    """

    def __init__(self) -> None:
        self.named: set[str] = set()
        self.found: set[str] = set()
        self.is_open = False

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where the module is in this folder; None: it is not, or nobody named it."""
        if path is not None:  # a part of a package, which knows where its parts are
            return None
        if not (self.is_open or name in self.named or _importer() in self.found):
            return None
        spec = PathFinder.find_spec(name, [""])
        if spec is not None:
            self.found.add(name)
        return spec


def _importer() -> str:
    """Return the top-level module whose code imports now."""
    frame: FrameType | None = sys._getframe(2)  # what asks `find_spec`
    module = ""
    while frame is not None:
        module = str(frame.f_globals.get("__name__")).partition(".")[0]
        if module not in ("importlib", "_frozen_importlib"):
            break
        frame = frame.f_back
    return module


_FOLDER = CurrentFolder()


def look_here(named: Iterable[str] = ()) -> None:
    """Let modules that are named be found in the current folder, after all installed ones.

    A command does so, and the workers that it starts; a script has the path that Python gives it.
    """
    _FOLDER.named.update(named)
    if _FOLDER not in sys.meta_path:
        sys.meta_path.append(_FOLDER)


def name_module(module: str) -> None:
    """Let a module be found that somebody named."""
    _FOLDER.named.add(module.partition(".")[0])


def found_here() -> tuple[str, ...] | None:
    """Return what was found, for the `look_here` of a worker; None: nobody looks here."""
    return tuple(sorted(_FOLDER.found)) if _FOLDER in sys.meta_path else None


@contextmanager
def everything_here() -> Iterator[None]:
    """Let everything be found, as a file needs whose code somebody trusts."""
    before, _FOLDER.is_open = _FOLDER.is_open, True
    try:
        yield
    finally:
        _FOLDER.is_open = before
