"""Errors, help, `list` and `run`."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import swarm_logistics_env
from swarm_logistics_env import Scenario, policies
from swarm_logistics_env.study.questions.presets import PRESETS
from swarm_logistics_env.study.report.section import Section
from swarm_logistics_env.train import preset_names
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.views.cli.app import command_line
from swarm_logistics_env.views.cli.terminal import show
from swarm_logistics_env.views.cli.world_choice import changed_fields
from swarm_logistics_env.world.warehouse import FAILURE_MODES
from tests.views.cli.conftest import Command

FIELDS = ("n_robots=3", "n_items=4", "warehouse_width=3", "warehouse_height=3", "duration=20")
SMALL = " ".join(f"--set {field}" for field in (*FIELDS, "delivery_width=1"))


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("fly", "fly"),
        ("run --policy a\x1b[31m\udc80", r"'a\x1b[31m\udc80'"),
        ("run --policy swarm-td", "did you mean 'swarm-dt'?"),
        ("run --set n_robot=40", "did you mean 'n_robots'?"),
        ("run --scenario n\x1b]0;x\x07", r"--scenario n\x1b]0;x\x07: No such file"),
        ("run --fault fm4", "did you mean 'FM4' or 'FM4_jam'?"),
        ("run --fault FM1:2@500", "should begin before the episode ends at 500 s"),
        ("run --film nowhere/film.mp4", "a folder that can be written to"),
        ("run --film film.mp4 --twin", "--fault should be given"),
        ("run --twin", "are for a film, with --film"),
        ("watch --show-fault --preset paper", "--show-fault: has a world, policy and fault of its"),
        ("watch --until 5", "--until 5: should be above 0 s, together with --save"),
        ("watch --save nowhere/x.html", "should be a file in a folder that can be"),
        ("run --set scenario.duration=2", "'scenario.duration'; did you mean 'duration'?"),
        ("run --set =2", "--set =2: should be FIELD=VALUE"),
        ("run --set duration=2 --set duration=4", "--set duration=4: duration is set twice"),
        ("run --set bodies=mujoco --bodies dotbots", "bodies is set twice: should be set once"),
        ("run --set duration=true", "Scenario.duration = True: should have a number, not a bool"),
        ("run --set floor=aisle", "rows of a plan; did you mean 'aisles'?"),
        ("list robots", "'robots' is not one of 'policies', 'trainings', 'faults', 'studies'"),
        ("study plan quick --policy nobody", "'nobody'"),
        ("study plan quick --policy model.zip", "--policy model.zip: reading a model of stable"),
        ("study report nowhere", "no study in nowhere"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    words: str, reason: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert app.run(words.split()) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert reason in printed.err
    assert len(printed.err.splitlines()) == 1
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(
    ("changes", "fields"),
    [
        (["duration = 2"], {"duration": 2}),
        (["duration=1_0", "max_speed=+1.5"], {"duration": 10, "max_speed": 1.5}),
        (["speed_mix = [1.0, 0.5]", "floor=null"], {"speed_mix": [1.0, 0.5], "floor": None}),
        (["floor = aisles", "bodies='mujoco'"], {"floor": "aisles", "bodies": "mujoco"}),
        (["floor=::A\n:::", "name=2026-01-01"], {"floor": "::A\n:::", "name": "2026-01-01"}),
    ],
)
def test_values_are_those_of_json_and_toml(changes: list[str], fields: dict[str, Any]) -> None:
    assert changed_fields(changes, None) == fields


def test_it_offers_no_completion_of_shells(command: Command) -> None:
    assert "completion" not in command("--help")


def test_an_error_of_usage_is_a_line_and_names_the_help(command: Command) -> None:
    missing = command("list", code=2)
    choices = "policies, trainings, faults, studies, scenario"
    assert missing.rstrip().endswith(f"Choose from: {choices}. Help: swarm-logistics list --help")
    assert "Help: swarm-logistics run --help" in command("run --sed 3", code=2)


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "module",
    [
        "swarm_logistics_env",
        pytest.param("swarm_logistics_env.views.cli", marks=pytest.mark.daily),
    ],
)
def test_the_package_is_the_command(module: str) -> None:
    words = [sys.executable, "-m", module, "--version"]
    printed = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert printed.strip() == swarm_logistics_env.__version__


def test_fault_of_ours_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(Scenario, "conditions")
    with pytest.raises(AttributeError):
        app.run(["list", "scenario"])


def test_who_stops_a_command_before_it_begins_hears_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules[type(app).__module__], "command_line", stop)
    assert app.run(["list", "scenario"]) == 130
    assert capsys.readouterr().err == "swarm-logistics: stopped\n"


def test_the_process_ends_with_its_commands_code_and_without_a_notebooks_backend(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    module = sys.modules[type(app).__module__]
    monkeypatch.setattr(module, "prepare_output", lambda: None)
    monkeypatch.setattr(module.gc, "freeze", lambda: None)
    monkeypatch.setattr(sys, "argv", ["swarm-logistics", "list", "robots"])
    monkeypatch.setenv("MPLBACKEND", "module://of_a_notebook")
    with pytest.raises(SystemExit) as end:
        app()
    assert end.value.code == 2
    assert "'robots' is not one of" in capsys.readouterr().err
    assert "MPLBACKEND" not in os.environ


def command_lines(command: Any, *names: str) -> Iterator[tuple[list[str], Any]]:
    yield [*names, "--help"], command
    for name, below in getattr(command, "commands", {}).items():
        yield from command_lines(below, *names, name)


@pytest.mark.parametrize(("words", "parsed"), list(command_lines(command_line())))
def test_a_help_page_shows_each_help_text_in_full(
    words: list[str], parsed: Any, command: Command
) -> None:
    page = "".join(command(" ".join(words)).split())
    for text in [parsed.help, *(getattr(parameter, "help", "") for parameter in parsed.params)]:
        assert "".join((text or "").split()) in page
    assert words != ["study", "run", "--help"] or ",".join(PRESETS) in page
    is_group = hasattr(parsed, "commands")  # in which no command's sentence is cut
    assert not is_group or page.count("...") == 1
    assert words != ["study", "--help"] or page == "".join(command("study").split())


OWN = """
import numpy as np

