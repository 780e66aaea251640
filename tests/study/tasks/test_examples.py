"""The tasks of examples/tasks; they run where `make tasks` has installed what they need."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.parallel_policies import observation_rows
from swarm_logistics_env.study.tasks.task import task_of

STUDIES = Path(__file__).parents[3] / "examples" / "tasks"


# File of the study: the package that it needs, where a row of observations tells a place.
@pytest.mark.parametrize(
    ("name", "package", "columns"),
    [
        ("rware", "rware", slice(0, 2)),
        ("simple_spread", "mpe2", slice(2, 4)),
        ("dispersion", "vmas", slice(0, 2)),
    ],
)
def test_its_own_policy_beats_chance_and_robots_that_stay_start_where_they_would(
    name: str, package: str, columns: slice, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(package, reason="make tasks installs it")
    monkeypatch.syspath_prepend(STUDIES)
    small: dict[str, Any] = {"sizes": [{"values": [3, 4]}], "faults": [], "parameters": []}
    study = Study.from_file(STUDIES / f"{name}.toml", trust_code=True, seeds=2, **small)
    assert study.run().failed == 0
    p = [c.mean.value for c in study.findings().cells if c.arm.setting.value == 4]
    assert p[0] > 2 * p[1]
    task: Any = task_of(study.specification.task)
    starts = []
    for absent in ((), (0, 2)):
        env = task._environment(task.default, absent)
        observations, _ = env.reset(seed=5)
        starts.append(observation_rows(env, list(env.possible_agents), observations)[:, columns])
        env.close()
    assert np.array_equal(starts[0][[1, 3]], starts[1])
