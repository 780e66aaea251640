"""`judge`: trials from a file, or a policy, as a command."""

from __future__ import annotations

import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

from swarm_logistics_env import judge
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.spi.phases import two_phases
from swarm_logistics_env.study.questions import benchmark_cells
from swarm_logistics_env.study.questions.presets import PRESETS
from swarm_logistics_env.study.report import benchmark
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.benchmark import Entry
from swarm_logistics_env.study.report.more_seeds import more_seeds
from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.runs.store import Runs
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.verdicts import results
from swarm_logistics_env.study.verdicts.collapses import collapses, edges
from swarm_logistics_env.views.cli import app, judge_trials
from swarm_logistics_env.views.cli.judging import names_policy
from swarm_logistics_env.world.scenario import Scenario
from tests.views.cli.conftest import Command

LAB = """robots;fault;faulty;boxes
8;none;;12.5
8;none;;11.25
8;none;;13.1
8;wheel;1;10.5
8;wheel;1;9.75
8;wheel;1;11.5
"""
OWN = """
import numpy as np

class Mine:
    def reset(self, n_robots, seed): ...
    def act(self, observations): return np.zeros((len(observations), 4))
class Failing(Mine):
    def act(self, observations): raise RuntimeError("no more")
class Short(Mine):
    def act(self, observations): return np.zeros((len(observations), 3))
"""


