"""What commands and their workers import of the folder that they run in."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from swarm_logistics_env.core.current_folder import CurrentFolder
from tests.conftest import ROOT

# What libraries look for and do without, and what is started beside a program.
OPTIONAL = (
    "_winapi backports bottleneck brotli cffi colorama cython defusedxml dill gmpy2 h5py imageio "
    "ipykernel IPython jinja2 jnius lxml matplotlib_inline msvcrt numba_config numexpr openpyxl "
    "org pkg_resources psutil pyarrow pygame_ce pytz ray readline scikits sitecustomize sksparse "
    "simplejson tables tblib threadpoolctl uarray usercustomize ujson uvloop winreg xarray xlrd "
    "zstandard"
)
WRITES = "from pathlib import Path\nPath({!r}, __name__).touch()\n"
# As the installed script is started: the folder of the script is on the path, the current is not.
SCRIPT = """
import os, sys
from swarm_logistics_env.views.cli import app

if "NO_FIGURES" in os.environ:
    sys.modules["matplotlib"] = None
if __name__ == "__main__":
    for words in sys.argv[1:]:
        code = app.run(words.split())
        assert code == 0, words
"""
STUDY = """
name = "small"
policies = ["swarm-dt"]
seeds = 2
faults = [{ modes = ["FM1"], robots = [1] }]
[scenario]
n_robots = 3
duration = 5.0
"""
TRIALS = (
    "robots;fault;faulty;boxes\n8;none;;12\n8;none;;11\n8;none;;13\n"
    "8;wheel;1;10\n8;wheel;1;9\n8;wheel;1;11"
)


def run_in(folder: Path, *commands: str, **variables: str) -> str:
    """Run commands in one process, in `folder`; return what was printed."""
    script = folder.parent / "script.py"
    script.write_text(SCRIPT)
    ended = subprocess.run(
        [sys.executable, str(script), *commands],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **variables},
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of a study, of trials and of hostile modules, each of which leaves a mark."""
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "marks").mkdir()
    names = {*sys.stdlib_module_names, *packages_distributions(), *OPTIONAL.split()}
    for name in names:
        if name.isidentifier():
            (folder / f"{name}.py").write_text(WRITES.format(str(tmp_path / "marks")))
    (folder / "small.toml").write_text(STUDY)
    (folder / "trials.csv").write_text(TRIALS)
    return folder


def marks(folder: Path) -> list[str]:
    return sorted(mark.name for mark in (folder.parent / "marks").iterdir())


@pytest.mark.daily
def test_commands_and_their_workers_import_nothing_of_the_current_folder(folder: Path) -> None:
    (folder / ".numba_config.yaml").write_text("CACHE_DIR: compiled\n")
    run_in(
        folder,
        "judge trials.csv --column performance=boxes --out judged",
        "run --set duration=5 --policy ppo-delivery",
        "run --set duration=5 --until 1 --speed 8 --film run.gif",
        "list policies",
        "study plan quick",
        "study run small.toml --processes 2 --out out",
        "watch --save page.html --until 2",
    )
    assert marks(folder) == []
    assert not (folder / "compiled").exists()


# pandas looks for more than it needs, here at each of its moments.
OWN = """
import mark_at_import
import numpy as np

class Mine:
    def reset(self, n_robots, seed):
        import mark_at_reset
    def act(self, observations):
        import mark_in_act
        import pandas
        return np.zeros((len(observations), 4))
"""
LANE = """
from swarm_logistics_env.study.tasks import ParallelTask
from neighbour import Idle, make_env

HERE = ParallelTask(make_env, name="here", n_robots=2, steps=5, policies={"idle": Idle})
"""
NEIGHBOUR = """
from tests.study.tasks.lane import Lane

def make_env(n_robots):
    return Lane(n_robots)

class Idle:
    identity = "idle"
    def act(self, observations):
        import mark_in_lane
        return [0] * len(observations)
"""
LANE_STUDY = """
name = "lane"
task = "own_lane:HERE"
policies = ["idle"]
seeds = 2
sizes = [{ values = [2, 3] }]
"""


@pytest.mark.daily
def test_what_is_named_finds_its_neighbours_whenever_it_and_its_workers_import_them(
    folder: Path,
) -> None:
    for name in ("mark_at_import", "mark_at_reset", "mark_in_act", "mark_in_lane", "mark_unnamed"):
        (folder / f"{name}.py").write_text(WRITES.format(str(folder.parent / "marks")))
    for name, text in (("own_policy", OWN), ("own_lane", LANE), ("neighbour", NEIGHBOUR)):
        (folder / f"{name}.py").write_text(text)
    (folder / "lane.toml").write_text(LANE_STUDY)
    printed = run_in(
        folder,
        "run --set duration=1 --policy own_policy:Mine",
        "study run small.toml --processes 2 --policy own_policy:Mine --out policy",
        "study run lane.toml --trust-code --processes 2 --out task",
        NO_FIGURES="1",
    )
    assert marks(folder) == ["mark_at_import", "mark_at_reset", "mark_in_act", "mark_in_lane"]
    assert printed.count(" 0 failed") == 2
    assert "4 runs played" in printed


def test_an_installed_module_that_was_named_finds_nothing_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "optional_one.py").touch()
    finder = CurrentFolder()
    finder.allowed = {__name__.partition(".")[0]}
    assert finder.find_spec("optional_one", None) is None
    finder.allowed = {"optional_one"}
    assert finder.find_spec("optional_one", None) is not None
    assert finder.imported == {"optional_one"}


@pytest.mark.daily
def test_a_script_finds_what_python_finds(tmp_path: Path) -> None:
    current, script = tmp_path / "here", tmp_path / "script.py"
    current.mkdir()
    (current / "own_policy.py").write_text(OWN.replace("import mark_at_import", ""))
    script.write_text(
        "import sys\n"
        "from swarm_logistics_env import policies\n"
        "finders = [*sys.meta_path]\n"
        "try:\n"
        "    print(policies.load('own_policy:Mine'))\n"
        "finally:\n"
        "    assert finders == sys.meta_path\n"
    )
    for words, expected in (
        ([str(script)], "ModuleNotFoundError: No module named 'own_policy'"),
        (["-m", "script"], "Mine object"),  # which has the current folder on its path
    ):
        env = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)])}
        command = [sys.executable, *words]
        ended = subprocess.run(command, cwd=current, env=env, capture_output=True, text=True)
        assert expected in ended.stdout + ended.stderr
