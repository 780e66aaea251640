from __future__ import annotations

import io

import pytest
from rich.console import Console

from swarm_logistics_env import progress_bar
from swarm_logistics_env.progress_bar import ProgressBar, clock

TWO = {"swarm-dt": 4, "central": 4}


def shown(done: dict[str, int], parts: dict[str, int], *, terminal: bool, what: str = "") -> str:
    told = io.StringIO()
    console = Console(file=told, force_terminal=terminal, width=120, highlight=False)
    with ProgressBar("mine", sum(parts.values()), "runs", parts=parts, console=console) as progress:
        progress.reach(sum(done.values()), "1 failed", done)
        if what:
            progress.say(what)
    return told.getvalue()


def test_lines_tell_each_part_and_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    (line,) = shown({"a": 1}, {"a": 2_000_000}, terminal=False, what="loss [0.5]").splitlines()
    assert line.startswith("mine: 1 of 2,000,000 runs, ")
    assert line.endswith(", loss [0.5]")  # alone, as lines are sparse
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    (line,) = shown({"swarm-dt": 3, "central": 2}, TWO, terminal=False).splitlines()
    assert line.startswith("mine: 5 of 8 runs, swarm-dt 3 of 4, central 2 of 4, 1 failed, ")
    assert line.endswith(", 0:00 so far, 0:00 left")
    # A training ends with a whole round of steps.
    assert "left" not in shown({"central": 5}, {"central": 4}, terminal=False)


def test_bars_of_the_whole_and_of_each_part() -> None:
    text = shown(TWO, TWO, terminal=True)
    for name, count in (("mine", "8 of 8"), ("swarm-dt", "4 of 4"), ("central", "4 of 4")):
        assert any(name in line and count in line for line in text.splitlines())
    assert shown({}, {}, terminal=True) == ""  # nothing to do
    told = io.StringIO()  # what was done before is no part of the pace
    with ProgressBar("mine", 100, "rounds", done=99, console=Console(file=told)) as progress:
        progress.say()
    assert told.getvalue() == "mine: 99 of 100 rounds, 0:00 so far\n"
    assert [clock(seconds) for seconds in (4.6, 245, 3723)] == ["0:05", "4:05", "1:02:03"]
