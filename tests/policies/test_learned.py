from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, run_episode
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.policies import PolicyCard, charging, identity
from swarm_logistics_env.policies.layers import hyperbolic_tangent
from swarm_logistics_env.policies.learned import LearnedPolicy, tensor_shapes
from swarm_logistics_env.policies.network_steps import choose_outputs, explore
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.policies.row_policy import refuse_messages
from swarm_logistics_env.world.motion import INPUTS, MotionView
from swarm_logistics_env.world.motion.classes import N_CLASSES, classes_of
from swarm_logistics_env.world.motion.voices import MESSAGES
from swarm_logistics_env.world.observations import N_BEAMS, N_COLUMNS, RANGE_ITEMS, TURN_RATE
from swarm_logistics_env.world.warehouse import Warehouse

Tensors = dict[str, NDArray[np.float32]]


def test_an_episode_follows_from_its_seed(card: PolicyCard, tensors: Tensors) -> None:
    policy, rows = LearnedPolicy(card, tensors), np.zeros((7, N_COLUMNS), np.float32)

    def played(seed: int) -> bytes:
        policy.reset(len(rows), seed)
        return b"".join(policy.act(rows).tobytes() for _ in range(3))

    first = played(0)
    assert played(1) != first
    assert played(0) == first


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_a_copy_goes_on_from_where_it_was_made(
    card: PolicyCard, tensors: Tensors, copied: Callable[[LearnedPolicy], LearnedPolicy]
) -> None:
    policy, rng = LearnedPolicy(card, tensors), np.random.default_rng(0)
    rows = rng.uniform(0, 1, (9, 5, N_COLUMNS)).astype(np.float32)
    policy.reset(5, 0)
    for observations in rows[:4]:
        policy.act(observations)
    other = copied(policy)
    if copied is copy.copy:  # it shares the memories, so the first one begins another episode
        policy.reset(5, 1)
    commands = [other.act(observations).tobytes() for observations in rows[4:]]
    again = LearnedPolicy(card, tensors)
    again.reset(5, 0)
    assert commands == [again.act(observations).tobytes() for observations in rows][4:]


def test_it_decides_every_so_many_steps_and_goes_on_as_decided_in_between(
    card: PolicyCard, tensors: Tensors
) -> None:
    slow = card.replace(network=card.network.replace(decides_every=3, exploration=0.0))
    policy, rng = LearnedPolicy(slow, tensors), np.random.default_rng(0)
    policy.reset(5, 0)
    rows = rng.uniform(0, 1, (7, 5, N_COLUMNS)).astype(np.float32)
    rows[..., TURN_RATE] = 0.0
    grips = [policy.act(observations)[:, 3] for observations in rows]
    for step in (1, 2, 4, 5):
        np.testing.assert_array_equal(grips[step], grips[step - 1])
    assert (grips[3] != grips[2]).any()
    assert (grips[6] != grips[5]).any()


@pytest.mark.parametrize(
    ("faults", "fields"),
    [
        # Longer than the log of commands.
        pytest.param((), {"restock": True, "duration": 70.0}, marks=pytest.mark.compiled),
        (("dead:2@3.05", "FM3:1@7"), {"message_size": 2, "drive": "differential"}),
        (("removed:2@4",), {"n_items": 1, "handling_time": 0.5}),
    ],
)
def test_steps_played_in_one_call_are_those_of_a_call_each(
    card: PolicyCard, tensors: Tensors, faults: tuple[str, ...], fields: dict[str, Any]
) -> None:
    class Own(LearnedPolicy):
        """What somebody derives is asked for each command, as it may act in its own way."""

    scenario = Scenario(**{"n_robots": 6, "n_items": 8, "duration": 20.0, **fields})
    slow = card.replace(network=card.network.replace(decides_every=3))
    together, alone = (
        run_episode(scenario, kind(slow, tensors), seed=2, faults=faults)
        for kind in (LearnedPolicy, Own)
    )
    assert together.digest == alone.digest
    assert (together.contacts, together.ended_at) == (alone.contacts, alone.ended_at)


