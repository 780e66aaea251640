"""Modules of the folder in which a command runs: those that somebody named, no others."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import FrameType, ModuleType


class CurrentFolder(MetaPathFinder):
    """Finds modules of the folder in which a command runs: those that somebody named, no others.

    A command may run in a folder of somebody else's files. On `sys.path`, that folder would give a
    file of its own for each optional module that a library looks for and does not have.

    Attributes:
        allowed: modules of the top level that may be found, whoever imports them.
        imported: those that were: they find their neighbours, also later, while a policy decides.
        allows_all: whether every module is found.
    """

    def __init__(self) -> None:
        self.allowed: set[str] = set()
        self.imported: set[str] = set()
        self.allows_all = False

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where the module is in this folder; None: it is not, or nobody named it."""
        if path is not None:  # a part of a package, which knows where its parts are
            return None
        if not (self.allows_all or name in self.allowed or _importer() in self.imported):
            return None
        spec = PathFinder.find_spec(name, [""])
        if spec is not None:
            self.imported.add(name)
        return spec


def _importer() -> str:
    """Return the top-level module whose code imports now."""
    frame: FrameType | None = sys._getframe(2)  # the caller of `find_spec`
    module = ""
    while frame is not None:
        module = str(frame.f_globals.get("__name__")).partition(".")[0]
        if module not in ("importlib", "_frozen_importlib"):
            break
        frame = frame.f_back
    return module


_current_folder = CurrentFolder()


def search_current_folder(modules: Iterable[str] = ()) -> None:
    """Let these modules be found in the current folder, after all installed ones.

    A command does so, and the workers that it starts; a script has the path that Python gives it.
    """
    _current_folder.allowed.update(modules)
    if _current_folder not in sys.meta_path:
        sys.meta_path.append(_current_folder)


def allow_import(module: str) -> None:
    """Let a module that somebody named be found in the current folder, if that is searched."""
    _current_folder.allowed.add(module.partition(".")[0])


def current_folder_modules() -> tuple[str, ...] | None:
    """Return the modules that were found, for a worker's `search_current_folder`.

    None: the current folder is not searched.
    """
    if _current_folder not in sys.meta_path:
        return None
    return tuple(sorted(_current_folder.imported))


@contextmanager
def allow_all_imports() -> Iterator[None]:
    """Let everything be found, as a file needs whose code somebody trusts."""
    before = _current_folder.allows_all
    _current_folder.allows_all = True
    try:
        yield
    finally:
        _current_folder.allows_all = before
