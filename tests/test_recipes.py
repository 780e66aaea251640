"""The recipes of CONTRIBUTING.md, each followed in a copy of the package."""

from __future__ import annotations

import itertools
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import pytest

import swarm_logistics_env
from swarm_logistics_env import policies

PACKAGE = Path(swarm_logistics_env.__file__).parent
ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")

# After a recipe's heading stand the names that it leaves open; after a file's name the beginning of
# the line before which lines go in, or nothing: it is a new file.
RECIPES = """
### A policy NAME=circles
@ policies/circles.py
import numpy as np


class Circles:
    def reset(self, n_robots, seed): ...

    def act(self, observations):
        return np.tile([1.0, 0.0, 0.5, 1.0], (len(observations), 1))
@ policies/catalogue.py @from swarm_logistics_env.policies.homing
from swarm_logistics_env.policies.circles import Circles
@ policies/catalogue.py @    "homing":
    "circles": Circles,
### A wrapper NAME=half_speed
@ wrappers/half_speed.py
import numpy as np

from swarm_logistics_env.wrappers.wrapper import Wrapper


class HalfSpeed(Wrapper):
    def before_step(self, commands):
        return np.asarray(commands) * [0.5, 0.5, 1.0, 1.0]
@ wrappers/__init__.py @from .indicator_reward
from .half_speed import HalfSpeed
@ wrappers/__init__.py @    "IndicatorReward",
    "HalfSpeed",
### A failure mode
@ world/warehouse/failure_modes.py @    "dead":
    "weak": FailureMode("drives slowly and lifts nothing", speed=0.2, lifts=False),
### A reward term
@ environment/reward_terms.py @class Moment(
PRESENCE = 10
@ environment/reward_terms.py @    elif wanted == OWN_DELIVERY:
    elif wanted == PRESENCE:
        presence(world, payment, earned)
@ environment/reward_terms.py @REWARD_TERMS:
@engine_kernel
def presence(world, payment, earned):
    earned[:] = 1.0
@ environment/reward_terms.py @}
    "presence": presence,
### An indicator
@ spi/definitions.py @def scalability(
def kept(p_o, p_f, **asked):
    terms = {"p_f": (p_f, 1.0), "p_o": (p_o, 0.0)}
    return estimate_ratio("K", terms, offset=0.0, **asked)
@ spi/definitions.py @        Definition(
        Definition(
            symbol="K", heading="performance kept K", compares="fault", function=kept,
            performances={"p_o": "P_o", "p_f": "P_F"}, arguments=lambda _: {},
            adjectives={0.0: "alive"},
            at_zero="K = 0: nothing is kept",
        ),
### A kind of trial files NAME=log_lines
@ study/trials/readers/log_lines.py
from swarm_logistics_env.study.trials.table import Table


def read(path, content, digest):
    if path.suffix != ".log":
        return None
    lines = content.decode().splitlines()
    cells = [[part.partition(":")[2] for part in line.split()] for line in lines]
    header = [part.partition(":")[0] for part in lines[0].split()]
    return Table(str(path), digest, header, cells, range(1, len(cells) + 1))
### A task NAME=lane
@ study/tasks/lane_task.py
from tests.study.tasks.lane import LANE
@ study/tasks/task.py @    "clearing":
    "lane": "swarm_logistics_env.study.tasks.lane_task:LANE",
### A scenario parameter READER=world/warehouse/sensing
@ world/scenario/fields.py @    item_radius:
    odometry_scale: Positive = Field(1.0, description="factor of velocities; off")
@ world/warehouse/structs.py @    n_substeps:
    odometry_scale: float
@ world/warehouse/sensing.py @    limit = parameters.highest_speed
    forward *= parameters.odometry_scale
    left *= parameters.odometry_scale
### An observation column SENSE=sensing
@ world/observations.py @MESSAGES =
SPEED = TURN_RATE + 1
N_COLUMNS = SPEED + 1
@ world/observations.py @        *_messages(scenario)
        Column("speed", "m/s", _run(SPEED, 1), 0, speed, "without direction", "odometry"),
@ world/warehouse/sensing.py @    out[row.CONTACT] =
    out[row.SPEED] = math.hypot(out[row.VELOCITY], out[row.VELOCITY + 1])
"""
# File, the line before which lines go in, and these, by heading and open names of the recipe.
EDITS = {
    heading: re.findall(r"^@ (\S+)(?: @(.*))?\n((?:(?!@ ).*\n)+)", edits, flags=re.MULTILINE)
    for heading, edits in re.findall(r"### (.*)\n((?:(?!###).*\n)+)", RECIPES)
}
# What these add is read by kernels.
KERNEL_RECIPES = ("A scenario parameter", "An observation column")

# The interpreter runs the kernels, as compiling takes longer.
INTERPRETED = """
from pathlib import Path

import numpy as np

np.seterr(over="ignore", divide="ignore")
"""

