"""The tasks of examples/tasks; they run where `make tasks` has installed what they need."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.studies import Study
from swarm_logistics_env.tasks.parallel_policies import observation_rows
from swarm_logistics_env.tasks.task import task_of

STUDIES = Path(__file__).parents[2] / "examples" / "tasks"
# File of the study: the package that it needs, where a row of observations tells a place.
SHIPPED = {
    "rware": ("rware", slice(0, 2)),
    "simple_spread": ("mpe2", slice(2, 4)),
    "dispersion": ("vmas", slice(0, 2)),
}


@pytest.fixture(params=sorted(SHIPPED))
def shipped(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    name: str = request.param
    if importlib.util.find_spec(SHIPPED[name][0]) is None:
        pytest.skip(f"{SHIPPED[name][0]} is not installed")
    monkeypatch.syspath_prepend(STUDIES)
    return name


def test_the_tasks_own_policy_is_better_than_random(shipped: str) -> None:
    sizes = [{"values": [3, 4]}]
    study = Study.from_file(
        STUDIES / f"{shipped}.toml", trust_code=True, seeds=2, sizes=sizes, faults=[], parameters=[]
    )
    assert study.run().failed == 0
    p = [c.mean.value for c in study.findings().cells if c.arm.setting.value == 4]
    assert p[0] > 2 * p[1]


def test_robots_that_stay_start_where_they_would(shipped: str) -> None:
    study = Study.from_file(STUDIES / f"{shipped}.toml", trust_code=True)
    task: Any = task_of(study.specification.task)
    starts = []
    for absent in ((), (0, 2)):
        env = task._made(task.default, absent)
        observations, _ = env.reset(seed=5)
        agents = list(env.possible_agents)
        rows = observation_rows(env, agents, observations)
        starts.append(rows[:, SHIPPED[shipped][1]])
        env.close()
    assert np.array_equal(starts[0][[1, 3]], starts[1])
