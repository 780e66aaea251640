"""Copies of the tree in which mutants are made, and the tests that run there."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from queue import SimpleQueue

from .mutation import PACKAGE, ROOT

COPIES = ROOT / "build" / "mutants"  # kept, with their compiled kernels; one for each worker
_LEFT_OUT = shutil.ignore_patterns("__pycache__", ".*_cache", ".hypothesis")
_LEFT_OUT_AT_TOP = shutil.ignore_patterns(
    ".git", ".venv*", "results", "build", "dist", "site", "*.egg-info"
)
# Those that take the interpreter a minute or more; see KERNELS in the Makefile.
SLOW = "not (fewer_items or diffuses or in_a_crowd or drop_rate or ctrl_c or in_a_run)"
# The name of a test's parameters may hold what stands between the name and the error.
_FAILED = re.compile(r"^(FAILED|ERROR) (?P<test>\S+?(\[.*?\])?)( - |$)", re.MULTILINE)
NO_END = "no end"  # what is said of tests that were stopped, or whose process crashed
NO_IMPORT = "pytest itself"  # what is said where pytest cannot start: a module is not imported


class Copies:
    """Copies of a tree, each lent to one worker at a time."""

    def __init__(self, count: int, root: Path = ROOT, folder: Path = COPIES) -> None:
        self._free: SimpleQueue[Path] = SimpleQueue()
        for name in range(count):
            copy = folder / str(name)
            shutil.rmtree(copy, ignore_errors=True)
            shutil.copytree(root, copy, symlinks=True, ignore=partial(_left_out, root))
            self._free.put(copy)

    @contextmanager
    def borrow(self) -> Iterator[Path]:
        """Lend a copy that nobody uses."""
        copy = self._free.get()
        try:
            yield copy
        finally:
            self._free.put(copy)


def _left_out(root: Path, folder: str, names: list[str]) -> set[str]:
    """Return what of a folder is no part of the tree."""
    left_out = _LEFT_OUT(folder, names)
    return left_out | _LEFT_OUT_AT_TOP(folder, names) if Path(folder) == root else left_out


@contextmanager
def written(file: Path, source: str) -> Iterator[None]:
    """Let a file hold another source for a while."""
    original = file.read_bytes()
    stamp = file.stat()
    file.write_text(source, encoding="utf-8")
    try:
        yield
    finally:
        file.write_bytes(original)
        # Compiled kernels are kept by this time.
        os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))


def run_tests(
    copy: Path,
    tests: Iterable[str],
    *,
    interpreted: bool,
    limit: float,
    kernels: str = "numba",
    options: Sequence[str] = (),
    variables: Mapping[str, str] | None = None,
) -> str:
    """Return the first test that fails in a copy, as pytest names it; empty: none does.

    Args:
        copy: of the tree.
        tests: files and names of tests, as pytest takes them.
        interpreted: whether the interpreter runs the kernels.
        limit: after which the tests are stopped [s].
        kernels: the folder in which compiled kernels are kept, beside the copy.
        options: further ones of pytest.
        variables: further ones of the environment.
    """
    environment = {
        **os.environ,
        **(variables or {}),
        "NUMBA_CACHE_DIR": str(copy.parent / kernels),
        "PYTHONPATH": str(copy),
        # Bytecode is kept: to compile package and tests takes longer than most of the tests.
        "PYTHONDONTWRITEBYTECODE": "",
        "HYPOTHESIS_PROFILE": "mutants",
    }
    plugin: list[str] = []
    if interpreted:
        environment["NUMBA_DISABLE_JIT"] = "1"
        plugin = ["-p", "verification.interpreted", "-k", SLOW]
    running = subprocess.Popen(
        [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "--tb=no", "-p", "no:xdist",
         "-p", "no:cacheprovider", *plugin, *options, *tests],
        cwd=copy, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        start_new_session=True,
    )  # fmt: skip
    try:
        output, _ = running.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        os.killpg(running.pid, signal.SIGKILL)
        running.communicate()
        return NO_END
    if running.returncode == 0:
        return ""
    if running.returncode < 0:
        return NO_END
    failed = _FAILED.search(output)
    if failed:
        return failed["test"]
    # 2 and 3: a module could not be imported; pytest broke. The mutant did it, if it is one.
    if running.returncode in (2, 3) or "ImportError while loading conftest" in output:
        return NO_IMPORT
    raise RuntimeError(f"pytest {' '.join(tests)} ended with {running.returncode}\n{output}")


def type_errors(copy: Path) -> Counter[str]:
    """Return what the type checker says of the package in a copy, without the numbers of lines."""
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-error-summary", "--hide-error-context", PACKAGE],
        cwd=copy, env={**os.environ, "MYPYPATH": "", "PYTHONPATH": ""}, capture_output=True,
        text=True,
    )  # fmt: skip
    if done.returncode not in (0, 1):
        raise RuntimeError(f"mypy ended with {done.returncode}\n{done.stdout}{done.stderr}")
    lines = [line.split(":", 2) for line in done.stdout.splitlines()]
    return Counter(f"{file}:{text}" for file, _, text in lines if "error:" in text)
