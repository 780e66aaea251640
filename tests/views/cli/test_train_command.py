"""`train`: what it prints of a policy that was trained, and of a training that is stopped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("tensorboard")

from swarm_logistics_env.policies import read_card
from swarm_logistics_env.policies.catalogue import WEIGHTS
from swarm_logistics_env.train import trainer
from swarm_logistics_env.views.cli import app
from tests.views.cli.conftest import Command


def test_a_training_that_is_stopped_says_how_to_go_on(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(trainer, "train", stop)
    assert app.run(["train", "small"]) == 130
    assert capsys.readouterr().err == "\nStopped. The same command goes on.\n"


def test_scores_of_a_trained_policy_are_printed_with_their_intervals(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = WEIGHTS / "ppo-delivery.safetensors"
    card = read_card(path)
    score: Any = card.scores[0]
    monkeypatch.setattr(trainer, "train", lambda *_, **__: path)
    printed = command("train small")
    assert f"## {card.name}: scores on seeds it was not trained on\n" in printed
    numbers = " | ".join(f"{number:.3g}" for number in (score.value, score.low, score.high))
    assert f"| {score.measure} | {score.condition} | {numbers} | {score.seeds} |" in printed
    assert f"Judge it: swarm-logistics judge {path}\n" in printed
