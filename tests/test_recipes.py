"""The recipes of CONTRIBUTING.md, each followed in a copy of the package."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import swarm_logistics_env
from swarm_logistics_env import kernels, policies

PACKAGE = Path(swarm_logistics_env.__file__).parent
PAGE = (PACKAGE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")

POLICY = """
import numpy as np


class Circles:
    def reset(self, n_robots, seed):
        self.n_robots = n_robots

    def act(self, observations):
        return np.tile([1.0, 0.0, 0.5, 1.0], (self.n_robots, 1))
"""

WRAPPER = """
import numpy as np

from swarm_logistics_env.wrappers.wrapper import Wrapper


class HalfSpeed(Wrapper):
    def before_step(self, commands):
        return np.asarray(commands) * [0.5, 0.5, 1.0, 1.0]
"""

DRIVES = """
import numpy as np
from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.wrappers import HalfSpeed

speeds = []
for wrap in (lambda env: env, HalfSpeed):
    env = wrap(swarm_logistics_v0.parallel_env(n_robots=1, max_speed=1.0, duration=1.0))
    env.reset_arrays(seed=0)
    for _ in range(5):
        env.step_arrays(np.array([[1.0, 0.0, 0.0, 0.0]]))
    speeds.append(np.linalg.norm(env.unwrapped.warehouse.state.robot_velocity))
assert abs(speeds[1] / speeds[0] - 0.5) < 0.05, speeds
"""


class Copy:
    """A copy of the package in which a recipe is followed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.package = folder / PACKAGE.name
        shutil.copytree(PACKAGE, self.package, ignore=_other_caches)
        self.changed: set[str] = set()

    def write(self, name: str, text: str) -> None:
        assert not (self.package / name).exists()
        (self.package / name).write_text(text, encoding="utf-8")
        self.changed.add(name)

    def insert(self, name: str, mark: str, text: str) -> None:
        """Insert lines before the one that begins with `mark`."""
        file = self.package / name
        before, found, after = file.read_text(encoding="utf-8").partition(f"\n{mark}")
        assert found, f"{name} has no line that begins with {mark}"
        file.write_text(f"{before}\n{text}{found}{after}", encoding="utf-8")
        self.changed.add(name)

    def run(self, *arguments: str) -> str:
        """Run Python with the copy as the package, and return what it printed."""
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "PYTHONWARNINGS": "error"}
        done = subprocess.run(
            [sys.executable, *arguments],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def command(self, *arguments: str) -> str:
        small = ("--set", "n_robots=3", "--set", "n_items=4", "--set", "duration=5")
        return self.run("-c", "from swarm_logistics_env.cli import app; app()", *arguments, *small)


def _other_caches(folder: str, names: list[str]) -> set[str]:
    """Leave out compiled kernels of other versions, and files that are being written."""
    caches = {name for name in names if Path(folder).name == "__pycache__"}
    return {name for name in caches if kernels._SOURCES not in name or ".tmp." in name}


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    return Copy(tmp_path)


def files_of(recipe: str, name: str) -> set[str]:
    """The files that a recipe says it changes, `NAME` filled in."""
    found = re.search(rf"### {recipe}\n\nFiles: (.*)\n", PAGE)
    assert found
    return {file.replace("NAME", name) for file in re.findall(r"`([^`]+)`", found[1])}


def test_a_policy(copy: Copy) -> None:
    copy.write("policies/circles.py", POLICY)
    copy.insert(
        "policies/loading.py",
        "from swarm_logistics_env.policies.homing",
        "from swarm_logistics_env.policies.circles import Circles",
    )
    copy.insert("policies/loading.py", '    "homing": ', '    "circles": Circles,')
    assert "with circles, seed 0" in copy.command("run", "--policy", "circles")
    assert copy.changed == files_of("A policy", "circles")
    script = "from swarm_logistics_env import policies as p; print(p.identity(p.load('swarm-dt')))"
    assert copy.run("-c", script).strip() == policies.identity(policies.load("swarm-dt"))


def test_a_wrapper(copy: Copy) -> None:
    copy.write("wrappers/half_speed.py", WRAPPER)
    copy.insert(
        "wrappers/__init__.py",
        "from swarm_logistics_env.wrappers.indicator_reward",
        "from swarm_logistics_env.wrappers.half_speed import HalfSpeed",
    )
    copy.insert("wrappers/__init__.py", '    "IndicatorReward",', '    "HalfSpeed",')
    copy.run("-c", DRIVES)
    assert copy.changed == files_of("A wrapper", "half_speed")


def test_a_failure_mode(copy: Copy) -> None:
    row = '    "weak": FailureMode("drives slowly and lifts nothing", speed=0.2, lifts=False),'
    copy.insert("warehouse/faults.py", '    "dead": ', row)
    printed = copy.command("run", "--fault", "weak:2@1")
    assert "failed robots " in printed
    assert copy.changed == files_of("A failure mode", "weak")
