from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, run_episode
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.observations import IN_DELIVERY_AREA, N_COLUMNS
from swarm_logistics_env.policies import NAMES, Policy, load


@pytest.mark.parametrize("name", NAMES)
def test_a_named_policy_loads_and_runs(name: str) -> None:
    policy = load(name)
    assert isinstance(policy, Policy)
    assert run_episode(Scenario(n_robots=3, duration=2.0), policy, seed=0).ended_at == 2.0


def test_a_class_is_loaded_by_module_and_name(own_module: Path) -> None:
    policy = load("own_policies:Still", gripper=0.25)
    policy.reset(2, 0)
    assert policy.act(np.zeros((2, 140), np.float32))[0, 3] == 0.25
    assert isinstance(load("own_policies:Still.Inner"), Policy)


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("swarm-td", r"no policy 'swarm-td' \(.* or a file\); did you mean 'swarm-dt'\?$"),
        ("random_walk", "no policy 'random_walk' .*; did you mean 'random-walk'"),
        ("", "no policy ''"),
        ("no_such_module:Class", "cannot be imported: No module named 'no_such_module'"),
        ("own_policies:Stil", "cannot be imported: .* no attribute 'Stil'"),
        ("own_policies:number", "is a int: should be a class"),
        ("own_policies:NoPolicy", "is no policy: it should have the methods reset and act"),
        (":Class", "cannot be imported"),
        ("own_policies:", "cannot be imported"),
    ],
)
def test_what_is_no_policy_is_refused_with_the_reason(
    own_module: Path, name: str, complaint: str
) -> None:
    with pytest.raises(PolicyError, match=complaint):
        load(name)


def test_parameters_are_validated(own_module: Path) -> None:
    with pytest.raises(PolicyError, match="no field 'taxis_gian'; did you mean 'taxis_gain'"):
        load("swarm-dt", taxis_gian=1.0)
    with pytest.raises(PolicyError, match=r"drop_rate = -1.0: should be greater than or equal"):
        load("swarm-dt", drop_rate=-1.0)
    with pytest.raises(PolicyError, match=r"cannot be made: .*'grip'"):
        load("own_policies:Still", grip=1.0)


def test_each_load_is_a_policy_of_its_own() -> None:
    assert load("swarm-dt") is not load("swarm-dt")


SCRIPTS = ("swarm-dt", "swarm-dt-follow", "random-walk", "homing")
each_of_robots = pytest.mark.parametrize("name", [*SCRIPTS, "ppo-delivery"])


def fresh(name: str, n_robots: int, seed: int = 3) -> Any:
    policy = load(name)
    policy.reset(n_robots, seed)
    return policy


@each_of_robots
def test_a_command_follows_from_its_own_row_alone_and_stays_within_bounds(name: str) -> None:
    rng, n = np.random.default_rng(0), 20
    world = Warehouse(Scenario(n_robots=n, n_items=20, warehouse_width=5, warehouse_height=4))
    rows, whole, disturbed, few = world.reset(0), fresh(name, n), fresh(name, n), fresh(name, 5)
    for _ in range(30):
        scrambled = rng.permutation(rows)
        scrambled[4] = rows[4]
        commands = whole.act(rows)
        assert (np.abs(commands) <= 1.0).all()
        assert (np.hypot(commands[:, 0], commands[:, 1]) <= 1.0 + 1e-6).all()
        np.testing.assert_array_equal(disturbed.act(scrambled)[4], commands[4])
        # Nor on who else is there, its randomness included.
        np.testing.assert_array_equal(few.act(rows[:5]), commands[:5])
        rows = world.step(commands)


@each_of_robots
def test_reset_begins_anew_and_is_asked_for_the_number_of_robots(name: str) -> None:
    rows, policy = np.ones((3, N_COLUMNS), np.float32), fresh(name, 3, seed=1)
    rows[:, IN_DELIVERY_AREA] = 0.0  # where it delivers, a robot stands whatever it draws
    first = [policy.act(rows) for _ in range(4)]
    policy.reset(3, 1)
    np.testing.assert_array_equal(first, [policy.act(rows) for _ in range(4)])
    policy.reset(3, 2)
    assert name not in SCRIPTS or not np.array_equal(first[0], policy.act(rows))
    with pytest.raises(PolicyError, match="observations of 4 robots: reset was told 3"):
        policy.act(np.ones((4, N_COLUMNS), np.float32))


def test_a_class_may_be_named_by_the_file_of_this_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    text = "class Own:\n    def reset(self, n_robots, seed): ...\n    def act(self, rows): ...\n"
    Path("in_this_folder.py").write_text(text)
    for name in ("in_this_folder:Own", "in_this_folder.py:Own", "./in_this_folder.py:Own"):
        assert type(load(name)).__name__ == "Own"
