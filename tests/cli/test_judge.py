"""`judge`: trials from a file, or a policy, as a command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.cli import app
from swarm_logistics_env.cli.judging import RECORDED
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.presets import PRESETS

LAB = """robots;fault;faulty;boxes
8;;;12.5
8;;;11.25
8;;;13.1
8;wheel;1;10.5
8;wheel;1;9.75
8;wheel;1;11.5
"""
OWN = """
import numpy as np

class Mine:
    def reset(self, n_robots, seed): ...

    def act(self, observations):
        return np.zeros((len(observations), 4))

class Failing(Mine):
    def act(self, observations):
        raise RuntimeError("no more")

class Short(Mine):
    def act(self, observations):
        return np.zeros((len(observations), 3))

class NoAct:
    def reset(self, n_robots, seed): ...
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with trials and a policy; a policy is judged in a small warehouse."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    Path("lab.csv").write_text(LAB)
    Path("judged_policy.py").write_text(OWN)
    size = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0}
    small = PRESETS["scorecard"].replace(
        scenario={**size, "n_robots": 4, "n_items": 6, "duration": 20.0, "restock": True},
        sizes=[{"values": [2, 4]}],
        faults=[{"modes": ["FM4"], "robots": [1]}],
        parameters=[],
    )
    monkeypatch.setitem(PRESETS, "scorecard", small)
    return tmp_path


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {"__pycache__"}


TRIALS = ["judge", "lab.csv", "--column", "performance=boxes"]


