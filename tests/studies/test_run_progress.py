from __future__ import annotations

import io

import pytest
from rich.console import Console

from swarm_logistics_env.studies import Study, run_progress
from swarm_logistics_env.studies.run_progress import Progress, clock
from swarm_logistics_env.studies.runs import Run
from swarm_logistics_env.tasks.task import Outcome


def runs(*policies: str) -> list[Run]:
    study = Study(policies=policies, seeds=2, sizes=[{"values": [2, 3]}])
    return list(study.plan().runs())


def shown(played: list[Run], of: list[Run], *, terminal: bool) -> str:
    told = io.StringIO()
    console = Console(file=told, force_terminal=terminal, width=120, highlight=False)
    with Progress(of, "mine", console) as shows:
        for run in played:
            shows.advance(run, Outcome(run.key, error="Traceback" if run.seed else None))
    assert shows.done.total() == len(played)
    return told.getvalue()


def test_lines_tell_each_policy_and_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_progress, "LINE_EVERY", 0.0)
    all_runs = runs("swarm-dt", "central")
    *_, line = shown(all_runs[:5], all_runs, terminal=False).splitlines()
    assert line.startswith("mine: 5 of 8 runs (swarm-dt 3 of 4, central 2 of 4), 1 failed, ")
    assert "runs/s, 0:00 left" in line
    *_, line = shown(runs("central"), runs("central"), terminal=False).splitlines()
    assert line.startswith("mine: 4 of 4 runs, 2 failed, ")
    assert "left" not in line


def test_bars_of_the_study_and_of_each_policy() -> None:
    all_runs = runs("swarm-dt", "central")
    text = shown(all_runs, all_runs, terminal=True)
    for name, count in (("mine", "8/8"), ("swarm-dt", "4/4"), ("central", "4/4")):
        assert any(name in line and count in line for line in text.splitlines())
    assert "swarm-dt" not in shown(runs("swarm-dt"), runs("swarm-dt"), terminal=True)


def test_nothing_to_play_shows_nothing() -> None:
    assert shown([], [], terminal=True) == ""


@pytest.mark.parametrize(("seconds", "text"), [(4.6, "0:05"), (245, "4:05"), (3723, "1:02:03")])
def test_clock(seconds: float, text: str) -> None:
    assert clock(seconds) == text
