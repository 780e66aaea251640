"""What a training changes and keeps between its updates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from safetensors.numpy import load_file

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from swarm_logistics_env import policies
from swarm_logistics_env.train.trainer import train
from swarm_logistics_env.train.training_worlds import NetworkView


def test_rewards_become_the_final_ones_as_the_training_goes_on(
    small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    weights: list[float] = []
    monkeypatch.setattr(
        NetworkView, "change_rewards", lambda _, rewards: weights.append(rewards["contact"])
    )
    train(small(final_rewards={"contact": -0.5}), tmp_path)
    assert weights == pytest.approx([-0.1, -0.2, -0.3, -0.4])


def test_a_training_may_end_in_the_policy_of_its_best_evaluation(
    small: Any, tmp_path: Path
) -> None:
    path = train(small(keep="best"), tmp_path)
    assert policies.read_card(path).agent_steps == 0  # none delivers, so the first is the best
    tensors = load_file(path)
    for name, tensor in load_file(path.with_name("best.safetensors")).items():
        assert (tensors[name] == tensor).all()