@pytest.fixture(autouse=True)
def material(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Trials and a policy in the current folder; a policy is judged in a small warehouse."""
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
    space = {
        "room": ({**size, "duration": 20.0},),
        "n_robots": (4,),
        "items_per_robot": (1, 2),
        "handling_time": (0.5, 1.0, 2.0),
        "mode": ("", "FM1+FM4"),
        "share_failing": (0.25,),
        "onset": (0.0, 5.0),
    }
    monkeypatch.setattr(benchmark_cells, "SPACE", space)
    monkeypatch.setattr(benchmark_cells, "SEEDS", 2)
    for half in benchmark_cells.N_CELLS:
        monkeypatch.setitem(benchmark_cells.N_CELLS, half, 2)
    monkeypatch.setattr(benchmark, "ENTRIES", tmp_path_factory.mktemp("entries") / "entries")
    shares = ((0.5, 0.7),)
    benchmark.write_entries({"swarm-dt": Entry(digest="f", held_out=shares, development=shares)})


TRIALS = "judge lab.csv --column performance=boxes"


def test_what_is_judged_is_a_policy_or_trials() -> None:
    for folder in ("trials", "homing"):
        Path(folder).mkdir()
    Path("no_suffix").touch()
    policies = ["homing", "mine", "judged_policy.py", "judged_policy:Mine", "my_package.mine:Mine"]
    trials = ["lab.csv", "missing.XLSX", "trials", "no_suffix", "notes.txt"]
    assert {name: names_policy(name) for name in policies + trials} == {
        **dict.fromkeys(policies, True),
        **dict.fromkeys(trials, False),
    }


def test_trials_are_judged_and_what_is_written_is_told(command: Command) -> None:
    printed = command(f"{TRIALS} --setup robots=8 --setup floor=tiles --full")
    assert printed.startswith("## lab.csv: 6 trials\n")
    assert "| boxes | performance |" in printed
    assert "| none |  | 8 | 3 |" in printed
    assert "| wheel, m = 1 | 10.6 [8.4, 12.8] | [6.2, 14.9] | -0.013 [" in printed
    assert "No FT: it needs trials without the robots, fault = removed" in printed
    performance = (
        "P (boxes) [95 %] = 12.3 [9.9, 14.6], N = 8, no fault; robustness R, wheel, 1 of 8: "
    )
    out = Path("results", "judged", "lab")
    assert f"Report: {out / 'report.html'}\n" in printed
    figure = out / "figures" / "answer.svg"
    assert f"Figure: {figure}\nTables for a paper: {out / 'tables.tex'}\n" in printed
    for name in ("report.html", "claims.csv", "figures/answer.svg"):
        assert (out / name).is_file()
    report = (out / "report.md").read_text()
    conditions = "trials of lab.csv, robots 8, floor tiles, 3 unpaired runs a condition"
    assert f"lab, {conditions}. lab: {performance}" in report
    assert "| robots | 8 |\n| floor | tiles |" in report
    # With other words on the conditions they are another study beside it.
    assert "so this one is in results/judged/lab-2" in command(TRIALS)
    assert Path("results", "judged", "lab-2", "report.md").is_file()
    assert "holds a study already" in command(f"{TRIALS} --out {out}", code=2)


def test_all_that_is_wrong_with_a_file_is_told_a_line_each(
    command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("lab.csv").write_text(LAB + "8;wheel;;9\n8;wheel;1;NA\n")
    assert app.run(TRIALS.split()) == 2
    boxes, faulty = capsys.readouterr().err.splitlines()
    for line in (boxes, faulty):
        assert line.endswith(
            "--skip-missing leaves out 2 rows that lack a value: 1 in 'faulty', 1 in 'boxes'"
        )
    printed = command(f"{TRIALS} --skip-missing --check")
    assert "2 of 8 rows lack a value and are left out: 1 in 'faulty', 1 in 'boxes'." in printed
    Path("lab.csv").write_text("4;8\n10;19\n11;20\n")
    assert "'4' (robots 4), '8' (robots 8)" in command("judge lab.csv --wide robots --check")


def calls_of(*functions: Callable[..., Any], during: Callable[[], object]) -> list[int]:
    """Return how often each function is called, whatever name it is imported by."""
    counts: Counter[CodeType] = Counter()

    def count(frame: FrameType, event: str, _: object) -> None:
        counts[frame.f_code] += event == "call"

    sys.setprofile(count)
    try:
        during()
    finally:
        sys.setprofile(None)
    return [counts[function.__code__] for function in functions]


@pytest.mark.daily
def test_one_judgement_computes_everything_once_and_hands_it_on(command: Command) -> None:
    once = RecordedStudy.of.__func__, results.judge, collapses, edges, answer, Runs.__init__  # type: ignore[attr-defined]
    *counts, n_tests = calls_of(*once, two_phases, during=lambda: command(TRIALS))
    assert counts == [1] * len(once)
    assert n_tests == 2  # a condition each


def test_trials_are_judged_from_python_without_a_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(folder / "missing"))
    before = {*folder.rglob("*")}
    columns = {"performance": "boxes"}
    assert calls_of(Runs.__init__, during=lambda: judge("lab.csv", columns=columns)) == [0]
    assert {*folder.rglob("*")} == before


@pytest.mark.unmeasured
@pytest.mark.parametrize("option", ["", "--out mine"])
def test_the_same_trials_again_finish_a_judgement_that_was_interrupted(
    option: str, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = f"{TRIALS} {option}"
    with monkeypatch.context() as patched:
        patched.setattr(judge_trials, "show_report", lambda *_, **__: 1 / 0)
        command(words, code=1)
    first = command(words)
    assert "Tables for a paper: " in first
    assert first.endswith(command(words))
    (out,) = {path.parent for path in Path().rglob("study.sqlite")}
    assert (out / "report.html").is_file()
    Path("lab.csv").write_text(LAB + "8;wheel;1;9.5\n")
    if option:
        assert "holds a study already" in command(words, code=2)
    else:
        (out / "study.sqlite").write_bytes(b"damaged")
        assert "so this one is in results/judged/lab-2" in command(words)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("lab.csv --column performance", "--column performance: should be NAME=VALUE"),
        ("lab.csv --column performance=boxe", "'boxe': did you mean 'boxes'?"),
        ("lab.csv", "has no column 'performance'"),
        ("lab.csv --reference width", "--reference width: should be NAME=VALUE"),
        (
            "lab.csv --column performance=boxes --reference width=2",
            "has no parameter 'width' that varies",
        ),
        ("homing --reference width=2", "--reference is not for a policy, and 'homing' is one"),
        ("lab.csv --setup nowhere.toml", "--setup nowhere.toml: should be NAME=VALUE"),
        ("lab.csv --seeds 5", "--seeds is not for a file of trials, and 'lab.csv' is one"),
        ("model.zip", "executes the code"),
        ("homing --column N=robots", "--column is not for a policy, and 'homing' is one"),
        ("--check homing --seeds 3", "--check is not for a policy, and 'homing' is one"),
        ("lab.csv --all-seeds", "--until-clear/--all-seeds is not for a file of trials, and"),
        ("lab.csv --first-seed 0", "--first-seed is not for a file of trials, and"),
        ("homing --seeds 2", "--seeds"),
        ("homing --benchmark --seeds 5", "same conditions for everybody"),
        ("homing-stock --benchmark", "is the benchmark's reference: its score is 1"),
        ("homing swarm-dt --benchmark", "--benchmark: should be of one policy, not of 2"),
        ("homing --benchmark --first-seed 0", "--first-seed: the benchmark has the same"),
    ],
)
def test_what_cannot_be_judged_ends_in_one_sentence_before_anything_is_written(
    words: str, reason: str, folder: Path, command: Command
) -> None:
    assert reason in command(f"judge {words}", code=2)
    assert {path.name for path in folder.iterdir()} <= {
        "lab.csv",
        "judged_policy.py",
        "__pycache__",
    }


def test_help_shows_the_options_of_what_is_judged(command: Command) -> None:
    both = command("judge --help")
    shared, of_a_policy, of_trials = re.split("Options for .*:\n", both.partition("Options:")[2])
    assert re.findall(r"^  (--[\w-]+)", shared, re.MULTILINE) == ["--out", "--full", "--help"]
    assert "--seeds" in of_a_policy
    assert "--column" not in of_a_policy
    assert "--column" in of_trials
    assert "--seeds" not in of_trials
    for target, options in (("homing", of_a_policy), ("lab.csv", of_trials)):
        names = re.findall(r"^  (--[\w-]+)", command(f"judge {target} --help"), re.MULTILINE)
        mine = re.findall(r"^  (--[\w-]+)", options, re.MULTILINE)
        assert {*names} == {*mine, "--out", "--full", "--help"}


@pytest.mark.unmeasured
def test_a_policy_is_judged_and_the_same_command_plays_nothing_twice(command: Command) -> None:
    words = "judge homing --processes 1 --seeds 5"
    printed = command(f"{words} --minutes 0")
    again = f"runs are left; the same command goes on: swarm-logistics {words} --minutes 0\n"
    assert "Stopped after 0 min, " in printed
    assert again in printed
    assert "1 runs played" in printed.splitlines()[-1]
    printed = command(words)
    study = Study.stored("results/judged/homing")
    cells = study.performance()
    p = cells[cells["factor"] == "none"]["mean"].iloc[0]
    world = "in a warehouse of 3 m x 3 m with 6 items that come back, robots of 2 m/s"
    report = Path("results/judged/homing/report.md").read_text(encoding="utf-8")
    assert f"homing {world} (engine chipmunk), 5 paired seeds (" in report
    assert f"homing: P [95 %] = {p:.1f} [" in printed
    needs = more_seeds(study.findings())
    new_seeds = study.plan().seeds[-1] + 1
    options = f"--seeds {needs.n_seeds} --out results/judged/homing-{needs.n_seeds}"
    command_for_more = f"swarm-logistics judge homing --first-seed {new_seeds} {options}"
    assert f"{needs.words}." in " ".join(printed.split())
    assert (f"nobody has looked at: {command_for_more}" in printed) == bool(needs.n_seeds)
    last = printed.splitlines()[-1]
    assert last.startswith(f"{5 * len(study.plan().cases) - 1} runs played in ")
    assert "1 were kept" in last


@pytest.mark.daily
def test_a_policy_is_played_until_it_is_clear(command: Command) -> None:
    words = "judge judged_policy:Mine --processes 1 --seeds 30 --out"
    printed = command(f"{words} clear")
    assert Study.stored("clear").specification.until_clear
    # Nobody delivers: there is no ratio, and every question stops at the first look.
    line = (
        "P = 0 (at most 0.30 at 95 %, as none of 10 runs delivered anything) items in 20 s, N = 4"
    )
    assert line in " ".join(printed.split())
    assert "ndefined: it delivers nothing" in printed
    assert "40 runs played" in printed.splitlines()[-1]
    assert "120 runs played" in command(f"{words} all --all-seeds").splitlines()[-1]


def test_a_policy_that_fails_in_every_run_ends_with_code_1_and_a_report(command: Command) -> None:
    words = "--processes 1 --seeds 3 --out card"
    printed = command(f"judge judged_policy:Failing {words}", code=1)
    assert "P: no run has succeeded; 3 paired seeds" in " ".join(printed.split())
    *_, played, stopped = printed.splitlines()
    # Of 12: each of the four conditions at the first seed, and one of them at the next.
    assert "5 failed, the first with RuntimeError: no more" in played
    assert "Stopped, as nothing works" in stopped
    assert "the other 7 were not played" in stopped
    assert "judged_policy.py:8. The same command" in stopped
    assert "2 of 3 runs failed" in Path("card", "report.md").read_text()
    assert "failed" in command("judge judged_policy:Failing --benchmark --processes 1", code=1)
    error = command("judge judged_policy:Short --processes 1 --out short", code=2)
    assert "commands of shape (4, 3): should be (4, 4)" in error
    assert not Path("short").exists()


def test_a_policy_is_judged_by_how_fast_it_clears_the_warehouse_over_other_seeds(
    command: Command,
) -> None:
    world = "homing --clearing --set n_items=5"
    printed = command(f"judge {world} --seeds 3 --first-seed 500 --processes 1")
    assert ", all items after " in printed
    folder = Path("results/judged/homing-clearing-n-items-5-first-seed-500")
    assert " open: " in printed
    assert Study.stored(folder).plan().seeds == range(500, 503)
    report = (folder / "report.md").read_text()
    assert "Time until all items are delivered" in report
    assert "items delivered per minute" in report


def test_a_policy_is_judged_by_another_measure_of_the_same_runs(command: Command) -> None:
    world = "homing --performance longest_standstill:20 --set n_items=5 --set duration=20"
    printed = command(f"judge {world} --seeds 3 --processes 1")
    assert "P (longest_standstill:20)" in printed
    folder = Path("results/judged/homing-longest-standstill-20-n-items-5-duration-20")
    assert " open: " in printed
    report = (folder / "report.md").read_text()
    assert "x is the longest time without a delivery" in report
    assert "no measure 'late'" in command("judge homing --performance late", code=2)


@pytest.mark.daily
def test_a_policy_is_judged_on_other_bodies_and_floors(command: Command) -> None:
    Path("hall.toml").write_text("floor = 'two_docks'\nn_robots = 3\nduration = 5\n")
    command("judge homing --scenario hall.toml --bodies mujoco --seeds 3 --processes 1")
    folder = Path("results/judged/homing-scenario-hall-toml-bodies-mujoco")
    report = (folder / "report.md").read_text()
    assert "| bodies | mujoco (default chipmunk) |" in report
    assert "| floor | two_docks (default None) |" in report
    refused = command("judge homing --benchmark --bodies mujoco", code=2)
    assert "--bodies: the benchmark has" in refused


def test_a_policy_file_is_judged_in_the_world_in_which_it_was_trained(command: Command) -> None:
    training = """name = "mine"
agent_steps = 400
scenario = { warehouse_width = 4.0, warehouse_height = 3.0, delivery_width = 0.8, n_items = 6, duration = 10.0 }
worlds = [{ count = 2, n_robots = 10 }]
evaluation = { every = 400, seeds = 1, n_robots = 10 }
scores = { seeds = 0 }
ppo = { n_steps = 20, n_minibatches = 2 }
"""  # noqa: E501
    Path("mine.toml").write_text(training)
    command("train mine.toml")
    file = "results/train/mine/mine.safetensors"
    printed = command(f"judge {file} --seeds 3 --processes 1")
    assert "In the world in which mine was trained; --preset names another." in printed
    specification = Study.stored("results/judged/mine").specification
    world = specification.scenario
    assert isinstance(world, Scenario)
    assert (world.warehouse_width, world.n_robots) == (4.0, 10)
    assert world.restock  # so that P has no cap
    # Sizes and failures are in proportion to those of the scorecard: 2 and 4, 1 of 4.
    assert specification.sizes[0].values == (5, 10)
    assert specification.faults[0].robots == (2,)
    assert "10 robots" in command(f"run --policy {file}")
    assert "25 robots" in command(f"run --policy {file} --preset paper --set duration=1")


def test_a_policy_is_judged_in_a_world_of_a_preset_and_a_file(command: Command) -> None:
    Path("hall.toml").write_text("n_robots = 3\nn_items = 5\nduration = 5\n")
    printed = command("judge homing --preset dots --scenario hall.toml --seeds 3 --processes 1")
    folder = "results/judged/homing-preset-dots-scenario-hall-toml"
    assert f"kept in {folder}" in printed
    specification = Study.stored(folder).specification
    assert specification.scenario == Scenario.preset("dots").replace(
        n_robots=3, n_items=5, duration=5.0, restock=True
    )
    assert specification.faults[0].robots == (1,)
    refused = command("judge homing --benchmark --preset dots", code=2)
    assert "--preset: the benchmark has" in refused
    assert "--preset is not for a file of trials" in command(f"{TRIALS} --preset dots", code=2)


def test_the_benchmark_gives_a_table_and_a_place_and_goes_on(command: Command) -> None:
    printed = command("judge homing --benchmark --processes 1")
    assert "Worst cell, share " in printed
    assert "entries by score" in printed
    digest = benchmark_cells.entry_digest(PolicySpec.of("homing"))[:8]
    assert f"drawn from the policy's digest {digest}" in " ".join(printed.split())
    report = Path(f"results/benchmark/homing-{digest}/benchmark.md")
    assert "| swarm-dt | 0.59 [" in report.read_text()
    again = command("judge homing --benchmark --processes 1")
    assert "0 runs played" in again
    first, second = (text.split("entries")[1].split("Report:")[0] for text in (printed, again))
    assert first == second