def test_trials_are_judged_and_what_is_written_is_told(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("setup.toml").write_text('arena = "4 m x 4 m"\nrobots = 8\n')
    stated = ["--setup", "setup.toml", "--setup", "floor=tiles", "--full"]
    assert app.run([*TRIALS, *stated]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("6 runs in lab.csv\n")
    assert "| wheel, m = 1 | 10.6 [8.4, 12.8] | [6.2, 14.9] | -0.013 [" in printed
    out = Path("results", "judged", "lab")
    assert f"Report: {out / 'report.html'}\n" in printed
    assert f"Figure: {out / 'figures' / 'answer.svg'}\nTables: {out / 'tables.tex'}\n" in printed
    assert "For a paper: lab: P at N = 8, no fault: 12.3 [" in printed
    for name in ("report.html", "report.md", "claims.csv", "figures/answer.svg"):
        assert (out / name).is_file()
    report = (out / "report.md").read_text()
    assert "| arena | 4 m x 4 m |\n| robots | 8 |\n| floor | tiles |" in report
    tables = (out / "tables.tex").read_text()
    assert r"{wheel, m = 1} & {10.6 [8.4, 12.8]} & {[6.2, 14.9]} & {-0.013 [" in tables
    assert tables.count(r"\begin{table}") == tables.count(r"\end{table}") > 1
    assert "95 \\%" in tables
    assert "_" not in tables.replace("\\_", "")
    # The same trials again are another study beside it.
    assert app.run(TRIALS) == 0
    assert Path("results", "judged", "lab-2", "report.md").is_file()
    assert app.run([*TRIALS, "--out", str(out)]) == 2
    assert "holds a study already" in capsys.readouterr().err


def test_a_small_performance_is_not_rounded_away(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("rates.csv").write_text("N;P\n4;0.0123\n4;0.0131\n4;0.011\n8;0.02\n8;0.021\n8;0.019\n")
    assert app.run(["judge", "rates.csv", "--full"]) == 0
    assert "| N = 4 | 0.0121 [0.0095, 0.0148] | [" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lab.csv", "--colum", "a=b"], "No such option: --colum"),
        (["lab.csv", "--column", "performance"], "--column performance: should be NAME=VALUE"),
        (["lab.csv", "--column", "performance=boxe"], "'boxe': did you mean 'boxes'?"),
        (["lab.csv"], "has no column 'performance'"),
        (["lab.cvs"], "cannot read lab.cvs"),
        (["lab.csv", "--setup", "nowhere.toml"], "--setup nowhere.toml: should be NAME=VALUE, or"),
        (["lab.csv", "--seeds", "5"], "--seeds is not for a file of trials, and 'lab.csv' is one"),
        (["nowhere_at_all:Mine"], "No module named 'nowhere_at_all': should lie in this folder"),
        (["judged_policy:NoAct"], "is no policy: it should have the methods reset and act"),
        (["model.zip"], "executes the code"),
        (["homing", "--column", "N=robots"], "--column is not for a policy, and 'homing' is one"),
        (["homing", "--seeds", "2"], "--seeds"),
    ],
)
def test_what_cannot_be_judged_ends_in_one_sentence_before_anything_is_written(
    folder: Path, arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = names(folder)
    assert app.run(["judge", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert len(said.splitlines()) == 1
    assert names(folder) == before


def test_a_policy_is_judged_and_the_same_command_plays_nothing_twice(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["judge", "homing", "--processes", "1", "--seeds", "5"]
    assert app.run([*command, "--minutes", "0"]) == 0
    printed = capsys.readouterr().out
    again = "swarm-logistics judge homing --processes 1 --seeds 5 --minutes 0"
    assert f"Stopped after 0 min; the same command goes on: {again}\n" in printed
    assert "1 runs played" in printed.splitlines()[-1]
    assert app.run(command) == 0
    printed = capsys.readouterr().out
    out = Path("results", "judged", "homing")
    study = Study.stored(out)
    cells = study.performance()
    p = cells[cells["factor"] == "none"]["mean"].iloc[0]
    assert f"P, items in 20 s, at N = 4, no fault: {p:.1f} [" in printed
    assert f"Figure: {out / 'figures' / 'answer.svg'}" in printed
    assert f"For a paper: homing: P, items in 20 s, at N = 4, no fault: {p:.1f} [" in printed
    assert "P of the shipped policies here: " in printed
    shipped = printed.split("P of the shipped policies here: ")[1].splitlines()[0]
    assert " homing " not in shipped  # not ranked by itself
    others = set(json.loads(RECORDED.read_text())["policies"]) - {"homing"}
    assert shipped.endswith(f"; rank {len(others) + 1} of {len(others) + 1}.")
    assert "from the start: swarm-logistics judge homing --seeds" in printed
    last = printed.splitlines()[-1]
    assert last.startswith(f"{5 * len(study.plan().cases) - 1} runs played in ")
    assert "1 were kept" in last


def test_a_policy_is_played_until_it_is_clear(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["judge", "judged_policy:Mine", "--processes", "1", "--seeds", "30", "--out"]
    assert app.run([*given, "clear"]) == 0
    printed = capsys.readouterr().out
    assert Study.stored("clear").specification.until_clear
    # Nobody delivers: there is no ratio, and every question stops at the first look.
    told = "no fault: 0 (at most 0.15, as none of 20 runs delivered anything)."
    assert told in " ".join(printed.split())
    assert "undefined: it delivers nothing" in printed
    assert "80 runs played" in printed.splitlines()[-1]
    assert app.run([*given, "all", "--all-seeds"]) == 0
    assert not Study.stored("all").specification.until_clear
    assert "120 runs played" in capsys.readouterr().out.splitlines()[-1]


def test_a_policy_that_fails_in_every_run_ends_with_code_1_and_a_report(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["judge", "judged_policy:Failing", "--processes", "1", "--seeds", "3"]
    assert app.run([*given, "--out", "card"]) == 1
    printed = capsys.readouterr().out
    assert "P: no run has succeeded." in printed
    assert "12 failed, the first with RuntimeError: no more" in printed.splitlines()[-1]
    assert "3 of 3 runs failed" in Path("card", "report.md").read_text()


def test_commands_of_a_wrong_shape_are_refused_before_anything_is_kept(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["judge", "judged_policy:Short", "--processes", "1", "--out", "card"]
    assert app.run(given) == 2
    assert "commands of shape (4, 3): should be (4, 4)" in capsys.readouterr().err
    assert not Path("card").exists()


def test_recorded_p_is_that_of_the_shipped_policies() -> None:
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    assert set(recorded["policies"]) <= {name for name in policies.NAMES if "central" not in name}
    plan = Study.preset("scorecard", seeds=60).plan()
    assert recorded["seeds"][0] == plan.seeds[0]
    for name in {"swarm-dt", "homing"} & set(recorded["policies"]):
        # If this fails, run `make tables`.
        first = run_episode(Scenario(restock=True), policies.load(name), seed=plan.seeds[0])
        assert recorded["policies"][name]["p"][0] == first.delivered


def test_a_policy_is_judged_by_how_fast_it_clears_the_warehouse(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert app.run(["judge", "homing", "--clearing", "--seeds", "3", "--processes", "1"]) == 0
    told = capsys.readouterr().out
    assert " s, all items after " not in told
    assert ", all items after " in told
    assert "†" not in told
    report = (folder / "results" / "judged" / "homing-clearing" / "report.md").read_text()
    assert "Time until all items are delivered" in report
    assert "items delivered per minute" in report
    assert app.run(["judge", "lab.csv", "--clearing"]) == 2


def test_trials_without_removed_robots_and_a_second_judgement_are_named(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert app.run(["judge", "lab.csv", "--column", "performance=boxes"]) == 0
    assert "No FT: it needs trials without the robots, fault = removed" in capsys.readouterr().out
    assert app.run(["judge", "lab.csv", "--column", "performance=boxes"]) == 0
    assert "earlier judgement, so this one goes into results/judged/lab-2" in (
        capsys.readouterr().out
    )


def test_the_benchmark_gives_a_table_and_a_place_and_goes_on(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    fields = {"seeds": 3, "faults": [{"title": "Held out: x", "modes": ["FM1+FM4"], "robots": [1]}]}
    small = PRESETS["scorecard"].replace(**fields, sizes=[], parameters=[])
    monkeypatch.setitem(PRESETS, "benchmark", small)
    command = ["judge", "homing", "--benchmark", "--processes", "1"]
    assert app.run(command) == 0
    told = capsys.readouterr().out
    assert "Worst cell: Held out: x, FM1+FM4, m = 1" in told
    assert "entries by score" in told
    assert (folder / "results" / "benchmark" / "homing" / "report.html").exists()
    assert app.run(command) == 0
    again = capsys.readouterr().out
    assert "0 runs played" in again
    assert (
        again.split("Report:")[0].split("entries")[1]
        == told.split("Report:")[0].split("entries")[1]
    )
    assert app.run([*command, "--seeds", "5"]) == 2
    assert "same conditions for everybody" in capsys.readouterr().err
    assert app.run(["judge", "judged_policy.py:Failing", "--benchmark", "--processes", "1"]) == 1
    assert "failed" in capsys.readouterr().out
