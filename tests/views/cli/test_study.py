"""`study ...`: what it prints, writes and ends with, and what it leaves when it is stopped."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from swarm_logistics_env.compiler.numba_fence import QUIET
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import read_card
from swarm_logistics_env.policies.catalogue import WEIGHTS
from swarm_logistics_env.study.questions.presets import PRESETS
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.views.cli import app, study_commands
from tests.conftest import figures_drawn
from tests.made_up import delivered
from tests.views.cli.conftest import Command

FILE = """
seeds = 2
scenario = { warehouse_width = 4, warehouse_height = 3, n_robots = 4, n_items = 8, duration = 2 }

[[sizes]]
values = [2, 4]
"""
RUN = "study run mine.toml --engine local"
EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.fixture(autouse=True)
def file(folder: Path) -> Path:
    """The file of a study of 4 runs, in the current folder."""
    Path("mine.toml").write_text(FILE)
    return Path("mine.toml")


def records(path: str) -> list[dict[str, str]]:
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def stored(directory: str) -> int:
    if not Path(directory, FILE_NAME).is_file():
        return 0
    with Runs.existing(Path(directory)) as runs:
        return len(runs.succeeded())


def test_study_run_prints_and_writes_the_report(file: Path, command: Command) -> None:
    # Nobody delivers in half a second: every ratio is undefined, and that is said.
    short = FILE.replace("duration = 2", "duration = 0.5")
    file.write_text(f"{short}\n[[faults]]\nmodes = ['FM1']\nrobots = [1]\n")
    output = command(f"{RUN} --out out --full")
    for words in (
        "3 questions; 4 conditions x 2 seeds = 8 runs",
        "Scalability",
        "Fault tolerance and robustness",
        "undefined: it delivers nothing",
    ):
        assert words in output
    tally = r"8 runs played in [\d.]+ s, [\d.]+ episodes/s; 0 were kept from before; "
    assert re.fullmatch(tally + "0 failed", output.splitlines()[-1])
    report = Path("out", "report.md").read_text()
    assert "episodes/s" not in report
    assert "| duration | 0.5 (default 500) |" in report
    assert len(records("out/cells.csv")) == 5
    assert len(records("out/claims.csv")) == 3
    assert command("study export out --to rows.csv").startswith("8 runs")
    rows = records("rows.csv")
    assert [row["run"] for row in rows] == sorted(row["run"] for row in rows)
    assert json.loads(rows[0]["scenario"])["duration"] == 0.5


@pytest.mark.daily
def test_figures_are_drawn_as_wide_and_in_the_letters_that_a_paper_needs(
    command: Command,
) -> None:
    with figures_drawn("svg"):
        command(f"{RUN} --out out")
    page = Path("out/report.html").read_text()
    drawing, picture = Path("out/figures/answer.svg"), Path("out/figures/answer.png")
    assert 'width="374.4pt"' in drawing.read_text()  # 72 a inch
    with figures_drawn():
        command("study report out --figure-width 3.5 --font serif")
    assert 'width="252pt"' in drawing.read_text()
    assert "font-family: 'STIXGeneral'" in drawing.read_text()
    assert struct.unpack(">I", picture.read_bytes()[16:20]) == (1050,)  # 300 an inch
    assert drawing.with_suffix(".pdf").read_bytes().startswith(b"%PDF")
    # The page has drawings for a screen.
    assert Path("out/report.html").read_text() == page


def test_study_plan_prints_conditions_once_and_what_they_take(file: Path, command: Command) -> None:
    file.write_text(f"{FILE}\n[[faults]]\nmodes = ['FM1']\nrobots = [1]\n")
    output = command("study plan mine.toml --policy swarm-dt --seeds 3 --first-seed 1000")
    # N = 4 is the baseline of the faults as well.
    assert "Scalability (N = 4); Fault tolerance and robustness (no fault)" in output
    assert "4 conditions x 3 seeds from 1000 on = 12 runs" in output
    assert list(Path().iterdir()) == [file]


@pytest.mark.daily
def test_every_study_that_is_shipped_or_an_example_is_planned(command: Command) -> None:
    # Those in tasks/ need packages that nothing else does.
    files = sorted(EXAMPLES.glob("*.toml")) + sorted(EXAMPLES.glob("questions/*.toml"))
    assert len(files) > 10
    for study in (*PRESETS, *map(str, files)):
        assert " conditions" in command(f"study plan {study}"), study


def test_of_all_trainings_each_has_its_conditions(command: Command) -> None:
    output = command("study plan mine.toml --policy ppo-robust@all")
    for training in ("ppo-robust@0", "ppo-robust@5"):
        (row,) = [row for row in output.splitlines() if training in row and "(N = 2)" in row]
        assert "Scalability" in row


SLOW = """
import signal
from swarm_logistics_env.views.cli import app
# Also where the gate itself was started to ignore it, as by nohup.
signal.signal(signal.SIGINT, signal.default_int_handler)
app()
"""


WAITING = """
import threading
from swarm_logistics_env.policies import SwarmDT

