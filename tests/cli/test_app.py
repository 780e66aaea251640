from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import swarm_logistics_env
from swarm_logistics_env import SCENARIO_PRESETS, Scenario, policies
from swarm_logistics_env.cli import app
from swarm_logistics_env.cli.app import command_line
from swarm_logistics_env.cli.terminal import show
from swarm_logistics_env.report.section import Section
from swarm_logistics_env.studies.presets import PRESETS
from swarm_logistics_env.train import preset_names
from swarm_logistics_env.warehouse import FAILURE_MODES

SMALL = [
    *("--set", "n_robots=3"),
    *("--set", "n_items=4"),
    *("--set", "warehouse_width=3"),
    *("--set", "warehouse_height=3"),
    *("--set", "delivery_width=1"),
    *("--set", "duration=20"),
]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "--seed", "x"], "valid integer"),
        (["run", "\n"], "extra argument"),
        (["run", "--policy", "a\x1b[31m\udc80"], r"'a\x1b[31m\udc80'"),
        (["run", "--set", "n_robot=40"], "did you mean 'n_robots'?"),
        (["run", "--fault", "fm4"], "did you mean 'FM4' or 'FM4_jam'?"),
        (["run", "--scenario", "none.toml"], "--scenario none.toml: No such file"),
        (["run", "--scenario", "n\x1b]0;x\x07"], r"--scenario n\x1b]0;x\x07: No such file"),
        (["run", "--policy", "swarm-td"], "did you mean 'swarm-dt'?"),
        (["run", "--fault", "FM1:2@500"], "should begin before the episode ends at 500 s"),
        (["run", "--film", "x.gif", "--fault", "FM1@900"], "should begin before the episode ends"),
        (["run", "--film", "film.avi"], "should end in .mp4 or .gif"),
        (["run", "--film", "nowhere/film.mp4"], "a folder that can be written to"),
        (["run", "--film", "film.mp4", "--twin"], "--fault should be given"),
        (["run", "--film", "film.mp4", "--speed", "0"], "speed = 0"),
        (
            ["run", "--film", "x.mp4", *["--policy", "homing"] * 3, "--fault", "FM1", "--twin"],
            "1 to 4",
        ),
        (["run", "--twin"], "are for a film, with --film"),
        (["run", "--policy", "homing", "--policy", "swarm-dt"], "several --policy: are for a film"),
        (["watch", "--speed", "3"], "speed = 3: should be one of"),
        (["watch", "--port", "99999"], "--port"),
        (["watch", "--until", "5"], "--until 5: should be above 0 s, together with --save"),
        (["watch", "--save", "nowhere/x.html"], "should be a file in a folder that can be"),
        (["list", "scenario", "--set", "delivery_width=10"], "leaves no storage"),
        (["study", "run", "quick", "--out", "x", "--shard", "0/2"], "i/n with i from 1 to n"),
        (["study", "run", "quick", "--out", "x", "--engine", "slurm"], "no engine 'slurm'"),
        (["study", "compare", "nowhere", "nowhere", "--fail-if", "R"], "should be [possibly]"),
        (["list", "robots"], "list robots: should be policies, trainings, faults, studies"),
        (["study", "plan", "quick", "--policy", "nobody"], "'nobody'"),
        (["study", "report", "nowhere"], "no study in nowhere"),
        (["fly"], "fly"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.run(arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert words in printed.err
    assert len(printed.err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_fault_of_ours_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(Scenario, "conditions", broken)
    with pytest.raises(ZeroDivisionError):
        app.run(["list", "scenario"])


def command_lines(command: Any, *names: str) -> Iterator[tuple[list[str], Any]]:
    yield [*names, "--help"], command
    for name, below in getattr(command, "commands", {}).items():
        yield from command_lines(below, *names, name)


@pytest.mark.parametrize(("arguments", "command"), list(command_lines(command_line())))
def test_a_help_page_shows_each_help_text_in_full(
    arguments: list[str],
    command: Any,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    assert app.run(arguments) == 0
    page = " ".join(capsys.readouterr().out.split())
    for text in [command.help, *(getattr(one, "help", "") for one in command.params)]:
        assert " ".join((text or "").split()) in page


OWN_FILES = {
    "own_faulty.py": (
        "import math\n"
        "class Torn:\n"
        "    def reset(self, n_robots, seed): ...\n"
        "    def act(self, observations): return self.move()\n"
        "    def move(self):\n"
        "        raise ZeroDivisionError('the motor\\nis gone')\n"
        "class Short(Torn):\n"
        "    def reset(self, n_robots): ...\n"
        "class Unmade(Torn):\n"
        "    def __init__(self): {}['gain']\n"
    ),
    "unread.py": "class Torn(:\n",
    "mine.py": "1 / 0\nclass Slow:\n    def act(self, observations): ...\nclass Helper: ...\n",
    "empty.py": "class Helper: ...\n",
}


@pytest.mark.parametrize(
    ("policy", "words"),
    [
        ("own_faulty:Torn", "ZeroDivisionError: the motor is gone ("),
        ("own_faulty:Torn", "own_faulty.py, line 6)"),
        ("own_faulty:Short", "TypeError: Short.reset() takes 2 positional arguments but 3 were"),
        ("own_faulty:Unmade", "'own_faulty:Unmade' cannot be made: KeyError: 'gain'"),
        ("folder/own_faulty.py:Torn", "should be MODULE:CLASS, as 'own_faulty:Torn'"),
        ("unread:Torn", "'unread:Torn' cannot be imported: SyntaxError"),
        ("own_faulty:Tron", "has no attribute 'Tron': should name its class, 'own_faulty:Torn'"),
        ("mine.py", "should name its class, 'mine:Slow'"),
        ("mine", "should name its class, 'mine:Slow'"),
        ("empty.py", "empty.py has no class with a method act"),
        ("none.py", "no policy 'none.py' (a name, 'package.module:Class' or a file); known: "),
    ],
)
def test_what_is_wrong_with_a_policy_of_ones_own_is_one_sentence(
    policy: str,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name, text in OWN_FILES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert app.run(["run", "--policy", policy, *SMALL]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert words in said


def test_a_scenario_is_read_from_a_file_wherever_fields_are_set(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.run(["list", "scenario", *SMALL, "--json"]) == 0
    Path("small.json").write_text(capsys.readouterr().out)
    assert app.run(["run", *SMALL]) == 0
    expected = capsys.readouterr().out.splitlines()[:-1]
    assert app.run(["run", "--scenario", "small.json"]) == 0
    assert capsys.readouterr().out.splitlines()[:-1] == expected
    # --set has the last word, and the file goes before --preset.
    Path("dots.toml").write_text("preset = 'dots'\nn_robots = 7\nn_items = 9\n")
    given = ["--preset", "realistic", "--scenario", "dots.toml", "--set", "n_items=8"]
    assert app.run(["list", "scenario", "--json", *given]) == 0
    wanted = Scenario.preset("dots").replace(n_robots=7, n_items=8)
    assert Scenario.from_json(capsys.readouterr().out) == wanted
    for text, words in (("n_robots = [", "is not TOML"), ("robots = 7", "'n_robots'?")):
        Path("bad.toml").write_text(text)
        assert app.run(["run", "--scenario", "bad.toml"]) == 2
        assert words in capsys.readouterr().err
    commands: Any = command_line()
    for name, command in commands.commands.items():
        options = {option for parameter in command.params for option in parameter.opts}
        assert ("--scenario" in options) == ("--set" in options), name


def test_scenario_faults_studies_policies_and_presets_are_listed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert app.run(["list", "scenario", "--set", "n_robots=40"]) == 0
    printed = capsys.readouterr().out
    assert "| n_robots | 40 (default 25) |" in printed
    assert "https://arxiv.org/abs/2311.01944" in printed  # whose defaults these are
    preset = ["list", "scenario", "--preset", "paper_scalability", "--json"]
    assert app.run(preset) == 0
    assert Scenario.from_json(capsys.readouterr().out) == Scenario.preset("paper_scalability")
    for what, names in (
        ("faults", FAILURE_MODES),
        ("trainings", preset_names()),
        ("studies", PRESETS),
    ):
        assert app.run(["list", what]) == 0
        printed = capsys.readouterr().out
        assert all(f"| {name} | " in printed for name in names)
    assert "| paper | 20 | 680 | Table I: scalability; " in printed
    assert app.run(["list", "policies"]) == 0
    printed = capsys.readouterr().out
    for name in policies.NAMES:
        (row,) = [line for line in printed.splitlines() if line.startswith(f"| {name} |")]
        assert len(row.split(" | ")[2]) > 10
    for command, presets in (
        (["run"], SCENARIO_PRESETS), (["study", "run"], PRESETS), (["train"], preset_names())
    ):  # fmt: skip
        monkeypatch.setenv("COLUMNS", "400")
        assert app.run([*command, "--help"]) == 0
        assert ", ".join(presets) in capsys.readouterr().out


def test_run_prints_what_the_episode_gave(capsys: pytest.CaptureFixture[str]) -> None:
    told = []
    for _ in range(2):
        assert app.run(["run", "--seed", "1", *SMALL, "--fault", "FM1:2@5"]) == 0
        told.append(capsys.readouterr().out)
    for words in ("P = ", "seed 1", "failed robots ", "times real time"):
        assert words in told[0]
    assert told[1].splitlines()[:-1] == told[0].splitlines()[:-1]


def test_policy_of_ones_own_is_found_where_the_command_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "lazy_policy.py").write_text(
        "import numpy as np\n"
        "class Lazy:\n"
        "    def reset(self, n_robots, seed):\n"
        "        self.n_robots = n_robots\n"
        "    def act(self, observations):\n"
        "        return np.zeros((self.n_robots, 4))\n"
    )
    # As the installed script is started: without the folder it is run in.
    monkeypatch.setattr(sys, "path", [path for path in sys.path if path])
    monkeypatch.chdir(tmp_path)
    assert app.run(["run", "--policy", "lazy_policy:Lazy", *SMALL]) == 0
    assert "P = 0 items" in capsys.readouterr().out


def test_version_and_the_number_of_items_only_where_they_do_not_come_back(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert app.run([]) == 2  # without a command it prints its help and nothing else
    printed = capsys.readouterr()
    assert "Commands" in printed.out
    assert printed.err == ""
    assert app.run(["--version"]) == 0
    assert capsys.readouterr().out.strip() == swarm_logistics_env.__version__
    for restock, words in (("false", "delivered of 4 in 20 s"), ("true", "delivered in 20 s")):
        assert app.run(["run", *SMALL, "--set", f"restock={restock}"]) == 0
        assert f" items {words}" in capsys.readouterr().out


def test_no_number_is_cut_at_a_narrow_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes the output for a terminal
    monkeypatch.setenv("COLUMNS", "30")
    value = "123.4567[122.1234,125.9876]"
    show(Section("P", ("policy", "P", "R"), (("swarm-dt-follow", value, value),)))
    printed = capsys.readouterr().out
    assert "…" not in printed
    for digits in "123456789":
        assert printed.count(digits) >= 2 * value.count(digits)
