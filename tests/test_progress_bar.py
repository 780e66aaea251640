from __future__ import annotations

import io

import pytest
from rich.console import Console

from swarm_logistics_env import progress_bar
from swarm_logistics_env.progress_bar import ProgressBar, clock


def shown(done: int, total: int, *, terminal: bool, what: str = "") -> str:
    told = io.StringIO()
    console = Console(file=told, force_terminal=terminal, width=120, highlight=False)
    with ProgressBar("mine", total, "runs", console=console) as progress:
        progress.reach(done, "1 failed")
        if what:
            progress.say(what)
    return told.getvalue()


def test_lines_tell_what_is_done_and_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    (line,) = shown(1, 2_000_000, terminal=False, what="loss [0.5]").splitlines()
    assert line.startswith("mine: 1 of 2,000,000 runs, ")
    assert line.endswith(", loss [0.5]")  # alone, as lines are sparse
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    (line,) = shown(5, 8, terminal=False).splitlines()
    assert line.startswith("mine: 5 of 8 runs, 1 failed, ")
    assert line.endswith(", 1 failed, 0:00 so far, 0:00 left")
    # A training ends with a whole round of steps.
    assert "left" not in shown(5, 4, terminal=False)


def test_a_bar_tells_what_is_done() -> None:
    text = shown(8, 8, terminal=True)
    assert any("mine" in line and "8 of 8 runs" in line for line in text.splitlines())
    assert shown(0, 0, terminal=True) == ""  # nothing to do
    told = io.StringIO()  # what was done before is no part of the pace
    with ProgressBar("mine", 100, "rounds", done=99, console=Console(file=told)) as progress:
        progress.say()
    assert told.getvalue() == "mine: 99 of 100 rounds, 0:00 so far\n"
    assert [clock(seconds) for seconds in (4.6, 245, 3723)] == ["0:05", "4:05", "1:02:03"]