class Waiting(SwarmDT):
    def reset(self, n_robots, seed):
        super().reset(n_robots, seed)
        if seed == 5:  # until it is ended
            threading.Event().wait()
"""


@pytest.mark.unmeasured
def test_ctrl_c_stops_and_says_how_to_go_on(file: Path) -> None:
    Path("waiting_policy.py").write_text(WAITING)
    words = "study run mine.toml --seeds 30 --processes 2 --out out --policy waiting_policy:Waiting"
    process = subprocess.Popen(
        [sys.executable, "-c", SLOW, *words.split()],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, QUIET: "1"},
        start_new_session=True,
    )
    while stored("out") == 0:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to the workers as well
    _, errors = process.communicate(timeout=600)
    assert process.returncode == 130
    n_finished = stored("out")
    assert 0 < n_finished < 60
    # Where workers compile first, lines of progress stand before it.
    assert errors.strip().splitlines()[-1] == (
        f"Stopped. {n_finished} of 60 runs are finished and kept in out; the same command goes "
        f"on with the other {60 - n_finished}."
    )


@pytest.mark.parametrize(
    ("options", "task", "out", "n_runs", "later"),
    [
        ("--seeds 3", "warehouse", "mine", 6, ""),
        ("--seeds 3 --clearing", "clearing", "mine-clearing", 6, ""),
        ("--until-clear", "warehouse", "mine", 400, ", and with what later looks need"),
        ("--seeds 3 --shard 2/3", "warehouse", "mine/shard-2-of-3", 2, ""),
        (
            "--seeds 3 --restock --performance on_time --set order_due=9 --policy homing",
            *("warehouse", "mine-restock-on-time-order-due-9-homing", 6, ""),
        ),
    ],
)
def test_what_is_left_of_a_study_that_is_stopped_is_told(
    options: str,
    task: str,
    out: str,
    n_runs: int,
    later: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def stop(study: Study, *_: object, after_look: object, **__: object) -> None:
        assert study.specification.task == task
        assert (after_look is None) == (not later)
        raise KeyboardInterrupt

    monkeypatch.setattr(Study, "run", stop)
    assert app.run(f"{RUN} {options}".split()) == 130
    assert capsys.readouterr().err == (
        f"\nStopped. 0 of {n_runs} runs are finished and kept in {Path('results', out)}; the same "
        f"command goes on with the other {n_runs}{later}.\n"
    )


def test_a_pilot_is_played_of_tasks_with_items_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    study = Study(
        task="tests.study.tasks.lane:LANE", policies=["walker"], sizes=[{"values": [2, 4]}]
    )
    monkeypatch.delattr(study_commands, "Run")
    study_commands.say_what_a_pilot_shows(study)


def play_pilot(
    monkeypatch: pytest.MonkeyPatch, outcome: Outcome, performance: str | None = None
) -> list[tuple[int, int]]:
    """Say what a pilot shows whose runs give an outcome; return their robots and seeds."""
    runs: list[tuple[int, int]] = []

    def run(case: Any, _: str, seed: int) -> Any:
        runs.append((case.scenario.n_robots, seed))
        return SimpleNamespace(play=lambda: outcome)

    monkeypatch.setattr(study_commands, "Run", run)
    study = Study.from_file("mine.toml", first_seed=7, performance=performance)
    study_commands.say_what_a_pilot_shows(study)
    return runs


@pytest.mark.parametrize(
    ("outcome", "performance", "sentence"),
    [
        (delivered(3), None, ""),
        (
            *(delivered(0), None),
            "swarm-dt delivers nothing in a first run. Ctrl-C stops; finished runs are kept.\n",
        ),
        (
            *(delivered(3, all_delivered=True), None),
            (
                "swarm-dt delivers every item before the end, so that P is capped and most "
                "verdicts will be open. Nothing is capped where items come back, or where P is the "
                "rate until all are delivered: add --restock or --clearing\n"
            ),
        ),
        (
            *(delivered(0), "longest_standstill:60"),
            "swarm-dt has the largest P possible in a first run: most verdicts will be open.\n",
        ),
        (delivered(3, all_delivered=True), "longest_standstill:60", ""),
        (
            *(Outcome(error="Traceback\nValueError: \x07 a\n"), None),
            (
                "swarm-dt fails in a first run: ValueError: \\x07 a. Ctrl-C stops; finished runs "
                "are kept.\n"
            ),
        ),
    ],
)
def test_what_a_first_run_shows_of_a_policy_is_told(
    outcome: Outcome,
    performance: str | None,
    sentence: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    in_base_scenario_alone = [(4, 7)]
    assert play_pilot(monkeypatch, outcome, performance) == in_base_scenario_alone
    assert capsys.readouterr().out == sentence


def test_commands_of_a_wrong_shape_in_a_first_run_end_the_study(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    outcome = Outcome(error="Traceback\nPolicyError: A: commands of shape (2, 3)\n")
    sentence = r"^swarm-dt fails in a first run: A: commands of shape \(2, 3\)$"
    with pytest.raises(StudyError, match=sentence):
        play_pilot(monkeypatch, outcome)


def test_other_seeds_than_the_declared_ones_are_exploratory_and_the_command_says_so(
    command: Command,
) -> None:
    assert "xploratory" not in command(f"{RUN} --out out")
    output = command(f"{RUN} --out out --seeds 4")
    # It warns before it plays, so that one can still stop it.
    warning = output.index("This study declared other seeds or another P before its first run")
    assert warning < output.index("4 paired seeds")
    assert "exploratory: they are over other seeds" in Path("out", "report.md").read_text()
    assert "holds the study 'mine'" in command("study run quick --out out", code=2)
    # What it proposes is a study whose verdicts stand.
    assert "xploratory" not in command(f"{RUN} --out new --first-seed 4")


BROKEN = """
class Broken:
    def reset(self, n_robots, seed): raise RuntimeError('a wheel came off')
    def act(self, observations): ...
