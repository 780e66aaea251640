"""Trained policies as ONNX files."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, policies
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.motion import INPUTS, OUTPUTS, MotionFrame
from swarm_logistics_env.policies import PolicyCard
from swarm_logistics_env.policies.files import CARD, DEVIATIONS, write_onnx
from swarm_logistics_env.policies.learned import STREAM, LearnedPolicy, explore
from swarm_logistics_env.streams import row_keys

TRAINED = [name for name in policies.NAMES if name.startswith("ppo-")]


def session_of(policy: Any, path: Path) -> Any:
    onnxruntime = pytest.importorskip("onnxruntime")
    write_onnx(policy, path)
    return onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])


def test_without_the_package_it_says_what_to_install(tmp_path: Path) -> None:
    script = (
        "import sys; sys.modules['onnx'] = None\n"
        "from swarm_logistics_env import policies\n"
        "from swarm_logistics_env.errors import PolicyError\n"
        "try: policies.write_onnx(policies.load('ppo-delivery'), 'p.onnx')\n"
        "except PolicyError as error: print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert "pip install -c constraints.txt '.[onnx]'" in done.stdout


def test_scripts_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PolicyError, match="policy = SwarmDT: should be a trained one"):
        write_onnx(policies.load("swarm-dt"), tmp_path / "p.onnx")


@pytest.mark.parametrize("name", TRAINED)
def test_it_says_what_numpy_says_on_every_row_of_an_episode(name: str, tmp_path: Path) -> None:
    trained: Any = policies.load(name)
    # The noise of a policy that explores is not in the file.
    network = trained.card.network.replace(exploration=0.0)
    policy = LearnedPolicy(trained.card.replace(network=network), trained.tensors)
    session = session_of(policy, tmp_path / "p.onnx")
    scenario = Scenario(n_robots=25, duration=40.0, restock=True)
    world = Warehouse(scenario)
    rows = world.reset(3, [Fault("FM1", 2), Fault("motor_dead", 2, onset=20.0)])
    policy.configure(scenario)
    policy.reset(25, 3)
    # Beside the policy, a frame of its own: with the same rows it has the same memories.
    frame = MotionFrame(scenario, policy.card.network.listens)
    keys = row_keys(3, STREAM, 25)
    frame.begin(keys)
    width = len(policy.card.network.inputs)
    about = session.get_modelmeta().custom_metadata_map
    assert PolicyCard.from_json(about[CARD]) == policy.card
    deviations = np.array(about[DEVIATIONS].split(), np.float32)
    assert deviations.any() == (policy.card.network.exploration > 0)
    furthest, n_rows, step = 0.0, 0, 0
    while not (world.is_over_time or world.all_delivered):
        inputs = frame.read(rows)
        ours = policy._network(inputs)
        [theirs] = session.run(None, {"inputs": inputs[:, :width]})
        assert theirs.shape == (25, len(OUTPUTS))
        furthest = max(furthest, float(np.abs(theirs - ours).max()))
        n_rows += len(rows)
        commands = policy.act(rows)
        if deviations.any():
            explore(keys, step, deviations, ours)
        np.testing.assert_array_equal(frame.command(ours), commands)
        step += 1
        rows = world.step(commands)
    assert n_rows == 10_000
    assert furthest < 1e-5
    assert world.state.delivered > 0


def test_other_networks_agree_too(
    card: PolicyCard, tensors: dict[str, NDArray[np.float32]], tmp_path: Path
) -> None:
    inputs = np.random.default_rng(0).normal(size=(50, len(INPUTS))).astype(np.float32)
    for activation in ("tanh", "relu"):
        network = card.network.replace(activation=activation)
        policy = LearnedPolicy(card.replace(network=network), tensors)
        session = session_of(policy, tmp_path / "p.onnx")
        [theirs] = session.run(None, {"inputs": inputs})
        np.testing.assert_allclose(theirs, policy._network(inputs), atol=1e-5)


def test_one_that_does_not_listen_ignores_timers(tmp_path: Path) -> None:
    trained: Any = policies.load("ppo-delivery")
    card = trained.card.replace(network=trained.card.network.replace(listens=False))
    session = session_of(LearnedPolicy(card, trained.tensors), tmp_path / "p.onnx")
    rng = np.random.default_rng(0)
    inputs = rng.normal(size=(5, len(card.network.inputs))).astype(np.float32)
    told = inputs.copy()
    lead = [place for place, name in enumerate(INPUTS) if name.startswith("lead_")]
    told[:, lead] = rng.normal(size=(5, len(lead)))
    np.testing.assert_array_equal(*(session.run(None, {"inputs": x})[0] for x in (inputs, told)))


def test_the_deviations_beside_it_make_the_commands_of_one_that_explores(
    card: PolicyCard,
    tensors: dict[str, NDArray[np.float32]],
    rows: NDArray[np.float32],
    tmp_path: Path,
) -> None:
    policy = LearnedPolicy(card, tensors)
    said = session_of(policy, tmp_path / "p.onnx").get_modelmeta().custom_metadata_map
    deviations = np.array(said[DEVIATIONS].split(), np.float32)
    policy.reset(len(rows), 3)
    frame, keys = MotionFrame(Scenario(), card.network.listens), row_keys(3, STREAM, len(rows))
    frame.begin(keys)
    outputs = policy._network(frame.read(rows))
    explore(keys, 0, deviations, outputs)
    np.testing.assert_array_equal(frame.command(outputs), policy.act(rows))
