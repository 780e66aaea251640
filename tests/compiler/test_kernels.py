"""Kernels are compiled once, kept for other processes, and a person hears of it."""

from __future__ import annotations

import errno
import importlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from swarm_logistics_env.compiler import fast_kernels, kernels, numba_fence

# Two signatures of one kernel, so that two processes write one index.
FIRST_CALLS = """
import numpy as np
from swarm_logistics_env.compiler import fast_kernels, kernels, numba_fence
print(kernels.pair_key(np.uint64(1), 2), kernels.pair_key(np.uint64(1), np.int32(2)))
print(sum(sum(each.stats.cache_hits.values()) for each in fast_kernels._all_kernels))
"""
LONG = """
from swarm_logistics_env.compiler import fast_kernels, kernels, numba_fence
fast_kernels._SILENCE = 0.0
kernels.gaussian(1, 2)
"""


def started(script: str, cache: Path, **variables: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), **variables}
    command = [sys.executable, "-c", script]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True)


def finished(process: subprocess.Popen[str]) -> list[str]:
    printed, errors = process.communicate(timeout=600)
    assert process.returncode == 0, errors
    return [*printed.splitlines(), errors]


@pytest.mark.daily
def test_two_processes_that_start_at_once_keep_one_cache(tmp_path: Path) -> None:
    both = [finished(each) for each in [started(FIRST_CALLS, tmp_path) for _ in range(2)]]
    assert both[0][0] == both[1][0]
    third = finished(started(FIRST_CALLS, tmp_path))
    assert third[:2] == [both[0][0], "2"]  # both signatures are loaded


def test_a_kernel_compiles_where_nothing_can_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: object) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    double = kernels.kernel(lambda number: 2.0 * number)
    half = kernels.kernel(lambda number: number / 2.0)
    monkeypatch.setattr(type(double), "enable_caching", refuse)
    fast_kernels._warn_of_no_cache.cache_clear()
    with pytest.warns(UserWarning, match="NUMBA_CACHE_DIR") as caught:
        assert (double(3.0), half(3.0)) == (6.0, 1.5)
    assert len(caught) == 1
    fast_kernels._warn_of_no_cache.cache_clear()


def cut(content: bytes) -> bytes:
    return content[: len(content) // 2]


def flip(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 4]) + content[middle + 1 :]


