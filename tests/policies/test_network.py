from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from swarm_logistics_env.policies.learned import FeedForward, hyperbolic_tangent

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
