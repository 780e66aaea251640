"""A small trained policy, as a card and as a file, and a module of policies of a user's own."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.policies.files import write_policy
from swarm_logistics_env.policies.learned import Network, PolicyCard, tensor_shapes

Tensors = dict[str, NDArray[np.float32]]

OWN_MODULE = """\
import numpy as np

class Still:
    def __init__(self, gripper=1.0):
        self.parameters = {"gripper": gripper}

    def reset(self, n_robots, seed): ...

    def act(self, observations):
        return np.tile([0.0, 0.0, 0.0, self.parameters["gripper"]], (len(observations), 1))

    class Inner:
        def reset(self, n_robots, seed): ...
        def act(self, observations): ...

class Leaving:
    def __init__(self): raise SystemExit(0)

class NoPolicy: ...

class Named(Still):
    identity = "weights 1"

number = 7
"""


@pytest.fixture
def card() -> PolicyCard:
    network = Network(hidden=(8, 6), exploration=0.5)
    return PolicyCard(name="small", network=network, seed=3, versions={"numpy": "2"})


@pytest.fixture
def tensors(card: PolicyCard) -> Tensors:
    rng, shapes = np.random.default_rng(0), tensor_shapes(card.network)
    made = {name: rng.normal(0, 0.5, shape).astype(np.float32) for name, shape in shapes.items()}
    return {**made, "deviations": np.full(3, 0.3, np.float32)}


@pytest.fixture
def file(card: PolicyCard, tensors: Tensors, tmp_path: Path) -> Path:
    path = tmp_path / "small.safetensors"
    write_policy(path, card, tensors)
    return path


@pytest.fixture
def own_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "own_policies.py"
    path.write_text(OWN_MODULE)
    (tmp_path / "leaving_module.py").write_text("raise SystemExit(0)\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_policies", raising=False)
    return path
