from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest
from rich.console import Console

from swarm_logistics_env.core import progress_bar
from swarm_logistics_env.core.progress_bar import ProgressBar, clock

Captured = pytest.CaptureFixture[str]


def shown(captured: Captured, done: int, total: int, what: str = "") -> str:
    with ProgressBar("mine", total, "runs") as progress:
        progress.reach(done, "1 failed")
        if what:
            progress.say(what)
    return captured.readouterr().err


def test_lines_tell_what_is_done_and_what_is_left(
    capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Console, "is_terminal", False)
    monkeypatch.setattr("rich.console.monotonic", lambda: 0.0)
    (line,) = shown(capsys, 1, 2_000_000, "loss [0.5]").splitlines()
    assert line.startswith("mine: 1 of 2,000,000 runs, ")
    assert line.endswith(", loss [0.5]")  # alone, as lines are sparse
    with ProgressBar("mine", 100, "rounds", done=99) as progress:
        progress.say()  # what was done before is no part of the pace
    assert capsys.readouterr().err == "mine: 99 of 100 rounds, 0:00 so far\n"
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    (line,) = shown(capsys, 5, 8).splitlines()
    assert line == "mine: 5 of 8 runs, 0:00 so far, 0:00 left, 1 failed"
    # A training ends with a whole round of steps.
    assert "left" not in shown(capsys, 5, 4)
    assert [clock(seconds) for seconds in (4.6, 245, 3723)] == ["0:05", "4:05", "1:02:03"]


def test_the_time_that_is_left_is_in_proportion_to_what_was_done_since_the_beginning(
    capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Console, "is_terminal", False)
    now = [0.0, 0.0]
    monkeypatch.setattr("rich.console.monotonic", lambda: now[0])
    monkeypatch.setattr(progress_bar, "monotonic", lambda: now[1])
    with ProgressBar("mine", 8, "runs", done=2) as progress:
        for elapsed, done in ((29.9, 3), (60.0, 6), (89.9, 7), (90.1, 7)):
            now[:] = elapsed, elapsed
            progress.reach(done, f"{done} finished")
    assert capsys.readouterr().err.splitlines() == [
        "mine: 6 of 8 runs, 1:00 so far, 0:30 left, 6 finished",
        "mine: 7 of 8 runs, 1:30 so far, 0:18 left, 7 finished",
    ]


def test_a_bar_tells_what_is_done(capsys: Captured, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Console, "is_terminal", True)
    monkeypatch.setenv("COLUMNS", "120")
    text = shown(capsys, 8, 8)
    assert any("mine" in line and "8 of 8 runs" in line for line in text.splitlines())
    assert shown(capsys, 0, 0) == ""  # nothing to do


def test_in_a_notebook_a_cell_shows_the_bar(
    capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("tqdm")
    shell = type("ZMQInteractiveShell", (), {})
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=shell))
    with ProgressBar("mine", 4, "runs", done=1) as progress:
        progress.reach(2)
        progress.extend(8)
        progress.reach(5)
        progress.reach(7)
    _, first, *_, last = capsys.readouterr().err.split("\r")
    assert first.startswith("mine:  25%")
    assert " 1/4 [" in first
    assert " 7/8 [" in last
    assert last.endswith("\n")  # it is closed
