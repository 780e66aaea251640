"""What identifies a policy: everything that it was made with, and nothing else."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.catalogue import SCRIPTED
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.homing_stock import HomingStock
from swarm_logistics_env.policies.learned import LearnedPolicy, Network
from swarm_logistics_env.policies.policy import Scripted, identity
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.parallel_policies import RandomActions
from swarm_logistics_env.world import observations


def changed(value: Any) -> Any:
    """Return another value of a parameter that is allowed, too."""
    return not value if isinstance(value, bool) else 0.7 * value + 0.01


def script_of(name: str) -> Any:
    make: Any = SCRIPTED[name]
    kind = make.func if isinstance(make, functools.partial) else make
    assert isinstance(kind, type)
    assert issubclass(kind, Scripted)
    return kind


def commands_of(policy: Any) -> Any:
    """What robots that sense anything, ten steps long, are commanded to do, (steps, N, 4)."""
    rng = np.random.default_rng(0)
    low, high = observations.bounds(Scenario())
    rows = rng.uniform(low, high, (17, 80, len(low))).astype(np.float32)
    flags = (low == 0.0) & (high == 1.0)
    rows[:, :, flags] = rows[:, :, flags].round()
    rows[:, 0, [observations.CARRYING, observations.CARRYING_REQUESTED]] = 1.0
    rows[:, 0, observations.IN_DELIVERY_AREA] = 0.0  # for 17 s: it may lose its patience
    commands = []
    # A stock has a parameter for either handling time, and lengths may go with the radius.
    for handling_time, radius in ((0.0, 0.125), (1.0, 0.1)):
        policy.configure(Scenario(handling_time=handling_time, robot_radius=radius, n_items=12))
        policy.reset(80, 0)
        commands += [policy.act(step) for step in rows for _ in range(10)]
    return np.array(commands)


# One that is told of the world needs a world: tests/policies/test_told.py.
@pytest.mark.unmeasured
@pytest.mark.parametrize("name", sorted(SCRIPTED.keys() - {"homing-told"}))
def test_every_argument_of_a_script_changes_its_identity_its_repr_and_its_commands(
    name: str,
) -> None:
    kind = script_of(name)
    assert kind.__init__ is Scripted.__init__, "its arguments are the fields of its record"
    defaults = kind.parameters_type().model_dump()
    default = kind()
    assert identity(default) == identity(kind(**defaults))
    assert repr(default) == f"{kind.__name__}()"
    met = {identity(default)}
    commands = commands_of(default) if defaults else None
    for field, value in defaults.items():
        fields = {field: changed(value)}
        policy = kind(**fields)
        assert repr(policy) == f"{kind.__name__}({field}={fields[field]!r})"
        assert identity(policy) not in met
        met.add(identity(policy))
        assert (commands_of(policy) != commands).any(), f"{field} is accepted and ignored"
        if SCRIPTED[name] is kind:  # the text with the same parameters is the same policy
            assert PolicySpec(name=name, parameters=fields).identity() == identity(policy)


def test_every_argument_of_a_trained_policy_changes_its_identity() -> None:
    trained: Any = policies.load("ppo-delivery")
    met = {identity(trained)}
    for field, value in {"listens": False, "decides_every": 7, "exploration": 0.3}.items():
        network = trained.card.network.replace(**{field: value})
        met.add(identity(LearnedPolicy(trained.card.replace(network=network), trained.tensors)))
    narrow = Network(hidden=(8,))
    tensors = {
        "layers.0.weight": trained.tensors["layers.0.weight"][:8],
        "layers.0.bias": trained.tensors["layers.0.bias"][:8],
        "layers.1.weight": trained.tensors["layers.2.weight"][:, :8],
        "layers.1.bias": trained.tensors["layers.2.bias"],
        "deviations": trained.tensors["deviations"],
    }
    met.add(identity(LearnedPolicy(trained.card.replace(network=narrow), tensors)))
    for name, tensor in tensors.items():
        changed_tensors = {**tensors, name: tensor + np.float32(0.1)}
        met.add(identity(LearnedPolicy(trained.card.replace(network=narrow), changed_tensors)))
    assert len(met) == 5 + len(tensors)


def forward(rows: Any) -> Any:
    return rows[:, :4]


def backward(rows: Any) -> Any:
    return -rows[:, :4]


def test_every_argument_of_a_policy_of_a_network_changes_its_identity() -> None:
    numbers = np.zeros(141), np.ones(141)
    made: list[Any] = [
        policies.of(forward),
        policies.of(backward),
        policies.of(forward, frame=True),
        policies.of(forward, listens=False),
        policies.of(forward, normalize=numbers),
        policies.of(forward, normalize=(numbers[0], 2.0 * numbers[1])),
        policies.of(forward, normalize=backward),
        policies.within(forward, backward),
        policies.within(backward, backward),
        policies.within(forward, forward),
        policies.within(forward, backward, normalize=numbers),
        policies.within(Homing(), backward),
        policies.within(HomingStock(), backward),
        policies.within(HomingStock(near=0.9), backward),
    ]
    identities = [identity(policy) for policy in made]
    assert len(set(identities)) == len(made)
    assert identities == [identity(policy) for policy in made]


def test_a_policy_of_the_package_without_a_record_is_known_by_what_it_holds() -> None:
    policy: Any = RandomActions()
    before = identity(policy)
    assert identity(policy) == before
    policy._spaces = [None]
    assert identity(policy) != before


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HomingStock(near=-1.0), r"near = -1\.0: should be greater than 0"),
        (lambda: HomingStock(density=float("nan")), "density = nan: should be"),
        (lambda: HomingStock(nearer=1.0), "no field 'nearer'; did you mean 'near'"),
        (lambda: Homing(near=1.0), "no field 'near'"),
        (lambda: policies.load("central", near=1.0), "no field 'near'"),
    ],
)
def test_parameters_that_cannot_be_are_refused_by_name(make: Any, message: str) -> None:
    with pytest.raises(PolicyError, match=message):
        make()


def test_a_policy_with_other_parameters_is_played_in_the_same_directory(tmp_path: Path) -> None:
    scenario = {"n_robots": 2, "n_items": 4, "duration": 1.0}
    default = HomingStock().parameters.near
    tallies = []
    for policy in (HomingStock(), HomingStock(near=1.2), HomingStock(near=default)):
        study = Study(
            out=tmp_path, policies=[policy], seeds=1, scenario=scenario, sizes=[{"values": [2, 3]}]
        )
        tally = study.run()
        tallies.append((tally.played, tally.kept))
    assert tallies == [(2, 0), (2, 0), (0, 2)]