def test_an_act_of_somebody_else_is_asked(card: PolicyCard, tensors: Tensors) -> None:
    class Standing:
        """Passes on to the policy what it has not itself."""

        def __init__(self, policy: Any) -> None:
            self.policy = policy

        def __getattr__(self, name: str) -> Any:
            return getattr(self.policy, name)

        def act(self, rows: Any) -> Any:
            return np.zeros((len(rows), 4))

    replaced: Any = LearnedPolicy(card, tensors)
    replaced.act = lambda rows: np.zeros((len(rows), 4))
    scenario = Scenario(n_robots=2, n_items=3, duration=2.0)
    policies: list[Any] = [replaced, Standing(LearnedPolicy(card, tensors))]
    for policy in policies:
        assert run_episode(scenario, policy, seed=0).contacts.mean_acceleration == 0.0


def test_noise_is_of_each_robot_and_output_alone_and_of_its_deviation() -> None:
    deviations = np.array([0.1, 1.0, 3.0], np.float32)
    noise, later = np.zeros((2, 400, 3), np.float32)
    explore(row_keys(0, "noise", 400), np.full(400, 6), deviations, noise)
    explore(row_keys(0, "noise", 400), np.full(400, 7), deviations, later)
    np.testing.assert_allclose(noise.std(axis=0), deviations, rtol=0.15)
    assert np.abs(np.corrcoef(noise.T, later.T) - np.eye(6)).max() < 0.2


def test_each_group_of_classes_is_drawn_for_itself_and_anew_at_each_decision() -> None:
    keys = row_keys(0, "noise", 400)
    logits = np.zeros((400, N_CLASSES), np.float32)
    first, second = np.zeros((2, 400, 3), np.float32)
    choose_outputs(keys, np.full(400, 6), 1.0, logits, first)
    choose_outputs(keys, np.full(400, 7), 1.0, logits, second)
    classes = np.hstack([classes_of(first), classes_of(second)]).astype(float)
    moving = (classes[:, 1] > 0) & (classes[:, 4] > 0)  # who stands has no direction
    correlations = np.corrcoef(classes[moving].T)
    assert np.abs(correlations - np.eye(6)).max() < 0.25


def test_identity_follows_weights_and_network_alone(card: PolicyCard, tensors: Tensors) -> None:
    policy = LearnedPolicy(card, tensors)
    identity_before = identity(policy)
    run_episode(Scenario(n_robots=2, duration=1.0), policy, seed=3, faults=[Fault("FM1", 1)])
    assert identity(policy) == identity_before
    assert identity(LearnedPolicy(card.replace(name="other", seed=7), tensors)) == identity_before
    bolder = card.replace(network=card.network.replace(exploration=1.0))
    assert identity(LearnedPolicy(bolder, tensors)) != identity_before
    moved = {**tensors, "layers.0.bias": tensors["layers.0.bias"] + np.float32(1e-3)}
    assert identity(LearnedPolicy(card, moved)) != identity_before


def test_it_is_the_network_of_its_layers(card: PolicyCard, tensors: Tensors) -> None:
    rows = np.random.default_rng(0).normal(0, 1 / 9, (50, len(INPUTS))).astype(np.float32)
    rows[:, 5:9] = 0.0
    value = rows.astype(np.float64)
    for layer in range(3):
        value = value @ tensors[f"layers.{layer}.weight"].T + tensors[f"layers.{layer}.bias"]
        value = np.tanh(value) if layer < 2 else value
    outputs = LearnedPolicy(card, tensors).outputs_of(rows)
    np.testing.assert_allclose(outputs, value, rtol=0, atol=5e-6)


def test_the_hyperbolic_tangent_is_one() -> None:
    values = np.linspace(-12.0, 12.0, 20_001, dtype=np.float32)
    computed = [hyperbolic_tangent(value) for value in values]
    np.testing.assert_allclose(computed, np.tanh(values.astype(np.float64)), rtol=0, atol=5e-7)


def test_it_steers_the_body_that_the_robots_of_a_scenario_have(
    card: PolicyCard, tensors: Tensors
) -> None:
    policy, rows = LearnedPolicy(card, tensors), np.zeros((4, N_COLUMNS), np.float32)

    def turns(scenario: Scenario) -> bool:
        start(policy, scenario, 0)
        return bool(policy.act(rows)[:, 2].any())

    assert turns(Scenario(n_robots=4, drive="differential"))
    assert not turns(Scenario(n_robots=4, drive="holonomic"))


