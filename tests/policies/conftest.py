"""A small trained policy, as a card and as a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.observations import bounds
from swarm_logistics_env.policies.card import Network, PolicyCard
from swarm_logistics_env.policies.files import write_policy
from swarm_logistics_env.policies.learned import tensor_shapes
from swarm_logistics_env.scenario import Scenario

Tensors = dict[str, NDArray[np.float32]]


@pytest.fixture
def card() -> PolicyCard:
    network = Network(hidden=(8, 6), exploration=0.5)
    return PolicyCard(name="small", network=network, seed=3, versions={"numpy": "2"})


@pytest.fixture
def tensors(card: PolicyCard) -> Tensors:
    rng = np.random.default_rng(0)
    return {
        name: rng.normal(0, 0.5, shape).astype(np.float32)
        for name, shape in tensor_shapes(card.network).items()
    } | {"deviations": np.full(3, 0.3, np.float32)}


@pytest.fixture
def file(card: PolicyCard, tensors: Tensors, tmp_path: Path) -> Path:
    path = tmp_path / "small.safetensors"
    write_policy(path, card, tensors)
    return path


@pytest.fixture
def rows() -> NDArray[np.float32]:
    low, high = bounds(Scenario())
    return np.random.default_rng(1).uniform(low, high, (7, len(low))).astype(np.float32)
