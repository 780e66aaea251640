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
from swarm_logistics_env.studies.store import FILE_NAME, Store

SHORT_PAPER = """
import signal
import sys
from swarm_logistics_env import Scenario
from swarm_logistics_env.studies import presets
from swarm_logistics_env.cli import app

def shorter(factor):
    return factor.replace(scenario={**factor.scenario, "duration": DURATION})

if __name__ == "__main__":
    # Also where the gate itself was started to ignore it, as by nohup.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    old = presets.load_preset("paper")
    short = old.replace(
        scenario=Scenario(duration=DURATION),
        **{k: tuple(map(shorter, getattr(old, k))) for k in ("sizes", "ablations")},
    )
    presets.PRESETS["paper"] = short
    app()
"""


def short_paper(tmp_path: Path, duration: float) -> Path:
    script = tmp_path / "short_paper.py"
    script.write_text(SHORT_PAPER.replace("DURATION", str(duration)))
    return script


def records(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_study_run_prints_and_writes_the_report(tmp_path: Path) -> None:
    script, out = short_paper(tmp_path, 0.5), tmp_path / "out"
    command = [sys.executable, str(script), "study"]
    arguments = ["run", "paper", "--seeds", "2", "--processes", "1", "--out", str(out), "--full"]
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=False)
    # Nobody delivers in half a second: every ratio is undefined, and that is said.
    assert done.returncode == 0, done.stderr
    for words in (
        "34 conditions (5 shared) x 2 seeds = 68 runs",
        "Table I: scalability",
        "Table II: fault tolerance",
        "Table III: adaptability to warehouse_width",
        "Ablation: without taxis",
        "Cells whose published P lies inside",
        "Mean relative error",
        "blocked",
    ):
        assert words in done.stdout
    *_, last = done.stdout.splitlines()
    told = r"68 runs played in [\d.]+ s by 1 process, [\d.]+ episodes/s; 0 were kept from before; "
    assert re.fullmatch(told + "0 failed", last)
    report = (out / "report.md").read_text()
    assert "episodes/s" not in report
    assert "| duration | 0.5 (default 500) |" in report
    assert len(records(out / "cells.csv")) == 39
    assert len(records(out / "claims.csv")) == 43

    exported = subprocess.run(
        [*command, "export", str(out), "--to", str(tmp_path / "rows.csv")],
        capture_output=True,
        text=True,
        check=True,
    )
    assert exported.stdout.startswith("68 runs")
    rows = records(tmp_path / "rows.csv")
    assert [row["run"] for row in rows] == sorted(row["run"] for row in rows)
    assert json.loads(rows[0]["scenario"])["duration"] == 0.5


def test_study_plan_prints_conditions_once_and_what_they_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("[[sizes]]\nvalues = [5, 25]\n[[faults]]\nmodes = ['FM1']\nrobots = [1]\n")
    assert app.run(["study", "plan", str(path), "--policy", "swarm-dt", "--seeds", "3"]) == 0
    printed = capsys.readouterr().out
    # N = 25 is the baseline of the faults as well.
    assert "Scalability (N = 25); Fault tolerance and robustness (no fault)" in printed
    assert "4 conditions (1 shared) x 3 seeds = 12 runs" in printed
    assert "On one process of this machine at most " in printed
    assert list(tmp_path.iterdir()) == [path]
    path.write_text("first_seed = 500\nseeds = 3\n" + path.read_text())
    for arguments, first in (([], 500), (["--first-seed", "1000"], 1000)):
        assert app.run(["study", "plan", str(path), *arguments]) == 0
        assert f"x 3 seeds from {first} on = 12 runs" in capsys.readouterr().out


def stored(directory: Path) -> int:
    if not (directory / FILE_NAME).is_file():
        return 0
    with Store.existing(directory) as store:
        return len(store.succeeded())