@pytest.fixture(params=["outputs", "classes"])
def talking(card: PolicyCard, request: pytest.FixtureRequest) -> LearnedPolicy:
    """A network of drawn numbers that talks."""
    changes = {"role": True, "exploration": 0.3, "decides_every": 2, "head": request.param}
    network = card.network.replace(talks=True, **changes)
    rng = np.random.default_rng(1)
    tensors = {
        name: rng.normal(0.0, 0.3, shape).astype(np.float32)
        for name, shape in tensor_shapes(network).items()
    }
    return LearnedPolicy(card.replace(network=network), tensors)


def test_a_network_that_talks_tells_its_neighbours_two_numbers_and_hears_them(
    talking: LearnedPolicy,
) -> None:
    scenario = Scenario(n_robots=6, n_items=8, duration=20.0, message_size=2)

    class Own(LearnedPolicy):
        """Asked for each command."""

    class Deaf(Own):
        def act(self, rows: NDArray[np.float32]) -> NDArray[np.float64]:
            deaf = rows.copy()
            deaf[:, N_COLUMNS:] = 0.0
            return super().act(deaf)

    def played(kind: type[LearnedPolicy]) -> str:
        return run_episode(scenario, kind(talking.card, talking.tensors), seed=2).digest

    assert played(LearnedPolicy) == played(Own) != played(Deaf)
    warehouse = Warehouse(scenario)
    rows = warehouse.reset(0)
    start(talking, scenario, 0)
    commands = talking.act(rows)
    assert commands.shape == (6, 6)
    assert ((commands[:, 4:] >= 0.0) & (commands[:, 4:] <= 1.0)).all()
    rows = warehouse.step(commands)
    np.testing.assert_allclose(warehouse.state.robot_message, commands[:, 4:])
    duplicate = copy.deepcopy(talking)
    next_commands = talking.act(rows)
    np.testing.assert_array_equal(next_commands[:, 4:], commands[:, 4:])  # between two decisions
    np.testing.assert_array_equal(duplicate.act(rows), next_commands)
    with pytest.raises(PolicyError, match="of 141 columns: should be at least 157"):
        talking.act(rows[:, :N_COLUMNS])
    assert talking.memories()["output_dock_nearness"].tolist() == commands[:, 5].tolist()


def test_a_network_that_sees_items_does_other_things_where_they_lie_elsewhere(
    card: PolicyCard,
) -> None:
    network = card.network.replace(sees_items=True, exploration=0.0)
    rng = np.random.default_rng(1)
    tensors = {
        name: rng.normal(0.0, 0.3, shape).astype(np.float32)
        for name, shape in tensor_shapes(network).items()
    }
    policy = LearnedPolicy(card.replace(network=network), tensors)
    rows = np.zeros((2, N_COLUMNS), np.float32)
    rows[:, RANGE_ITEMS : RANGE_ITEMS + N_BEAMS] = 2.0
    rows[1, RANGE_ITEMS + 3] = 0.2
    rows[:, TURN_RATE] = 0.0
    inputs = MotionView(Scenario(), **network.reads)
    inputs.begin(np.zeros(2, np.uint64))
    read = inputs.read(rows)
    assert policy.outputs_of(read[:1]).tolist() != policy.outputs_of(read[1:]).tolist()
    assert "range_items" not in policy.ignores
    assert "range_items" in LearnedPolicy.ignores
    assert network.model_dump()["sees_items"] is True
    assert "sees_items" not in card.network.model_dump()

    class Own(LearnedPolicy):
        """Asked for each command."""

    scenario = Scenario(n_robots=6, n_items=8, duration=20.0)
    digests = [
        run_episode(scenario, kind(policy.card, tensors), seed=2).digest
        for kind in (LearnedPolicy, Own)
    ]
    assert digests[0] == digests[1]


def test_a_network_that_talks_plays_where_messages_have_its_size_and_cards_say_so(
    talking: LearnedPolicy,
) -> None:
    with pytest.raises(PolicyError, match="message_size = 0: should be 2 for"):
        run_episode(Scenario(n_robots=2, duration=1.0), talking, seed=0)
    assert "neighbour_message" not in talking.ignores
    with pytest.raises(PolicyError, match="item_nearness and dock_nearness, and ROS carries no"):
        refuse_messages(talking, "ROS")
    assert charging(talking).messages == talking.messages == MESSAGES
    assert "neighbour_message" in LearnedPolicy.ignores
    assert talking.card.network.model_dump()["talks"] is True
    assert "talks" not in talking.card.network.replace(talks=False).model_dump()