"""


def test_options_of_run_change_the_study_and_failed_runs_its_exit_code(
    file: Path, command: Command
) -> None:
    command(f"{RUN} --restock")
    assert Study.stored("results/mine-restock").specification.scenario.restock  # type: ignore[attr-defined]
    assert "did you mean 'mujoco'" in command(f"{RUN} --bodies mujoko", code=2)
    file.write_text(FILE.replace("n_items = 8, duration = 2", "n_items = 1, duration = 60"))
    output = command(f"{RUN} --policy homing --seeds 1")
    assert "homing delivers every item before the end" in output
    output = command(f"{RUN} --policy homing --seeds 1 --performance on_time --set order_due=60")
    assert "homing has the largest P possible in a first run: most verdicts will be" in output
    # It stands beside the study of the file's own policies.
    assert Path("results/mine-homing/report.html").exists()
    Path("broken_policy.py").write_text(BROKEN)
    output = command(f"{RUN} --policy broken_policy:Broken --restock --out broken", code=1)
    assert "3 failed, the first with RuntimeError: a wheel came off" in output
    assert "Stopped, as nothing works" in output
    assert "2 of 2 runs failed" in Path("broken", "report.md").read_text()


@pytest.mark.daily
def test_robots_of_another_engine_play_a_study(command: Command) -> None:
    command(f"{RUN} --bodies mujoco --seeds 1")
    study = Study.stored("results/mine-bodies-mujoco")
    assert {case.scenario.bodies for case in study.plan().cases} == {"mujoco"}  # type: ignore[attr-defined]


def test_a_study_and_its_shards_are_kept_under_its_name_and_merged(command: Command) -> None:
    merge = "study merge results/mine/shard-*-of-2 --out results/mine"
    for number in (1, 2):
        output = command(f"{RUN} --shard {number}/2")
        assert "2 runs played" in output
        assert merge in output
    shards = (f"results/mine/shard-{number}-of-2" for number in (1, 2))
    output = command(merge.replace("results/mine/shard-*-of-2", " ".join(shards)))
    assert "study report results/mine" in output
    assert "0 runs played" in command(RUN)
    assert stored("results/mine") == 4


def test_a_trained_policy_is_called_by_the_name_on_its_card(file: Path, command: Command) -> None:
    model = WEIGHTS / "ppo-delivery.safetensors"
    name = read_card(model).name
    shutil.copy(model, "first.safetensors")
    output = command("run --policy first.safetensors --set duration=1")
    assert f"robots with {name}, seed 0" in output
    study = Study.from_file(file, out="out", policies=["first.safetensors"])
    study.run()
    Path("first.safetensors").unlink()  # the store knows the name, whatever became of the file
    for stored_study in (study, Study.stored("out")):
        assert {cell.policy for cell in stored_study.findings().cells} == {name}