def test_ctrl_c_stops_and_says_how_to_go_on(tmp_path: Path) -> None:
    script, out = short_paper(tmp_path, 500), tmp_path / "out"
    arguments = ["study", "run", "paper", "--seeds", "2", "--processes", "2", "--out", str(out)]
    process = subprocess.Popen(
        [sys.executable, str(script), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while stored(out) == 0:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the workers as well
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert 0 < stored(out) < 68
    assert errors.strip() == (
        f"Stopped. {stored(out)} of 68 runs are finished and kept in {out}; the same command goes "
        f"on with the other {68 - stored(out)}."
    )


def test_other_seeds_than_the_declared_ones_are_exploratory_and_the_command_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "mine.toml", tmp_path / "out"
    file.write_text("seeds = 2\nscenario = { duration = 1 }\n[[sizes]]\nvalues = [2, 4]\n")
    run = ["study", "run", str(file), "--processes", "1", "--out", str(out)]
    for _ in range(2):
        assert app.run(run) == 0
        assert "xploratory" not in capsys.readouterr().out
    assert app.run([*run, "--seeds", "4"]) == 0
    printed = capsys.readouterr().out
    # It warns before it plays, so that one can still stop it.
    warning = printed.index("This study declared 2 seeds (0 to 1) before its first run: over 4 ")
    assert warning < printed.index("question, 4 paired seeds")
    assert "4 seeds (0 to 3) every verdict is exploratory." in printed
    assert (
        "The verdicts are exploratory: they are over other seeds" in (out / "report.md").read_text()
    )
    assert app.run(["study", "run", "quick", "--out", str(out)]) == 2
    assert "holds the study 'mine'" in capsys.readouterr().err

    # What it proposes is a study that can be run, and whose verdicts stand.
    (proposed,) = re.findall(r"(first_seed = \d+), (seeds = \d+), (until_clear = true)\.", printed)
    assert proposed == ("first_seed = 4", "seeds = 200", "until_clear = true")
    lines = [proposed[0], "seeds = 30", proposed[2], *file.read_text().splitlines()[1:]]
    file.write_text("\n".join(lines))
    new = ["study", "run", str(file), "--processes", "1", "--out", str(tmp_path / "new")]
    assert app.run(new) == 0
    assert "xploratory" not in capsys.readouterr().out
    assert app.run([*new, "--first-seed", "24"]) == 0
    printed = capsys.readouterr().out
    assert "declared looks at 20, 30 seeds from 4 on before its first run" in printed
    assert "over 30 seeds (24 to 53) every verdict is exploratory." in printed


def test_shards_are_kept_apart_and_merged(tmp_path: Path) -> None:
    script, out = short_paper(tmp_path, 0.5), tmp_path / "out"
    command = [sys.executable, str(script), "study"]
    for number in ("1/2", "2/2"):
        arguments = ["run", "paper", "--seeds", "1", "--processes", "1", "--out", str(out)]
        done = subprocess.run(
            [*command, *arguments, "--shard", number], capture_output=True, text=True, check=True
        )
        assert "17 runs played" in done.stdout
        assert f"study merge {out}/shard-*-of-2 --out {out}" in done.stdout
    shards = [str(out / f"shard-{number}-of-2") for number in (1, 2)]
    assert app.run(["study", "merge", *shards, "--out", str(out)]) == 0
    assert stored(out) == 34


TABLE = "fault,faulty,robots,seed,delivered\n"


def imported(path: Path, faulty: tuple[int, ...], first: int = 0) -> str:
    """A study of four seeds of P_o, P_S and the P_F that are given."""
    seeds = range(first, first + 4)
    rows = [f"none,0,25,{s},{40 + s}\nremoved,1,25,{s},{38 + s}\n" for s in seeds]
    rows += [f"FM1,1,25,{seed},{p}\n" for seed, p in zip(seeds, faulty)]
    path.with_suffix(".csv").write_text(TABLE + "".join(rows))
    assert app.run(["judge", str(path.with_suffix(".csv")), "--out", str(path)]) == 0
    return str(path)


def test_regression_gate_fails_with_exit_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = imported(tmp_path / "old", (40, 41, 43, 42))
    new = imported(tmp_path / "new", (20, 22, 21, 23))
    capsys.readouterr()
    for arguments, code, words in (
        ([old, new], 0, "change, FM1, m = 1"),
        ([old, new, "--fail-if", "R < 0"], 1, "Gate 'R < 0' fails"),
        ([old, new, "--fail-if", "change < -0.2 at FM1"], 1, "fails"),
        ([new, old, "--fail-if", "R < 0", "--fail-if", "change < 0"], 0, "passes"),
    ):
        assert app.run(["study", "compare", *arguments]) == code
        assert words in capsys.readouterr().out
    assert app.run(["study", "compare", old, new, "--fail-if", "S < 0"]) == 2
    assert "tests nothing" in capsys.readouterr().err


def test_imported_runs_are_paired_by_the_seeds_of_their_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    old = imported(tmp_path / "old", (40, 42, 47, 44))
    new = imported(tmp_path / "new", (48, 43, 41, 42), first=2)
    capsys.readouterr()
    assert app.run(["study", "compare", old, new, "--fail-if", "change < 0 at FM1"]) == 0
    printed = capsys.readouterr().out
    # Seeds 2 and 3: 48 + 43 instead of 47 + 44. By their places it would be a gain of 1.
    assert "change, FM1, m = 1 (Fault tolerance and robustness) | 0.000 [" in printed
    assert "Only in the old study, and left out: seeds 0 to 1." in printed


def test_power_of_a_stored_study_and_of_a_pilot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stored_study = imported(tmp_path / "old", (40, 41, 43, 42))
    capsys.readouterr()
    assert app.run(["study", "power", stored_study, "--effect", "-0.1", "--indicator", "R"]) == 0
    printed = capsys.readouterr().out
    assert "R > 0, FM1, m = 1 | -0.100 | " in printed
    assert "FT" not in printed
    path = tmp_path / "mine.toml"
    path.write_text(
        "seeds = 10\nscenario = { n_robots = 3, n_items = 4, "
        "warehouse_width = 3, warehouse_height = 3, delivery_width = 1, duration = 20 }\n"
        "[[sizes]]\nvalues = [2, 3]\n"
    )
    arguments = ["--pilot-seeds", "3", "--processes", "1", "--effect", "1"]
    path.write_text("until_clear = true\n" + path.read_text())
    assert app.run(["study", "power", str(path), *arguments]) == 0
    assert "Seeds needed, from 3 seeds" in capsys.readouterr().out
    capsys.readouterr()
    assert app.run(["study", "power", str(path), *arguments, "--indicator", "R"]) == 2
    assert "--indicator R: the study makes no such comparison; it asks about S" in (
        capsys.readouterr().err
    )
    assert app.run(["study", "power", str(path), *arguments, "--at", "FM9"]) == 2
    assert app.run(["study", "power", stored_study, "--power", "2"]) == 2


def test_failed_runs_give_exit_code_1_and_a_report(tmp_path: Path) -> None:
    script, out = short_paper(tmp_path, 0.5), tmp_path / "out"
    (tmp_path / "broken_policy.py").write_text(
        "class Broken:\n"
        "    def reset(self, n_robots, seed): raise RuntimeError('a wheel came off')\n"
        "    def act(self, observations): ...\n"
    )
    arguments = ["study", "run", "paper", "--seeds", "1", "--processes", "1", "--out", str(out)]
    done = subprocess.run(
        [sys.executable, str(script), *arguments, "--policy", "broken_policy:Broken"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stderr
    # 32 conditions of the broken policy and the ablation's two, which stand.
    assert "32 failed, the first with RuntimeError: a wheel came off; " in done.stdout
    assert "1 of 1 runs failed" in (out / "report.md").read_text()


def test_a_study_is_kept_under_its_name_where_no_directory_is_given(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(
        "seeds = 2\nscenario = { duration = 0.5 }\n[[sizes]]\nvalues = [2, 3]\n"
    )
    assert app.run(["study", "run", "mine.toml", "--engine", "local"]) == 0
    assert stored(Path("results/mine")) == 4
    assert app.run(["study", "run", "mine.toml", "--engine", "local", "--shard", "1/2"]) == 0
    assert stored(Path("results/mine/shard-1-of-2")) > 0
    assert "study merge results/mine/shard-*-of-2 --out results/mine" in capsys.readouterr().out


def test_study_list_names_every_preset(capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["study", "list"]) == 0
    printed = capsys.readouterr().out
    for name in PRESETS:
        assert f"| {name} | " in printed
    assert "| paper | 20 | 680 | Table I: scalability; " in printed


def test_a_trained_policy_is_called_by_the_name_on_its_card(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    card = read_card(WEIGHTS / "ppo-delivery.safetensors")
    for file in ("first.safetensors", "second.safetensors"):
        shutil.copy(WEIGHTS / "ppo-delivery.safetensors", file)
    assert app.run(["run", "--policy", "first.safetensors", "--set", "duration=1"]) == 0
    assert f"robots with {card.name}, seed 0" in capsys.readouterr().out
    fields: dict[str, Any] = {
        "seeds": 2,
        "scenario": {"duration": 1.0},
        "sizes": [{"values": [2, 3]}],
    }
    study = Study(out=tmp_path / "out", policies=["first.safetensors"], **fields)
    study.run()
    Path("first.safetensors").unlink()  # the store knows the name, whatever became of the file
    for found in (study, Study.stored(tmp_path / "out")):
        assert set(found.performance()["policy"]) == {card.name}
    shutil.copy("second.safetensors", "first.safetensors")
    alike = Study(policies=["first.safetensors", "second.safetensors", "swarm-dt"], **fields)
    assert [cell[0] for cell in alike.plan().cells[::2]] == [
        "first.safetensors", "second.safetensors", "swarm-dt"
    ]  # fmt: skip
    beside = Study(policies=["ppo-delivery", "first.safetensors"], **fields)
    assert [cell[0] for cell in beside.plan().cells[::2]] == ["ppo-delivery", "first.safetensors"]
