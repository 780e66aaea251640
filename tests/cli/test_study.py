"""`study ...`: what it prints, writes and ends with, and what it leaves when it is stopped."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.cli import app
from swarm_logistics_env.policies import read_card
from swarm_logistics_env.policies.spec import WEIGHTS
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.presets import PRESETS
from swarm_logistics_env.studies.runs import FILE_NAME, Runs

FILE = """
seeds = 2
scenario = { warehouse_width = 4, warehouse_height = 3, n_robots = 4, n_items = 8, duration = 2 }

[[sizes]]
values = [2, 4]
"""


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of a study of 4 runs, in the current folder."""
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(FILE)
    return Path("mine.toml")


def records(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def stored(directory: Path) -> int:
    if not (directory / FILE_NAME).is_file():
        return 0
    with Runs.existing(directory) as runs:
        return len(runs.succeeded())


def shorter(duration: float) -> dict[str, Any]:
    """Return the fields of `paper` with shorter runs."""
    paper = PRESETS["paper"]
    changed = {
        name: tuple(
            one.replace(scenario={**one.scenario, "duration": duration})
            for one in getattr(paper, name)
        )
        for name in ("sizes", "ablations")
    }
    return {"scenario": {"duration": duration}, **changed}


def test_study_run_prints_and_writes_the_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(PRESETS, "paper", PRESETS["paper"].replace(**shorter(0.5)))
    out = tmp_path / "out"
    options = ["--seeds", "2", "--processes", "1", "--out", str(out), "--full"]
    # Nobody delivers in half a second: every ratio is undefined, and that is said.
    assert app.run(["study", "run", "paper", *options]) == 0
    printed = capsys.readouterr().out
    for words in (
        "34 conditions (5 shared) x 2 seeds = 68 runs",
        "Table I: scalability",
        "Table II: fault tolerance",
        "Table III: adaptability to warehouse_width",
        "Ablation: without taxis",
        "Cells whose published P lies inside",
        "undefined: it delivers nothing",
    ):
        assert words in printed
    *_, last = printed.splitlines()
    told = r"68 runs played in [\d.]+ s by 1 process, [\d.]+ episodes/s; 0 were kept from before; "
    assert re.fullmatch(told + "0 failed", last)
    report = (out / "report.md").read_text()
    assert "episodes/s" not in report
    assert "| duration | 0.5 (default 500) |" in report
    assert len(records(out / "cells.csv")) == 39
    assert len(records(out / "claims.csv")) == 43

    assert app.run(["study", "export", str(out), "--to", str(tmp_path / "rows.csv")]) == 0
    assert capsys.readouterr().out.startswith("68 runs")
    rows = records(tmp_path / "rows.csv")
    assert [row["run"] for row in rows] == sorted(row["run"] for row in rows)
    assert json.loads(rows[0]["scenario"])["duration"] == 0.5


def test_study_plan_prints_conditions_once_and_what_they_take(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file.write_text(f"first_seed = 500\n{FILE}\n[[faults]]\nmodes = ['FM1']\nrobots = [1]\n")
    for arguments, first in (([], 500), (["--first-seed", "1000"], 1000)):
        given = ["mine.toml", "--policy", "swarm-dt", "--seeds", "3", *arguments]
        assert app.run(["study", "plan", *given]) == 0
        printed = capsys.readouterr().out
        # N = 4 is the baseline of the faults as well.
        assert "Scalability (N = 4); Fault tolerance and robustness (no fault)" in printed
        assert f"4 conditions (1 shared) x 3 seeds from {first} on = 12 runs" in printed
    assert list(Path().iterdir()) == [file]


SLOW = """
import signal
from swarm_logistics_env.cli import app

if __name__ == "__main__":
    # Also where the gate itself was started to ignore it, as by nohup.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    app()
"""


def test_ctrl_c_stops_and_says_how_to_go_on(file: Path) -> None:
    file.write_text(FILE.replace("duration = 2", "duration = 500, restock = true"))
    Path("slow.py").write_text(SLOW)
    options = ["study", "run", "mine.toml", "--seeds", "30", "--processes", "2", "--out", "out"]
    process = subprocess.Popen(
        [sys.executable, "slow.py", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    out = Path("out")
    while stored(out) == 0:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the workers as well
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert 0 < stored(out) < 60
    assert errors.strip() == (
        f"Stopped. {stored(out)} of 60 runs are finished and kept in out; the same command goes "
        f"on with the other {60 - stored(out)}."
    )


def test_other_seeds_than_the_declared_ones_are_exploratory_and_the_command_says_so(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = ["study", "run", "mine.toml", "--processes", "1", "--out", "out"]
    for _ in range(2):
        assert app.run(run) == 0
        assert "xploratory" not in capsys.readouterr().out
    assert app.run([*run, "--seeds", "4"]) == 0
    printed = capsys.readouterr().out
    # It warns before it plays, so that one can still stop it.
    warning = printed.index("This study declared 2 seeds (0 to 1) before its first run: over 4 ")
    assert warning < printed.index("1 question, swarm-dt, 4 paired seeds.")
    assert "4 seeds (0 to 3) every verdict is exploratory." in printed
    assert "exploratory: they are over other seeds" in Path("out", "report.md").read_text()
    assert app.run(["study", "run", "quick", "--out", "out"]) == 2
    assert "holds the study 'mine'" in capsys.readouterr().err

    # What it proposes is a study that can be run, and whose verdicts stand.
    (proposed,) = re.findall(r"(--first-seed 4 --until-clear) --out DIRECTORY\.", printed)
    new = ["study", "run", "mine.toml", "--most", "30", "--processes", "1", "--out", "new"]
    assert app.run([*new, *proposed.split()]) == 0
    assert "xploratory" not in capsys.readouterr().out
    assert app.run([*new, "--first-seed", "24", "--until-clear"]) == 0
    printed = capsys.readouterr().out
    assert "declared looks at 20, 30 seeds from 4 on before its first run" in printed
    assert "over 30 seeds (24 to 53) every verdict is exploratory." in printed


def test_options_of_run_change_the_study_and_failed_runs_its_exit_code(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    local = ["study", "run", "mine.toml", "--engine", "local"]
    assert app.run([*local, "--restock"]) == 0
    assert Study.stored("results/mine-restock").specification.scenario.restock  # type: ignore[attr-defined]
    assert app.run([*local, "--until-clear", "--most", "30"]) == 0
    assert Study.stored("results/mine").specification.looks == (20, 30)
    assert app.run([*local, "--until-clear", "--most", "20"]) == 2
    assert "--most 20: should be more than 20 seeds" in capsys.readouterr().err
    file.write_text(FILE.replace("n_items = 8, duration = 2", "n_items = 1, duration = 60"))
    assert app.run([*local, "--policy", "homing", "--seeds", "1"]) == 0
    assert "homing delivers every item before the end" in capsys.readouterr().out
    # It stands beside the study of the file's own policies.
    assert Path("results/mine-homing/report.html").exists()
    Path("broken_policy.py").write_text(
        "class Broken:\n"
        "    def reset(self, n_robots, seed): raise RuntimeError('a wheel came off')\n"
        "    def act(self, observations): ...\n"
    )
    broken = ["--policy", "broken_policy:Broken", "--restock", "--out", "broken"]
    assert app.run([*local, *broken]) == 1
    told = "4 failed, the first with RuntimeError: a wheel came off. Each traceback, column error: "
    assert told in capsys.readouterr().out
    assert "2 of 2 runs failed" in Path("broken", "report.md").read_text()


def test_a_study_and_its_shards_are_kept_under_its_name_and_merged(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    local = ["study", "run", "mine.toml", "--engine", "local"]
    for number in (1, 2):
        assert app.run([*local, "--shard", f"{number}/2"]) == 0
        printed = capsys.readouterr().out
        assert "2 runs played" in printed
        assert "study merge results/mine/shard-*-of-2 --out results/mine" in printed
    shards = [f"results/mine/shard-{number}-of-2" for number in (1, 2)]
    assert app.run(["study", "merge", *shards, "--out", "results/mine"]) == 0
    assert "study report results/mine" in capsys.readouterr().out
    assert app.run(local) == 0
    assert "0 runs played" in capsys.readouterr().out
    assert stored(Path("results/mine")) == 4


def test_a_trained_policy_is_called_by_the_name_on_its_card(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = read_card(WEIGHTS / "ppo-delivery.safetensors")
    for name in ("first.safetensors", "second.safetensors"):
        shutil.copy(WEIGHTS / "ppo-delivery.safetensors", name)
    assert app.run(["run", "--policy", "first.safetensors", "--set", "duration=1"]) == 0
    assert f"robots with {card.name}, seed 0" in capsys.readouterr().out
    study = Study.from_file(file, out="out", policies=["first.safetensors"])
    study.run()
    Path("first.safetensors").unlink()  # the store knows the name, whatever became of the file
    for found in (study, Study.stored("out")):
        assert {cell.policy for cell in found.findings().cells} == {card.name}
    shutil.copy("second.safetensors", "first.safetensors")
    for policies in (
        ["first.safetensors", "second.safetensors", "swarm-dt"],
        ["ppo-delivery", "first.safetensors"],
    ):
        plan = Study.from_file(file, policies=policies).plan()
        assert [cell[0] for cell in plan.cells[::2]] == policies
