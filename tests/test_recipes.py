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
from swarm_logistics_env import policies

PACKAGE = Path(swarm_logistics_env.__file__).parent
ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")

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

INTERPRETED = """
import numpy as np
from verification.interpreted import interpret_kernels
from swarm_logistics_env import Scenario, Warehouse, observations, swarm_logistics_v0

np.seterr(over="ignore", divide="ignore")
interpret_kernels()


def rows(**fields):
    world = Warehouse(Scenario(n_robots=2, n_items=2, heading_drift=0.0, **fields))
    world.reset(seed=0)
    for _ in range(5):
        world.step(np.array([[0.2, 0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]]))
    return observations.unflatten(world.observe(), world.scenario)


"""

SCALED = """
velocity, scaled = rows()["velocity"], rows(odometry_scale=2.0)["velocity"]
assert velocity[0].all(), velocity
np.testing.assert_allclose(scaled, 2.0 * velocity, rtol=1e-6)
"""

SPEEDS = """
sensed = rows()
assert sensed["speed"].shape == (2, 1)
assert sensed["speed"][0, 0] > 0.1
np.testing.assert_allclose(
    sensed["speed"][:, 0], np.linalg.norm(sensed["velocity"], axis=1), rtol=1e-6
)
space = swarm_logistics_v0.parallel_env(n_robots=2).observation_space("robot_0")
place = observations.columns(Scenario())[-1].columns
assert (space.low[place], space.high[place]) == (0.0, 2.0)
assert space.shape == (observations.N_COLUMNS,)
"""

INDICATOR = """
def kept(p_o, p_f, **asked):
    terms = {"p_f": (p_f, 1.0, 0.0), "p_o": (p_o, 0.0, 1.0)}
    return judge("K", terms, offset=0.0, **asked)

"""

DEFINITION = """\
        Definition(
            symbol="K",
            heading="performance kept K",
            compares="fault",
            performances={"p_o": "P_o", "p_f": "P_F"},
            function=kept,
            arguments=lambda _: {},
            adjectives={0.0: "alive"},
        ),"""

STUDY = """
from pathlib import Path
from swarm_logistics_env.studies import Study

size = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0}
study = Study(
    name="small", seeds=2, scenario={"n_robots": 4, "n_items": 8, "duration": 20.0, **size},
    faults=[{"modes": ["FM4"], "robots": [1]}], indicators=["K"],
)
study.run(engine="local")
study.report(Path())
print(Path("report.md").read_text())
"""

DOCS = """
import sys
sys.path.append(sys.argv[1])
import generate
print(generate.written("environment"))
"""


class Copy:
    """A copy of the package in which a recipe is followed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.package = folder / PACKAGE.name
        shutil.copytree(PACKAGE, self.package, ignore=shutil.ignore_patterns("*.lock", "*.tmp.*"))
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

    def replace(self, name: str, old: str, new: str) -> None:
        file = self.package / name
        text = file.read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{name} has {old} {text.count(old)} times"
        file.write_text(text.replace(old, new), encoding="utf-8")
        self.changed.add(name)

    def run(self, *arguments: str, **variables: str) -> str:
        """Run Python with the copy as the package, and return what it printed."""
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "PYTHONWARNINGS": "error"}
        environment |= variables
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

    def interpret(self, script: str) -> None:
        """Run a script in which the interpreter runs the kernels; compiling them takes longer."""
        paths = os.pathsep.join([str(self.folder), str(ROOT)])
        self.run("-c", INTERPRETED + script, PYTHONPATH=paths, NUMBA_DISABLE_JIT="1")

    def page(self) -> str:
        """Return the page of the environment that the documentation's generator writes."""
        return self.run("-c", DOCS, str(ROOT / "docs"))

    def command(self, *arguments: str) -> str:
        small = ("--set", "n_robots=3", "--set", "n_items=4", "--set", "duration=5")
        return self.run("-c", "from swarm_logistics_env.cli import app; app()", *arguments, *small)


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    return Copy(tmp_path)


def files_of(recipe: str, **names: str) -> set[str]:
    """Return the files that a recipe says it changes, with the names that it leaves open."""
    found = re.search(rf"### {recipe}\n\nFiles: (.*)\n", PAGE)
    assert found
    files = re.findall(r"`([^`]+)`", found[1])
    for placeholder, name in names.items():
        files = [file.replace(placeholder, name) for file in files]
    return set(files)