def checked_files(folder: Path, stamp: str = "sources") -> fast_kernels._CheckedFiles:
    return fast_kernels._CheckedFiles(str(folder), "kernel", stamp)  # type: ignore[no-untyped-call]


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", [bytes, cut, flip])
def test_a_damaged_file_of_code_is_told_of_once_and_written_anew(
    ending: str, damage: Callable[[bytes], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fast_kernels._CheckedFiles, "is_told", False)
    files = checked_files(tmp_path)
    for key in ("floats", "integers"):
        files.save(key, f"code of {key}")
    [file, *_] = sorted(tmp_path.glob(f"*.{ending}"))
    file.write_bytes(b"" if damage is bytes else damage(file.read_bytes()))
    with pytest.warns(UserWarning, match=f"{ending}: compiled code was damaged") as caught:
        assert files.load("floats") is None
    files.save("floats", "code made again")
    file.write_bytes(b"")
    assert files.load("floats") is None
    files.save("floats", "code made again")
    assert files.load("floats") == "code made again"
    assert len(caught) == 1


def test_code_of_a_version_that_had_other_structures_is_compiled_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Gone(str):
        """A structure that a later version has no more."""

    files = checked_files(tmp_path)
    module = sys.modules[__name__]
    Gone.__qualname__ = "Gone"  # so that a pickle finds it in the module
    monkeypatch.setattr(module, "Gone", Gone, raising=False)
    files.save(Gone("floats"), "code")
    monkeypatch.delattr(module, "Gone")
    assert files.load("floats") is None
    files.save("floats", "code made again")
    assert files.load("floats") == "code made again"


@pytest.mark.parametrize("before", ["older sources", "sources"])
def test_an_older_file_is_not_run_where_there_was_room_for_the_index_alone(
    before: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    older, files = checked_files(tmp_path, before), checked_files(tmp_path)
    older.save("floats", "older code")
    next(tmp_path.glob("*.nbi")).unlink()
    monkeypatch.setattr(files, "_save_data", refuse)
    with pytest.raises(OSError, match="No space left"):
        files.save("integers", "code")
    assert files.load("integers") is None


@pytest.mark.daily
def test_a_process_starts_with_damaged_code_and_keeps_what_it_compiles(tmp_path: Path) -> None:
    first = finished(started(FIRST_CALLS, tmp_path))
    file = min(tmp_path.rglob("*pair_key*.nbc"))
    file.write_bytes(flip(file.read_bytes()))
    result, _, errors = finished(started(FIRST_CALLS, tmp_path))
    assert (result, errors.count("was damaged, so it is made again")) == (first[0], 1)
    assert finished(started(FIRST_CALLS, tmp_path)) == [first[0], "2", ""]


def test_a_kernel_compiles_where_the_disk_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    double = kernels.kernel(lambda number: 2.0 * number)
    half = kernels.kernel(lambda number: number / 2.0)
    monkeypatch.setattr(fast_kernels._CheckedFiles, "save", refuse)
    fast_kernels._warn_of_no_cache.cache_clear()
    with pytest.warns(UserWarning, match=r"\(No space left on device\).*NUMBA_CACHE_DIR") as caught:
        assert (double(3.0), half(3.0)) == (6.0, 1.5)
    assert len(caught) == 1
    fast_kernels._warn_of_no_cache.cache_clear()


@pytest.mark.daily
def test_compiling_tells_a_person_once_and_never_from_a_worker(tmp_path: Path) -> None:
    quiet = started(LONG, tmp_path / "worker", **{numba_fence.QUIET: "1"})
    message = finished(started(LONG, tmp_path))[-1]
    assert message == "Compiling, which later runs reuse: up to 15 s of a free core.\n"
    assert finished(started(LONG, tmp_path))[-1] == ""  # loaded
    assert finished(quiet)[-1] == ""


def test_at_a_terminal_a_bar_shows_how_many_kernels_are_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path))
    monkeypatch.delenv(numba_fence.QUIET, raising=False)
    monkeypatch.setattr(fast_kernels, "_SILENCE", 0.0)
    monkeypatch.setattr(fast_kernels._Report, "is_told", False)
    monkeypatch.setattr(fast_kernels._Report, "bar", None)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    for variable, value in {"TERM": "xterm", "COLUMNS": "80"}.items():
        monkeypatch.setenv(variable, value)

    half = kernels.kernel(lambda number: number / 2.0)
    third = kernels.kernel(lambda number: number / 3.0)
    sixth = kernels.kernel(lambda number: third(half(number)))
    assert sixth(3.0) == 0.5
    shown = capsys.readouterr().err
    assert shown.count("up to 15 s of a free core.\n") == 1
    assert "%" in shown
    bar = fast_kernels._Report.bar
    assert bar is not None
    assert not bar.live.is_started
    n_done = sum(bool(kernel.overloads) for kernel in fast_kernels._all_kernels)
    [task] = bar.tasks
    # Of the outer one nothing is told, as it is the last.
    assert (task.completed, task.total) == (n_done - 1, len(fast_kernels._all_kernels))


def test_numbas_functions_of_arrays_are_imported_without_scipys_blas(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    blas = "scipy.linalg.cython_blas"
    imported = []
    monkeypatch.delitem(sys.modules, blas, raising=False)
    monkeypatch.setattr(
        importlib, "import_module", lambda name: imported.append((name, blas in sys.modules))
    )
    fast_kernels._import_without_blas.__wrapped__()
    assert imported == [("numba.np.arraymath", True)]
    assert blas not in sys.modules


def test_what_is_kept_is_used_until_a_file_of_kernels_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = shutil.copytree(fast_kernels._PACKAGE, tmp_path / "package")
    monkeypatch.setattr(fast_kernels, "_PACKAGE", package)
    digest = fast_kernels._digest.__wrapped__  # which keeps no answer
    assert digest() == fast_kernels._digest()
    with_kernels = [file for file in package.rglob("*.py") if "kernel\ndef " in file.read_text()]
    assert with_kernels
    for file in with_kernels:
        before = digest()
        file.write_text(f"{file.read_text()}N_MORE = 1\n")
        assert digest() != before


def test_a_kernel_that_another_one_called_can_be_called_from_python() -> None:
    @kernels.kernel
    def inner(number: float) -> float:
        return number + 1.0

    @kernels.kernel
    def outer(number: float) -> float:
        return 2.0 * inner(number)

    assert [outer(3.0), inner(3.0), outer(4.0), inner(5.0)] == [8.0, 4.0, 10.0, 6.0]
    assert inner(1) == 2.0  # another signature
