"""Several policies in one swarm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.errors import PolicyError, StudyError
from swarm_logistics_env.policies import identity
from swarm_logistics_env.policies.policy import Mixed, start
from swarm_logistics_env.studies import Study
from swarm_logistics_env.watch import Session

SMALL = Scenario(n_robots=10, n_items=20, duration=20.0)


class Ones:
    """Commands ones, in an array of any shape."""

    def __init__(self, *shape: int) -> None:
        self.shape = shape

    def reset(self, n_robots: int, seed: int) -> None: ...

    def act(self, observations: Any) -> Any:
        return np.ones(self.shape)


def test_each_robot_does_what_its_policy_does_upon_the_same_rows() -> None:
    world = Warehouse(SMALL)
    rows = world.reset(0)
    names = ("homing", "ppo-delivery", "random-walk")
    both: Any = policies.load("homing=5,ppo-delivery=3,random-walk=2")
    each = [policies.load(name) for name in names]
    for policy in (both, *each):
        start(policy, SMALL, 0)
    for _ in range(100):
        commands = both.act(rows)
        wanted = [policy.act(rows) for policy in each]
        for part, place in enumerate((slice(0, 5), slice(5, 8), slice(8, 10))):
            np.testing.assert_array_equal(commands[place], wanted[part][place])
        rows = world.step(commands)


@pytest.mark.parametrize("n_robots", [1, 2, 3, 24, 25, 26, 1000])
def test_a_swarm_of_any_size_is_shared_out(n_robots: int) -> None:
    both: Any = policies.load("swarm-dt=20,ppo-delivery=4,homing=1")
    rows = both.rows(n_robots)
    assert [place for part in rows for place in range(n_robots)[part]] == list(range(n_robots))
    wanted = np.cumsum([20, 4, 1]) * n_robots / 25
    assert np.abs([part.stop for part in rows] - wanted).max() <= 0.5


def test_identity_covers_the_parts_and_their_numbers() -> None:
    names = [
        "swarm-dt=20,ppo-delivery=5",
        "swarm-dt=19,ppo-delivery=5",
        "swarm-dt=20,ppo-robust=5",
        "ppo-delivery=20,swarm-dt=5",
    ]
    told = [identity(policies.load(name)) for name in names]
    assert len(set(told)) == 4
    assert identity(policies.load(names[0])) == told[0]


def test_messages_of_one_part_are_zeros_of_the_others_and_wrong_shapes_are_told() -> None:
    both = Mixed([(policies.load("swarm-dt"), 2), (Ones(4, 6), 2)])
    scenario = Scenario(n_robots=4, message_size=2)
    world = Warehouse(scenario)
    rows = world.reset(0)
    start(both, scenario, 0)
    commands = both.act(rows)
    assert (commands[2:] == 1.0).all()
    assert not commands[:2, 4:].any()
    world.step(commands)
    both = Mixed([(policies.load("swarm-dt"), 5), (Ones(1, 4), 5)])
    with pytest.raises(PolicyError, match=r"Ones gave commands of shape \(1, 4\)"):
        run_episode(SMALL, both, 0)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("swarm-dt=5,central=5", "Central commands the whole swarm"),
        ("swarm-dt=0,homing=5", "0 robots with SwarmDT: should be at least 1"),
        ("swarm-dt=5,hooming=5", "no policy 'hooming' .*; did you mean 'homing'"),
        ("swarm-dt=5,missing.zip=5", "executes the code"),
        ("swarm-dt=5,homing", "no policy 'swarm-dt=5,homing'"),
    ],
)
def test_what_cannot_be_mixed_is_refused(name: str, said: str) -> None:
    with pytest.raises(PolicyError, match=said):
        policies.load(name)


def test_a_study_plays_it(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    mixed = {"name": "swarm-dt=8,homing=2", "label": "two of ten home"}
    faults = [{"modes": ["FM1"], "robots": [1]}]
    asked: dict[str, Any] = {"policies": [mixed, "swarm-dt"], "faults": faults}
    study = Study(**asked, seeds=2, scenario=SMALL, out=tmp_path)
    assert study.run(processes=1).failed == 0
    study.report()
    assert "two of ten home" in (tmp_path / "report.md").read_text(encoding="utf-8")
    file = tmp_path / "mixed.toml"
    file.write_text('policies = ["swarm-dt=8,my_module:Class=2"]\n', encoding="utf-8")
    with pytest.raises(StudyError, match="is code, which runs when it is loaded"):
        Study.from_file(file)


def test_it_can_be_watched() -> None:
    session = Session(SMALL, "swarm-dt=8,homing=2", seed=2, faults=[Fault("FM4", 3)])
    session.play(1e6)
    played = run_episode(SMALL, policies.load("swarm-dt=8,homing=2"), 2, [Fault("FM4", 3)])
    assert session.run.world.state.delivery_times == played.delivery_times.tolist()
