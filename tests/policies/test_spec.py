from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, run_episode
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies import NAMES, Policy, PolicySpec, load
from swarm_logistics_env.policies.catalogue import ENTRY_POINTS
from swarm_logistics_env.world.observations import N_COLUMNS


@pytest.mark.unmeasured
@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_gives_a_named_policy_the_same_bits(name: str) -> None:
    scenario, policy = Scenario(n_robots=10, duration=20.0), load(name)
    digests = [run_episode(scenario, policy, seed).digest for seed in (0, 1, 0)]
    assert digests[0] == digests[2] != digests[1]


def test_a_class_is_loaded_by_module_or_the_file_of_this_folder_and_name(own_module: Path) -> None:
    for module in ("own_policies", "own_policies.py", "./own_policies.py"):
        policy = load(f"{module}:Still", gripper=0.25)
        assert policy.act(np.zeros((2, N_COLUMNS), np.float32))[0, 3] == 0.25
    assert isinstance(load("own_policies:Still.Inner"), Policy)


@pytest.mark.parametrize(
    ("name", "parameters", "complaint"),
    [
        ("mine.py", {}, r"policy 'mine.py': should name its class, as 'mine.py:Class'$"),
        ("swarm-td", {}, r"no policy 'swarm-td' \(.* file\); did you mean 'swarm-dt'\?$"),
        ("no_such_module:Class", {}, "ModuleNotFoundError: No module named 'no_such_mod"),
        ("own_policies:Stil", {}, r"own_policies has no Stil; did you mean 'Still'\?"),
        ("own_policies:Leaving", {}, "cannot be made: SystemExit: 0"),
        ("leaving_module:Class", {}, "cannot be imported: SystemExit: 0"),
        ("own_policies:number", {}, "is a int: should be a class"),
        ("own_policies:NoPolicy", {}, "NoPolicy object .* should have the methods reset and act"),
        (":Class", {}, "cannot be imported"),
        ("swarm-dt", {"taxis_gian": 1.0}, "no field 'taxis_gian'; did you mean 'taxis_gain'"),
        ("swarm-dt", {"drop_rate": -1.0}, r"drop_rate = -1.0: should be at least 0"),
        ("own_policies:Still", {"grip": 1.0}, r"cannot be made: .*'grip'"),
        ("ppo-robust@1", {"gain": 1.0}, r"'ppo-robust@1' cannot be made: .*'gain'"),
        ("swarm-dt=5,homing=5", {}, r"no policy 'swarm-dt=5,homing=5' .*; see examples/mixed_sw"),
    ],
)
def test_what_is_no_policy_is_refused_with_the_reason(
    own_module: Path, name: str, parameters: dict[str, float], complaint: str
) -> None:
    with pytest.raises(PolicyError, match=complaint):
        load(name, **parameters)  # type: ignore[arg-type]  # none of them is called trust_code


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        ({"name": "homing", "made": 3}, "'made' is no field of a table"),
        ({"name": "homing", "trusted": True}, "'trusted' is no field of a table"),
        *(
            ({"name": "homing", "parameters": {name: True}}, f"'{name}' is no parameter of a poli")
            for name in ("name", "trust_code", "trusted")
        ),
    ],
)
def test_a_table_of_a_file_says_neither_what_to_trust_nor_what_is_made(
    table: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        PolicySpec.of(table)


def test_an_object_is_refused_once_the_file_of_its_class_has_changed(own_module: Path) -> None:
    spec = PolicySpec.of(load("own_policies:Still"))
    planned = spec.identity()
    assert spec.load(planned=planned).act(np.zeros((1, N_COLUMNS), np.float32))[0, 3] == 1.0
    own_module.write_text(own_module.read_text() + "SPEED = 2\n")
    sentence = "policy 'Still' is not what was planned: own_policies.py changed; start the study"
    with pytest.raises(PolicyError, match=sentence):
        spec.load(planned=planned)


def test_an_installed_package_may_offer_policies_by_name(own_module: Path) -> None:
    about = own_module.with_name("own-1.0.dist-info")
    about.mkdir()
    (about / "METADATA").write_text("Name: own\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{ENTRY_POINTS}]\nstill = own_policies:Still\n")
    policy = load("still", gripper=0.25)
    assert policy.act(np.zeros((2, N_COLUMNS), np.float32))[0, 3] == 0.25


def fresh(name: str, n_robots: int) -> Any:
    policy = load(name)
    policy.reset(n_robots, 3)
    return policy


@pytest.mark.parametrize(
    "name",
    [
        "swarm-dt",
        "swarm-dt-follow",
        "random-walk",
        "biased-walk",
        "site-fidelity",
        "homing",
        "ppo-delivery",
    ],
)
def test_a_command_follows_from_its_own_row_alone_and_stays_within_bounds(name: str) -> None:
    rng, n = np.random.default_rng(0), 20
    world = Warehouse(Scenario(n_robots=n, n_items=20, warehouse_width=5, warehouse_height=4))
    rows, plain, disturbed, few = world.reset(0), fresh(name, n), fresh(name, n), fresh(name, 5)
    for _ in range(30):
        scrambled = rng.permutation(rows)
        scrambled[4] = rows[4]
        commands = plain.act(rows)
        assert (np.abs(commands) <= 1.0).all()
        assert (np.hypot(commands[:, 0], commands[:, 1]) <= 1.0 + 1e-6).all()
        np.testing.assert_array_equal(disturbed.act(scrambled)[4], commands[4])
        # Nor on who else is there, its randomness included.
        np.testing.assert_array_equal(few.act(rows[:5]), commands[:5])
        rows = world.step(commands)
    with pytest.raises(PolicyError, match="observations of 20 robots: reset was told 5"):
        few.act(rows)