class Lazy:
    def reset(self, n_robots, seed): ...
    def act(self, observations): return np.zeros((len(observations), 4))
class Torn(Lazy):
    def act(self, observations): raise ZeroDivisionError('the motor is gone')
def stop(observations): raise ZeroDivisionError('the motor is gone')
class Generated(Lazy):
    exec("def act(self, observations): return stop(observations)")
class Leaving(Lazy):
    def act(self, observations): raise SystemExit(0)
class Unmade(Lazy):
    def __init__(self): {}['gain']
"""


def test_a_policy_of_ones_own_that_cannot_be_made_is_one_sentence(
    command: Command, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("own_policy.py").write_text(OWN)
    for name, reason in (
        ("own_policy:Unmade", "'own_policy:Unmade' cannot be made: KeyError: 'gain'"),
        ("own_policy:Laxy", "'own_policy:Laxy': own_policy has no Laxy"),
        ("own_policy", "no policy 'own_policy' (a name, 'my.py:Class', 'package.module:Class'"),
    ):
        assert reason in command(f"run --policy {name} {SMALL}", code=2)
    # Its traceback says where, without the frames that called it.
    for name in ("Torn", "Generated"):
        assert app.run(f"run --policy own_policy:{name} {SMALL}".split()) == 1
        printed = capsys.readouterr().err.splitlines()
        assert printed[-1] == "ZeroDivisionError: the motor is gone"
        (frame,) = [line for line in printed if line.startswith("  File")]
        assert "own_policy.py" in frame
    with pytest.raises(RuntimeError, match=r"called sys.exit\(\)"):
        command(f"run --policy own_policy:Leaving {SMALL}")


def test_policy_of_ones_own_is_found_where_the_command_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "lazy_policy.py").write_text(OWN)
    # As the installed script is started: without the folder it is run in.
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "deep_policy.py").write_text(OWN)
    for name in ("lazy_policy:Lazy", "deep/deep_policy.py:Lazy"):
        assert app.run(["run", "--policy", name, *SMALL.split()]) == 0
        assert "P = 0 items" in capsys.readouterr().out


def test_a_scenario_is_read_from_a_file(command: Command) -> None:
    Path("small.json").write_text(command(f"list scenario {SMALL} --json"))
    *expected, _ = command(f"run {SMALL}").splitlines()
    *printed, _ = command("run --scenario small.json").splitlines()
    assert printed == expected
    # --set has the last word, and the file goes before --preset.
    Path("dots.toml").write_text("preset = 'dots'\nn_robots = 7\nn_items = 9\n")
    options = "--preset realistic --scenario dots.toml --set n_items=8"
    scenario = Scenario.from_json(command(f"list scenario --json {options}"))
    assert scenario == Scenario.preset("dots").replace(n_robots=7, n_items=8)
    # none is what a field may be without, and a text where it may be that.
    options = "--preset day --set battery=none --set floor=none --set robot_kinds=none"
    scenario = Scenario.from_json(command(f"list scenario --json {options} --set relay=none"))
    assert scenario == Scenario.preset("day").replace(battery=None, floor=None, robot_kinds=())


def test_scenario_faults_studies_policies_and_trainings_are_listed(command: Command) -> None:
    assert "| n_robots | 40 (default 25) |" in command("list scenario --set n_robots=40")
    assert "| paper | 20 | 680 | Table I: scalability; " in command("list studies")
    for what, names in (
        ("faults", [*FAILURE_MODES]),
        ("trainings", [*preset_names()]),
        ("studies", [*PRESETS]),
        ("policies", [*policies.NAMES]),
    ):
        printed = command(f"list {what}")
        assert [name for name in names if f"| {name} | " not in printed] == []


def test_run_prints_what_the_episode_gave(command: Command) -> None:
    outputs = [command(f"run --seed 1 {SMALL} --fault FM1:2@5") for _ in range(2)]
    for words in ("P = ", " items delivered of 4 in ", "seed 1", "failed robots ", "real time"):
        assert words in outputs[0]
    assert outputs[1].splitlines()[:-1] == outputs[0].splitlines()[:-1]
    # Items that come back have no number.
    assert " items delivered in 20 s" in command(f"run {SMALL} --set restock=true")


def test_version_and_no_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert app.run(["--version"]) == 0
    assert capsys.readouterr().out.strip() == swarm_logistics_env.__version__
    assert app.run([]) == 0
    printed = capsys.readouterr()
    assert "Commands" in printed.out
    assert printed.err == ""


def test_no_number_is_cut_at_a_narrow_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes the output for a terminal
    monkeypatch.setenv("COLUMNS", "30")
    value = "123.4567[122.1234,125.9876]"
    show(Section("P", ("policy", "P", "R"), (("swarm-dt-follow", value, value),), ("* [best]",)))
    printed = capsys.readouterr().out
    assert "\n* [best]\n" in printed
    assert "…" not in printed
    for digits in "123456789":
        assert printed.count(digits) >= 2 * value.count(digits)