CHECK_POLICIES_AND_STUDIES = """
from swarm_logistics_env import Scenario, policies, run_episode, swarm_logistics_v0
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.study import read_trials
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.wrappers import HalfSpeed, IndicatorReward

small = Scenario(n_robots=3, n_items=4, duration=5.0)
assert len(run_episode(small, policies.load("circles"), 0, ["weak:2@1"]).failed_robots) == 2

speeds = []
for wrap in (lambda env: env, HalfSpeed):
    env = wrap(swarm_logistics_v0.parallel_env(n_robots=1, rewards={"presence": 0.5}))
    env.reset_arrays(seed=0)
    for _ in range(5):
        assert list(env.step_arrays(np.array([[0.5, 0.0, 0.0, 0.0]]))[1]) == [0.5]
    speeds.append(np.linalg.norm(env.unwrapped.warehouse.state.robot_velocity))
assert abs(speeds[1] / speeds[0] - 0.5) < 0.05, speeds

fault = {"modes": ["FM4"], "robots": [1]}
study = Study(seeds=2, scenario=small.model_dump(), faults=[fault], indicators=["K"])
study.run(engine="local")
study.report(Path())
assert "performance kept K; above " in Path("report.md").read_text()
try:
    IndicatorReward(swarm_logistics_v0.parallel_env(), "K", references=33.0)
except SetupError as error:
    assert str(error) == "no indicator 'K' is paid; known: A, FT, P, R, S", error
else:
    raise AssertionError("an indicator without payments pays nothing in silence")

walking = Study(task="lane", policies=["walker"], seeds=2, sizes=[{"values": [2, 4]}])
assert walking.run(engine="local").failed == 0
assert (walking.performance()["mean"] > 0).all()
Path("hall.log").write_text("N:4 P:10\\nN:8 P:19")
assert [row.performance for row in read_trials("hall.log").rows] == [10.0, 19.0]
print(policies.identity(policies.load("swarm-dt")))
"""

CHECK_STEPS = """
from swarm_logistics_env import Scenario, Warehouse, swarm_logistics_v0
from swarm_logistics_env.world import observations


def rows(**fields):
    world = Warehouse(Scenario(n_robots=2, n_items=2, heading_drift=0.0, **fields))
    world.reset(seed=0)
    for _ in range(5):
        world.step(np.array([[0.2, 0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]]))
    return observations.unflatten(world.observe(), world.scenario)


sensed, scaled = rows(), rows(odometry_scale=2.0)["velocity"]
assert sensed["velocity"][0].all(), sensed["velocity"]
np.testing.assert_allclose(scaled, 2.0 * sensed["velocity"], rtol=1e-6)
speeds = np.linalg.norm(sensed["velocity"], axis=1, keepdims=True)
np.testing.assert_allclose(sensed["speed"], speeds, rtol=1e-6)
space = swarm_logistics_v0.parallel_env(n_robots=2).observation_space("robot_0")
assert (space.low[-1], space.high[-1], *space.shape) == (0.0, 2.0, observations.N_COLUMNS)

from docs import generate

page = generate.page_text("environment")
assert "| `odometry_scale` | `1.0` | factor of velocities; off |" in page
assert "| 141 | `speed` | m/s | [0, 2] | without direction |" in page
"""


def run(folder: Path, recipes: Iterable[str], script: str) -> str:
    """Follow recipes in a copy of the package in that folder, and return what a script prints."""
    package = folder / PACKAGE.name
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("*.lock", "*.tmp.*"))
    for file, mark, lines in itertools.chain(*(EDITS[recipe] for recipe in recipes)):
        path = package / file
        assert path.exists() == bool(mark)
        text = f"\n{path.read_text('utf-8') if mark else ''}"
        before, mark_text, after = text.partition(f"\n{mark}")
        assert mark_text, f"{file}: {mark}"
        path.write_text(f"{before}\n{lines}{mark_text[1:]}{after}", encoding="utf-8")
    paths = {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    settings = {**os.environ, **paths, "PYTHONWARNINGS": "error", "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-c", INTERPRETED + script]
    done = subprocess.run(
        command, cwd=folder, env=settings, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("recipe", EDITS)
def test_a_recipe_names_the_files_that_it_changes(recipe: str) -> None:
    heading, *open_names = re.split(r" (?=[A-Z]+=)", recipe)
    match = re.search(rf"### {heading}\n\nFiles: (.*)\n", PAGE)
    assert match
    files = match[1]
    for name in open_names:
        files = files.replace(*name.split("="))
    # The page tells of a third file where compiled code reads a parameter.
    read = {"world/warehouse/structs.py"} if heading == "A scenario parameter" else set()
    assert {file for file, *_ in EDITS[recipe]} == {*re.findall(r"`([^`]+)`", files)} | read


@pytest.mark.daily
def test_what_the_recipes_add_works(tmp_path: Path) -> None:
    printed = run(
        tmp_path,
        [name for name in EDITS if not name.startswith(KERNEL_RECIPES)],
        CHECK_POLICIES_AND_STUDIES,
    )
    # Whoever adds a policy leaves the identities of the others, and with them stored runs, alone.
    assert printed.strip() == policies.identity(policies.load("swarm-dt"))


def test_what_the_recipes_add_to_kernels_works(tmp_path: Path) -> None:
    recipes = [recipe for recipe in EDITS if recipe.startswith(KERNEL_RECIPES)]
    run(tmp_path, recipes, CHECK_STEPS)
