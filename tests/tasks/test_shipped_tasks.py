"""The tasks of other environments; most of it runs where `make tasks` has installed them."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.engines import execute
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.tasks.parallel_policies import observation_rows
from swarm_logistics_env.tasks.task_choice import task_of
from tests.tasks.killing import run_killed_and_resumed

ROOT = Path(__file__).parents[2]
STUDIES = ROOT / "examples" / "tasks"
# File of the study: the package that it needs, its task, its own policy, where a row tells a place.
SHIPPED = {
    "rware": ("rware", "rware", "fetch", slice(0, 2)),
    "simple_spread": ("mpe2", "simple-spread", "nearest-landmark", slice(2, 4)),
    "dispersion": ("vmas", "dispersion", "own-sector", slice(0, 2)),
}


@pytest.fixture(params=sorted(SHIPPED))
def shipped(request: pytest.FixtureRequest) -> str:
    name: str = request.param
    if importlib.util.find_spec(SHIPPED[name][0]) is None:
        pytest.skip(f"{SHIPPED[name][0]} is not installed")
    return name


def short(name: str, folder: Path, duration: int = 20) -> Path:
    path = folder / f"{name}.toml"
    text = (STUDIES / f"{name}.toml").read_text()
    path.write_text(text.replace("\n[[", f"\nscenario = {{ duration = {duration} }}\n\n[[", 1))
    return path


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_the_page_shows_the_study_file(name: str) -> None:
    assert (STUDIES / f"{name}.toml").read_text() in (ROOT / "docs" / f"{name}.md").read_text()


def test_a_task_that_is_not_installed_says_what_to_install() -> None:
    for package, task, *_ in SHIPPED.values():
        if importlib.util.find_spec(package) is None:
            with pytest.raises(StudyError, match=r"pip install 'swarm-logistics-env\[tasks\]'"):
                task_of(task)


def test_equal_seeds_give_equal_bits_in_another_process(shipped: str, tmp_path: Path) -> None:
    path = short(shipped, tmp_path)
    script = (
        "import sys; from swarm_logistics_env.studies import Study\n"
        "from swarm_logistics_env.studies.engines import execute\n"
        "for run in Study.from_file(sys.argv[1], seeds=1).plan().runs():\n"
        "    outcome = execute(run); print(run.key, outcome.delivered, outcome.digest)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True
    )
    here = [execute(run) for run in Study.from_file(path, seeds=1).plan().runs()]
    assert [outcome.error for outcome in here] == [None] * len(here)
    assert done.stdout.splitlines() == [f"{o.run} {o.delivered} {o.digest}" for o in here]
    assert len({o.digest for o in here}) > len(here) / 2


def test_a_killed_study_goes_on_where_it_was(shipped: str, tmp_path: Path) -> None:
    run_killed_and_resumed(short(shipped, tmp_path), tmp_path, "--seeds", "10", kept=20)


def test_robots_that_stay_start_where_they_would(shipped: str) -> None:
    task: Any = task_of(SHIPPED[shipped][1])
    places = SHIPPED[shipped][3]
    starts = []
    for absent in ((), (0, 2)):
        env = task._made(task.default, absent)
        observations, _ = env.reset(seed=5)
        agents = list(env.possible_agents)
        starts.append(observation_rows(env, agents, observations)[:, places])
        env.step({agent: env.action_space(agent).sample() for agent in env.agents})
        env.close()
    assert np.array_equal(starts[0][[1, 3]], starts[1])


def test_the_tasks_own_policy_is_better_than_random(shipped: str) -> None:
    _, task, policy, _ = SHIPPED[shipped]
    study = Study(task=task, policies=[policy, "random"], seeds=2, sizes=[{"values": [3, 4]}])
    assert study.run().failed == 0
    p = {(c.policy, c.cell): c.mean for c in rows_of(study.findings().performance)}
    assert p[policy, "N = 4"] > 2 * p["random", "N = 4"]
