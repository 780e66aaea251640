from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, run_episode
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.observations import RANGE_WALLS
from swarm_logistics_env.policies import PolicyCard, identity
from swarm_logistics_env.policies.card import Network, Output
from swarm_logistics_env.policies.learned import LearnedPolicy

Tensors = dict[str, NDArray[np.float32]]


def test_it_plays_swarms_of_any_size(card: PolicyCard, tensors: Tensors) -> None:
    policy = LearnedPolicy(card, tensors)
    for n_robots in (1, 12):
        assert run_episode(Scenario(n_robots=n_robots, duration=2.0), policy, 0).ended_at == 2.0


def test_a_robot_decides_alike_in_any_swarm(
    card: PolicyCard, tensors: Tensors, rows: NDArray[np.float32]
) -> None:
    large, small = LearnedPolicy(card, tensors), LearnedPolicy(card, tensors)
    large.reset(7, seed=4)
    small.reset(3, seed=4)
    for step in range(5):
        seen = rows + np.float32(step)
        assert large.act(seen)[:3].tobytes() == small.act(seen[:3]).tobytes()


def test_an_episode_follows_from_its_seed(
    card: PolicyCard, tensors: Tensors, rows: NDArray[np.float32]
) -> None:
    policy = LearnedPolicy(card, tensors)

    def played(seed: int) -> bytes:
        policy.reset(len(rows), seed)
        return b"".join(policy.act(rows).tobytes() for _ in range(3))

    first = played(0)
    assert played(1) != first
    assert played(0) == first


def test_commands_are_made_as_the_card_says(
    card: PolicyCard, tensors: Tensors, rows: NDArray[np.float32]
) -> None:
    tensors = {**tensors, "layers.2.weight": np.zeros((3, 6), np.float32)}
    tensors["layers.2.bias"] = np.array([-0.5, 9.0, -0.75], np.float32)
    network = card.network.replace(exploration=0.0)
    policy = LearnedPolicy(card.replace(network=network), tensors)
    policy.reset(len(rows), 0)
    expected = [0.5 * -0.5 + 0.5, 0.0, 1.0, -0.75]
    np.testing.assert_allclose(policy.act(rows), [expected] * len(rows), atol=1e-7)


def test_it_reads_the_columns_on_its_card_alone(tensors: Tensors, card: PolicyCard) -> None:
    network = Network(columns=("range_walls",), hidden=(4,), outputs=(Output(command="turn"),))
    rng = np.random.default_rng(0)
    tensors = {
        "input_shift": np.zeros(16, np.float32),
        "input_scale": np.ones(16, np.float32),
        "deviations": np.zeros(1, np.float32),
        "layers.0.weight": rng.normal(size=(4, 16)).astype(np.float32),
        "layers.0.bias": np.zeros(4, np.float32),
        "layers.1.weight": rng.normal(size=(1, 4)).astype(np.float32),
        "layers.1.bias": np.zeros(1, np.float32),
    }
    policy = LearnedPolicy(card.replace(network=network), tensors)
    policy.reset(1, 0)
    row = np.zeros((1, 140), np.float32)
    row[0, RANGE_WALLS] = 0.5
    seen = policy.act(row)
    row[0, RANGE_WALLS + 16] = 0.5
    assert (policy.act(row) == seen).all()
    row[0, RANGE_WALLS + 1] = 0.5
    assert (policy.act(row) != seen).any()


def test_the_wandering_inputs_wander(card: PolicyCard) -> None:
    from swarm_logistics_env.policies.inputs import Inputs
    from swarm_logistics_env.streams import row_keys

    inputs = Inputs(card.network, Scenario())
    inputs.begin(row_keys(0, "test", 500))
    rows = np.zeros((500, 140), np.float32)
    noise = np.stack([inputs.read(rows)[:, -2:] for _ in range(60)])
    assert noise.std() == pytest.approx(1.0, abs=0.05)
    assert noise.mean() == pytest.approx(0.0, abs=0.05)
    # After the noise time, 1 s of 0.1 s steps, 1/e is left.
    kept = (noise[20] * noise[30]).mean()
    assert kept == pytest.approx(np.exp(-1.0), abs=0.1)


def test_rows_begin_anew_by_themselves(card: PolicyCard) -> None:
    from swarm_logistics_env.policies.inputs import Inputs
    from swarm_logistics_env.streams import row_keys

    rows = np.zeros((4, 140), np.float32)

    def run(inputs: Inputs, steps: int) -> NDArray[np.float32]:
        for _ in range(steps):
            seen = inputs.read(rows)
            inputs.note(np.full((len(seen), 3), 0.25))
        return seen

    inputs, fresh, whole = (Inputs(card.network, Scenario()) for _ in range(3))
    for made in (inputs, whole):
        made.begin(row_keys(0, "test", 4))
    run(inputs, 3)
    inputs.begin(row_keys(9, "test", 4)[1:3], slice(1, 3))
    fresh.begin(row_keys(9, "test", 4))
    seen = run(inputs, 2)
    assert (seen[1:3] == run(fresh, 2)[1:3]).all()
    assert (seen[[0, 3]] == run(whole, 5)[[0, 3]]).all()


def test_identity_follows_weights_and_network_alone(card: PolicyCard, tensors: Tensors) -> None:
    policy = LearnedPolicy(card, tensors)
    told = identity(policy)
    run_episode(Scenario(n_robots=2, duration=1.0), policy, seed=3, faults=[Fault("FM1", 1)])
    assert identity(policy) == told
    assert identity(LearnedPolicy(card.replace(name="other", seed=7), tensors)) == told
    bolder = card.replace(network=card.network.replace(exploration=1.0))
    assert identity(LearnedPolicy(bolder, tensors)) != told
    moved = {**tensors, "layers.0.bias": tensors["layers.0.bias"] + np.float32(1e-3)}
    assert identity(LearnedPolicy(card, moved)) != told


def test_rows_of_another_number_are_refused(
    card: PolicyCard, tensors: Tensors, rows: NDArray[np.float32]
) -> None:
    policy = LearnedPolicy(card, tensors)
    policy.reset(3, 0)
    with pytest.raises(PolicyError, match="observations of 7 robots: reset was told 3"):
        policy.act(rows)
