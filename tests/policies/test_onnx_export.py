"""Trained policies as ONNX files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.policies import PolicyCard
from swarm_logistics_env.policies.files import CARD, DEVIATIONS, TEMPERATURE, write_onnx
from swarm_logistics_env.policies.learned import STREAM, LearnedPolicy, Network, tensor_shapes
from swarm_logistics_env.world.motion import INPUTS, MotionView
from swarm_logistics_env.world.motion.network_inputs import ROLE_INPUTS


def session_of(policy: Any, path: Path, robots: int | None = None) -> Any:
    onnxruntime = pytest.importorskip("onnxruntime")
    write_onnx(policy, path, robots)
    return onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])


def test_scripts_and_a_missing_package_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(PolicyError, match="policy = SwarmDT: should be a trained one"):
        write_onnx(policies.load("swarm-dt"), tmp_path / "p.onnx")
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(PolicyError, match=r"pip install -c constraints.txt -e '.\[onnx\]'"):
        write_onnx(policies.load("ppo-delivery"), tmp_path / "p.onnx")


def test_it_says_what_the_network_says_on_every_row_of_an_episode(tmp_path: Path) -> None:
    policy: Any = policies.load("ppo-delivery")
    session = session_of(policy, tmp_path / "p.onnx")
    about = session.get_modelmeta().custom_metadata_map
    assert PolicyCard.from_json(about[CARD]) == policy.card
    noise = policy.tensors["deviations"] * np.float32(policy.card.network.exploration)
    assert about[DEVIATIONS].split() == list(map(str, noise.tolist()))
    world = Warehouse(Scenario(n_robots=25, duration=20.0))
    rows, frame = world.reset(3), MotionView(world.scenario)
    frame.begin(row_keys(3, STREAM, 25))
    while not world.is_over_time:
        inputs = frame.read(rows)
        [outputs] = session.run(None, {"inputs": inputs})
        np.testing.assert_allclose(outputs, policy.outputs_of(inputs), rtol=0, atol=1e-5)
        rows = world.step(frame.command(outputs))


def test_one_that_says_classes_gives_their_logits(tmp_path: Path) -> None:
    network = Network(hidden=(8,), head="classes", role=True, exploration=0.5)
    rng = np.random.default_rng(0)
    shapes = tensor_shapes(network)
    tensors = {name: rng.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    policy = LearnedPolicy(PolicyCard(name="classes", network=network), tensors)
    session = session_of(policy, tmp_path / "p.onnx")
    assert session.get_modelmeta().custom_metadata_map[TEMPERATURE] == "0.5"
    inputs = rng.normal(size=(5, len(INPUTS) + len(ROLE_INPUTS))).astype(np.float32)
    [logits] = session.run(["logits"], {"inputs": inputs})
    np.testing.assert_allclose(logits, policy.outputs_of(inputs), rtol=0, atol=1e-5)


def test_one_that_does_not_listen_ignores_timers(
    card: PolicyCard, tensors: dict[str, NDArray[np.float32]], tmp_path: Path
) -> None:
    deaf = card.replace(network=card.network.replace(listens=False))
    session = session_of(LearnedPolicy(deaf, tensors), tmp_path / "p.onnx", robots=5)
    assert session.get_inputs()[0].shape == [5, len(INPUTS)]
    rng = np.random.default_rng(0)
    inputs = rng.normal(size=(5, len(INPUTS))).astype(np.float32)
    changed = inputs.copy()
    lead = [index for index, name in enumerate(INPUTS) if name.startswith("lead_")]
    changed[:, lead] = rng.normal(size=(5, len(lead)))
    np.testing.assert_array_equal(*(session.run(None, {"inputs": x})[0] for x in (inputs, changed)))
