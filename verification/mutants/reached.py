"""Which tests run each line of the package: recorded once for a tree, by coverage's contexts.

A line of a kernel is in no record, as compiled code is not traced, nor is one that runs where a
module is imported, or in another process.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree import ElementTree

from coverage import CoverageData

from .mutation import PACKAGE

ALL = "MEASURE_ALL_TESTS"  # environment variable: of all tests, not only those that are measured
_DATA = "reached.coverage"
_TIMES = "reached.xml"
_DIGEST = "reached.digest"


class Reached:
    """Which tests run the lines of a copy of the tree, the quickest first.

    Args:
        copy: of the tree, in which a record is made if there is none of these files.
        folder: where the record is kept.
        n_workers: processes that make it.
    """

    def __init__(self, copy: Path, folder: Path, n_workers: int) -> None:
        paths = (path for name in (PACKAGE, "tests") for path in (copy / name).rglob("*.py"))
        digest = digest_of(copy, paths)
        note = folder / _DIGEST
        if not note.exists() or note.read_text(encoding="utf-8") != digest:
            note.unlink(missing_ok=True)
            _record(copy, folder, n_workers)
            note.write_text(digest, encoding="utf-8")
        self._data = CoverageData(str(folder / _DATA))
        self._data.read()
        # The copy of the record may have another name than this one.
        self._files = {
            path.rpartition(f"/{PACKAGE}/")[2]: path for path in self._data.measured_files()
        }
        self._seconds = _seconds(folder / _TIMES)
        self._by_file: dict[str, dict[int, list[str]]] = {}

    def of(self, file: str, lines: Iterable[int], seconds: float) -> list[str]:
        """Return tests, by their names for pytest, that run one of the lines of a file.

        Args:
            file: in the package.
            lines: their numbers.
            seconds: that these tests take together at most, but for the first.
        """
        names = self._names(file, lines)
        tests = sorted(names & self._seconds.keys(), key=lambda name: (self._seconds[name], name))
        chosen: list[str] = []
        for test in tests:
            seconds -= self._seconds[test]
            if chosen and seconds < 0.0:
                break
            chosen.append(test)
        return chosen

    def files_of(self, file: str, lines: Iterable[int]) -> set[str]:
        """Return the files of the tests that run one of the lines of a file in the package.

        Empty: none runs one, or not in a test's process, or where a module is imported, too.
        """
        files = {name.partition("::")[0] for name in self._names(file, lines)}
        return set() if "" in files else files

    def quickest_first(self, tests: Iterable[str]) -> list[str]:
        """Return tests, or files of them, by the time that they take."""

        def seconds(test: str) -> float:
            of_file = f"{test}::"
            times = self._seconds.items()
            return sum(time for name, time in times if name == test or name.startswith(of_file))

        return sorted(tests, key=seconds)

    def _names(self, file: str, lines: Iterable[int]) -> set[str]:
        """Return the names of tests that run one of the lines; "" where a module's import does."""
        contexts = self._contexts(file)
        return {context.rpartition("|")[0] for line in lines for context in contexts.get(line, ())}

    def _contexts(self, file: str) -> Mapping[int, list[str]]:
        if file not in self._by_file:
            path = self._files.get(file)
            self._by_file[file] = self._data.contexts_by_lineno(path) if path else {}
        return self._by_file[file]


def _record(copy: Path, folder: Path, n_workers: int) -> None:
    """Run the gate's tests in a copy, and keep which lines each runs and how long it takes.

    Raises:
        RuntimeError: they could not be run; tests that fail are left out, see `_seconds`.
    """
    print("recording which tests run which lines: some minutes", flush=True)
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(copy.parent / "numba"),
        "PYTHONPATH": str(copy),
        "COVERAGE_FILE": str(folder / _DATA),
        ALL: "1",
    }
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--no-header", "--tb=short", "-m", "not daily",
         f"--numprocesses={n_workers}", "--dist=loadgroup", f"--junitxml={folder / _TIMES}",
         "--cov", "--cov-context=test", "--cov-report="],
        cwd=copy, env=environment, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    if done.returncode not in (0, 1):
        raise RuntimeError(f"pytest ended with {done.returncode}")


def _seconds(path: Path) -> dict[str, float]:
    """Return how long each test took that passed [s], by its name for pytest."""
    cases = ElementTree.parse(path).iter("testcase")
    return {
        f"{case.attrib['classname'].replace('.', '/')}.py::{case.attrib['name']}": float(
            case.attrib["time"]
        )
        for case in cases
        if case.find("failure") is None and case.find("error") is None
    }


def digest_of(root: Path, paths: Iterable[Path]) -> str:
    """Return the digest of files below a root, their names among it."""
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(str(path.relative_to(root)).encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()