def test_a_policy(copy: Copy) -> None:
    copy.write("policies/circles.py", POLICY)
    copy.insert(
        "policies/spec.py",
        "from swarm_logistics_env.policies.homing",
        "from swarm_logistics_env.policies.circles import Circles",
    )
    copy.insert("policies/spec.py", '    "homing": ', '    "circles": Circles,')
    assert "with circles, seed 0" in copy.command("run", "--policy", "circles")
    assert copy.changed == files_of("A policy", NAME="circles")
    script = "from swarm_logistics_env import policies as p; print(p.identity(p.load('swarm-dt')))"
    assert copy.run("-c", script).strip() == policies.identity(policies.load("swarm-dt"))


def test_a_wrapper(copy: Copy) -> None:
    copy.write("wrappers/half_speed.py", WRAPPER)
    copy.insert(
        "wrappers/__init__.py",
        "from .indicator_reward",
        "from .half_speed import HalfSpeed",
    )
    copy.insert("wrappers/__init__.py", '    "IndicatorReward",', '    "HalfSpeed",')
    copy.run("-c", DRIVES)
    assert copy.changed == files_of("A wrapper", NAME="half_speed")


def test_a_failure_mode(copy: Copy) -> None:
    row = '    "weak": FailureMode("drives slowly and lifts nothing", speed=0.2, lifts=False),'
    copy.insert("warehouse/failure_modes.py", '    "dead": ', row)
    printed = copy.command("run", "--fault", "weak:2@1")
    assert "failed robots " in printed
    assert copy.changed == files_of("A failure mode")


def test_a_scenario_parameter(copy: Copy) -> None:
    field = (
        '    odometry_scale: PositiveFloat = Field(1.0, description="factor of velocities; off")'
    )
    copy.insert("scenario.py", "    item_radius: ", field)
    copy.insert("warehouse/structs.py", "    n_substeps: ", "    odometry_scale: float")
    copy.insert(
        "warehouse/sensing.py",
        "    limit = parameters.max_speed",
        "    forward *= parameters.odometry_scale\n    left *= parameters.odometry_scale",
    )
    copy.interpret(SCALED)
    assert "| `odometry_scale` | `1.0` | factor of velocities; off |" in copy.page()
    files = files_of("A scenario parameter", READER="warehouse/sensing")
    assert copy.changed == files | {"warehouse/structs.py"}
    assert "`warehouse/structs.py`" in PAGE


def test_an_observation_column(copy: Copy) -> None:
    copy.insert("observations.py", "N_COLUMNS = ", "SPEED = CONTACT + 1")
    copy.replace("observations.py", "N_COLUMNS = CONTACT + 1", "N_COLUMNS = SPEED + 1")
    column = '        Column("speed", "m/s", _run(SPEED, 1), 0, speed, "without direction"),'
    copy.insert("observations.py", "        *(messages if ", column)
    line = "    out[row.SPEED] = math.hypot(out[row.VELOCITY], out[row.VELOCITY + 1])"
    copy.insert("warehouse/sensing.py", "    out[row.CONTACT] = ", line)
    copy.interpret(SPEEDS)
    assert "| 140 | `speed` | m/s | [0, 2] | without direction |" in copy.page()
    assert copy.changed == files_of("An observation column", SENSE="sensing")


def test_a_reward_term(copy: Copy) -> None:
    term = """
def presence(world: Warehouse, before: Before) -> Earned:
    return np.ones(world.state.n_robots)

"""
    copy.insert("environment/rewards.py", "REWARD_TERMS: ", term)
    copy.insert("environment/rewards.py", '    "own_delivery": own', '    "presence": presence,')
    copy.interpret(
        'env = swarm_logistics_v0.parallel_env(n_robots=2, rewards={"presence": 0.5})\n'
        "env.reset_arrays(seed=0)\n"
        "assert list(env.step_arrays(np.zeros((2, 4)))[1]) == [0.5, 0.5]\n"
    )
    assert copy.changed == files_of("A reward term")


def test_an_indicator(copy: Copy) -> None:
    copy.insert("spi/definitions.py", "def scalability(", INDICATOR)
    copy.insert("spi/definitions.py", '        Definition(\n            symbol="S"', DEFINITION)
    report = copy.run("-c", STUDY)
    assert "swarm-dt, alive? FM4, m = 1, N = 4." in report
    assert "performance kept K; above " in report
    assert copy.changed == files_of("An indicator")
