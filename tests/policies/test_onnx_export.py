"""Trained policies as ONNX files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, policies
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.motion import INPUTS, OUTPUTS, MotionView
from swarm_logistics_env.policies import PolicyCard
from swarm_logistics_env.policies.files import CARD, DEVIATIONS, write_onnx
from swarm_logistics_env.policies.learned import STREAM, LearnedPolicy, explore
from swarm_logistics_env.streams import row_keys

TRAINED = [name for name in policies.NAMES if name.startswith("ppo-")]


def session_of(policy: Any, path: Path) -> Any:
    onnxruntime = pytest.importorskip("onnxruntime")
    write_onnx(policy, path)
    return onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])


def test_scripts_and_a_missing_package_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(PolicyError, match="policy = SwarmDT: should be a trained one"):
        write_onnx(policies.load("swarm-dt"), tmp_path / "p.onnx")
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(PolicyError, match=r"pip install -c constraints.txt '.\[onnx\]'"):
        write_onnx(policies.load("ppo-delivery"), tmp_path / "p.onnx")


@pytest.mark.parametrize("name", [*TRAINED, "small.safetensors"])
def test_it_says_what_numpy_says_on_every_row_of_an_episode(
    name: str, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(file.parent)
    policy: Any = policies.load(name)
    session = session_of(policy, Path("p.onnx"))
    about = session.get_modelmeta().custom_metadata_map
    assert PolicyCard.from_json(about[CARD]) == policy.card
    deviations = np.array(about[DEVIATIONS].split(), np.float32)
    assert deviations.any() == (policy.card.network.exploration > 0)
    scenario = Scenario(n_robots=25, duration=40.0, restock=True)
    world = Warehouse(scenario)
    rows = world.reset(3, [Fault("FM1", 2), Fault("motor_dead", 2, onset=20.0)])
    policy.configure(scenario)
    policy.reset(25, 3)
    # Beside the policy, a frame of its own: with the same rows it has the same memories.
    frame = MotionView(scenario, policy.card.network.listens)
    keys = row_keys(3, STREAM, 25)
    frame.begin(keys)
    furthest = 0.0
    for step in range(400):
        inputs = frame.read(rows)
        ours = policy._network(inputs)
        [theirs] = session.run(None, {"inputs": inputs[:, : len(policy.card.network.inputs)]})
        assert theirs.shape == (25, len(OUTPUTS))
        furthest = max(furthest, float(np.abs(theirs - ours).max()))
        commands = policy.act(rows)
        if deviations.any():
            explore(keys, step, deviations, ours)
        np.testing.assert_array_equal(frame.command(ours), commands)
        rows = world.step(commands)
    assert world.is_over_time
    assert furthest < 1e-5


def test_one_that_does_not_listen_ignores_timers(
    card: PolicyCard, tensors: dict[str, NDArray[np.float32]], tmp_path: Path
) -> None:
    deaf = card.replace(network=card.network.replace(listens=False))
    session = session_of(LearnedPolicy(deaf, tensors), tmp_path / "p.onnx")
    rng = np.random.default_rng(0)
    inputs = rng.normal(size=(5, len(INPUTS))).astype(np.float32)
    told = inputs.copy()
    lead = [place for place, name in enumerate(INPUTS) if name.startswith("lead_")]
    told[:, lead] = rng.normal(size=(5, len(lead)))
    np.testing.assert_array_equal(*(session.run(None, {"inputs": x})[0] for x in (inputs, told)))
