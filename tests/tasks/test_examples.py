"""The tasks of examples/tasks; they run where `make tasks` has installed what they need."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Discrete, Tuple

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.tasks.parallel_policies import observation_rows
from swarm_logistics_env.tasks.task import task_of

STUDIES = Path(__file__).parents[2] / "examples" / "tasks"


# File of the study: the package that it needs, where a row of observations tells a place.
@pytest.mark.parametrize(
    ("name", "package", "place"),
    [
        ("rware", "rware", slice(0, 2)),
        ("simple_spread", "mpe2", slice(2, 4)),
        ("dispersion", "vmas", slice(0, 2)),
    ],
)
def test_its_own_policy_beats_chance_and_robots_that_stay_start_where_they_would(
    name: str, package: str, place: slice, monkeypatch: pytest.MonkeyPatch
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
        env = task._made(task.default, absent)
        observations, _ = env.reset(seed=5)
        starts.append(observation_rows(env, list(env.possible_agents), observations)[:, place])
        env.close()
    assert np.array_equal(starts[0][[1, 3]], starts[1])


class Pair(gymnasium.Env[Any, Any]):
    """Two agents whose actions are observed and paid; it ends after two steps."""

    observation_space = Tuple([Box(0, 9, (1,), np.float32)] * 2)
    action_space = Tuple([Discrete(2)] * 2)
    shared = False

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, Any]:
        self.steps = 0
        return self._seen((0, 0)), {"agent_0": {"own": 0}, "agent_1": {"own": 1}}

    def step(self, actions: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        self.steps += 1
        rewards: Any = 1.5 if self.shared else list(actions)
        return self._seen(actions), rewards, False, self.steps == 2, {"all": self.steps}

    def _seen(self, actions: Any) -> tuple[Any, ...]:
        return tuple(np.array([action], dtype=np.float32) for action in actions)


def test_an_environment_of_tuples_becomes_a_parallel_one(monkeypatch: pytest.MonkeyPatch) -> None:
    tuple_env = runpy.run_path(str(STUDIES / "tuple_env.py"))["TupleEnv"]
    env = tuple_env(Pair())
    observations, infos = env.reset(seed=0)
    assert infos == {"agent_0": {"own": 0}, "agent_1": {"own": 1}}
    observations, rewards, _, _, infos = env.step({"agent_1": 1, "agent_0": 0})
    assert [value.tolist() for value in observations.values()] == [[0.0], [1.0]]
    assert rewards == {"agent_0": 0.0, "agent_1": 1.0}
    assert infos == {"agent_0": {"all": 1}, "agent_1": {"all": 1}}
    monkeypatch.setattr(Pair, "shared", True)
    _, rewards, _, truncated, _ = env.step(dict.fromkeys(env.agents, 0))
    assert (set(rewards.values()), all(truncated.values()), env.agents) == ({1.5}, True, [])
    monkeypatch.setattr(Pair, "action_space", Discrete(2))
    with pytest.raises(SetupError, match=r"space Discrete\(2\) should be a Tuple"):
        tuple_env(Pair())
