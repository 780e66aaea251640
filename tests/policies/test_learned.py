from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, run_episode
from swarm_logistics_env.policies import PolicyCard, identity
from swarm_logistics_env.policies.learned import (
    FeedForward,
    LearnedPolicy,
    explore,
    hyperbolic_tangent,
)
from swarm_logistics_env.streams import row_keys

Tensors = dict[str, NDArray[np.float32]]


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


def test_noise_is_of_each_robot_and_output_alone_and_of_its_deviation() -> None:
    noise, deviations = np.zeros((400, 3), np.float32), np.array([0.1, 1.0, 3.0], np.float32)
    explore(row_keys(0, "noise", 400), 5, deviations, noise)
    np.testing.assert_allclose(noise.std(axis=0), deviations, rtol=0.15)
    assert np.abs(np.corrcoef(noise.T) - np.eye(3)).max() < 0.2
    later = np.zeros_like(noise)
    explore(row_keys(0, "noise", 400), 6, deviations, later)
    assert np.abs([np.corrcoef(a, b)[0, 1] for a, b in zip(noise.T, later.T)]).max() < 0.2


def test_outputs_command_in_the_frame_of_motion(
    card: PolicyCard, tensors: Tensors, rows: NDArray[np.float32]
) -> None:
    tensors = {**tensors, "layers.2.weight": np.zeros((3, 6), np.float32)}
    tensors["layers.2.bias"] = np.array([0.6, 0.0, -9.0], np.float32)
    network = card.network.replace(exploration=0.0)
    policy = LearnedPolicy(card.replace(network=network), tensors)
    policy.reset(len(rows), 0)
    first, second = policy.act(rows), policy.act(rows)
    np.testing.assert_allclose(np.hypot(first[:, 0], first[:, 1]), 0.6, rtol=1e-6)
    np.testing.assert_allclose(second, first, atol=1e-7)  # straight on, whatever that is
    assert (first[:, 2] == 0.0).all()
    assert (first[:, 3] == -1.0).all()


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


WIDTHS = (20, 16, 9, 4)


@pytest.fixture
def layers() -> tuple[list[np.ndarray], list[np.ndarray]]:
    rng = np.random.default_rng(0)
    pairs = list(pairwise(WIDTHS))
    weights = [rng.normal(size=(n_out, n_in)).astype(np.float32) / 3 for n_in, n_out in pairs]
    return weights, [rng.normal(size=n_out).astype(np.float32) for _, n_out in pairs]


@pytest.mark.parametrize("rectify", [False, True])
def test_it_is_the_network_of_its_layers(
    layers: tuple[list[np.ndarray], list[np.ndarray]], rectify: bool
) -> None:
    weights, biases = layers
    rows = np.random.default_rng(1).normal(size=(50, WIDTHS[0])).astype(np.float32)
    rows[:, 5:9] = 0.0
    value = rows.astype(np.float64)
    for layer, (weight, bias) in enumerate(zip(weights, biases)):
        value = value @ weight.T + bias
        if layer < 2:
            value = np.maximum(value, 0.0) if rectify else np.tanh(value)
    outputs = FeedForward(weights, biases, rectify=rectify)(rows)
    np.testing.assert_allclose(outputs, value, rtol=0, atol=5e-6)


def test_a_row_does_not_depend_on_the_others(
    layers: tuple[list[np.ndarray], list[np.ndarray]],
) -> None:
    network = FeedForward(*layers, rectify=False)
    rows = np.random.default_rng(2).normal(size=(37, WIDTHS[0])).astype(np.float32)
    alone = np.concatenate([network(row[np.newaxis]) for row in rows])
    assert alone.tobytes() == network(rows).tobytes()


def test_the_hyperbolic_tangent_is_one() -> None:
    values = np.linspace(-12.0, 12.0, 20_001, dtype=np.float32)
    ours = [hyperbolic_tangent(value) for value in values]
    np.testing.assert_allclose(ours, np.tanh(values.astype(np.float64)), rtol=0, atol=5e-7)
