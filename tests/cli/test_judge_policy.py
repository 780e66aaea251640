"""`judge POLICY`: the score card of a policy, as a command."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.cli import app
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.presets import PRESETS

OWN = """
import numpy as np

class Mine:
    def reset(self, n_robots, seed):
        self.n_robots = n_robots

    def act(self, observations):
        commands = np.zeros((self.n_robots, 4))
        commands[:, 0] = 1.0
        return commands

class Failing(Mine):
    def act(self, observations):
        raise RuntimeError("no more")

class NoAct:
    def reset(self, n_robots, seed): ...
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    Path("judged_policy.py").write_text(OWN)
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere_at_all:Mine"], "No module named 'nowhere_at_all': should lie in this folder"),
        (["judged_policy:NoAct"], "is no policy: it should have the methods reset and act"),
        (["judged_policy:Nine"], "should name its class, 'judged_policy:Mine'"),
        (["judged_policy.py"], "should name its class, 'judged_policy:Mine'"),
        (["homng"], "did you mean 'homing'?"),
        (["model.zip"], "executes the code"),
        (["homing", "--column", "N=robots"], "--column is for a file of trials"),
        (["trials.csv"], "cannot read trials.csv"),
        (["trials.xlsx"], "cannot read trials.xlsx"),
    ],
)
def test_what_cannot_be_judged_is_told_before_anything_is_written(
    arguments: list[str], words: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert app.run(["judge", *arguments]) == 2
    assert words in capsys.readouterr().err
    assert [path.name for path in folder.iterdir() if path.name != "__pycache__"] == [
        "judged_policy.py"
    ]


def test_a_policy_gets_a_card_and_the_same_command_plays_nothing_twice(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    short = PRESETS["scorecard"].replace(seeds=3, scenario={"duration": 20.0, "restock": True})
    monkeypatch.setitem(PRESETS, "scorecard", short)
    # The table as people at a terminal do not see it: Markdown.
    assert app.run(["judge", "homing", "--processes", "1"]) == 0
    printed = capsys.readouterr().out
    out = Path("results/scorecards/homing")
    study = Study.stored(out)
    cells = study.performance()
    p = cells[cells["factor"] == "none"]["mean"].iloc[0]
    assert f"| P | N = 25, no fault | {p:.1f} [" in printed
    for name in ("S, N 10 -> 25", "S, N 25 -> 50", "R, m = 2", "FT, m = 2", "A", "fault budget"):
        assert f"| {name} | " in printed
    assert "Their P: " in printed
    assert "homing" not in printed.split("Their P: ")[1].splitlines()[0]  # not ranked by itself
    assert printed.splitlines()[-1].startswith("57 runs played in ")
    assert (out / "report.md").is_file()

    assert app.run(["judge", "homing", "--processes", "1"]) == 0
    assert "0 runs played" in capsys.readouterr().out.splitlines()[-1]


def test_a_policy_of_ones_own_is_judged_where_it_lies(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    short = PRESETS["scorecard"].replace(seeds=2, scenario={"duration": 1.0, "restock": True})
    monkeypatch.setitem(PRESETS, "scorecard", short)
    assert app.run(["judge", "judged_policy:Mine", "--processes", "1", "--out", "card"]) == 0
    printed = capsys.readouterr().out
    # Nobody delivers in a second: there is no ratio, and no rank by one.
    assert "| P | N = 25, no fault | 0.0" in printed
    assert "| A | delivery_width 2 -> 1 m | – | ! blocked | – |" in printed
    assert Path("card", "report.md").is_file()


def test_a_policy_that_fails_in_every_run_gets_a_card_without_numbers(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    short = PRESETS["scorecard"].replace(seeds=1, scenario={"duration": 1.0, "restock": True})
    monkeypatch.setitem(PRESETS, "scorecard", short)
    assert app.run(["judge", "judged_policy:Failing", "--processes", "1", "--out", "card"]) == 1
    printed = capsys.readouterr().out
    assert "| P | N = 25, no fault | – |  | – |" in printed
    assert "19 failed, the first with RuntimeError: no more" in printed.splitlines()[-1]
