"""`train`: what it prints of a policy that was trained, and of a training that is stopped."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("tensorboard")

from swarm_logistics_env.policies import read_card
from swarm_logistics_env.policies.catalogue import WEIGHTS
from swarm_logistics_env.train import load_training, trainer
from swarm_logistics_env.views.cli import app, train_command
from tests.views.cli.conftest import Command


@pytest.mark.parametrize(
    ("options", "fields", "out", "device"),
    [
        ("", {}, "results/train/ppo-small", None),
        (
            "--seed 0 --steps 7 --out 'my own' --device cpu",
            {"seed": 0, "agent_steps": 7},
            "my own",
            "cpu",
        ),
    ],
)
def test_a_training_that_is_stopped_says_how_to_go_on(
    options: str,
    fields: dict[str, Any],
    out: str,
    device: str | None,
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["train", "small", *shlex.split(options)]

    def stop(*arguments: object, **keywords: object) -> None:
        assert arguments == (load_training("small", **fields), Path(out))
        assert keywords == {"command": shlex.join(["swarm-logistics", *words]), "device": device}
        raise KeyboardInterrupt

    monkeypatch.setattr(trainer, "train", stop)
    assert app.run(words) == 130
    printed = capsys.readouterr()
    assert printed.err == "\nStopped. The same command goes on.\n"
    assert printed.out == (
        f"To follow it: tensorboard --logdir {shlex.quote(str(Path(out, 'tensorboard')))}\n"
    )


def test_scores_of_a_trained_policy_are_printed_with_their_intervals(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = WEIGHTS / "ppo-delivery.safetensors"
    card = read_card(path)
    score: Any = card.scores[0]
    monkeypatch.setattr(trainer, "train", lambda *_, **__: path)
    printed = command("train small")
    assert f"## {card.name}: scores on seeds it was not trained on\n" in printed
    assert "| measure | condition | value | low | high | seeds |\n" in printed
    assert "low, high: limits of the 95 % interval\n" in printed
    numbers = " | ".join(f"{number:.3g}" for number in (score.value, score.low, score.high))
    assert f"| {score.measure} | {score.condition} | {numbers} | {score.seeds} |" in printed
    last_lines = (
        f"Curve: {WEIGHTS / 'curve.png'}\n"
        f"Best on the evaluation's seeds: {WEIGHTS / 'best.safetensors'}\n"
        f"Written: {path}\n"
        f"Watch it: swarm-logistics watch --policy {path}\n"
        f"Judge it: swarm-logistics judge {path}\n"
    )
    assert printed.endswith(last_lines)
    one_sided = card.replace(scores=[score.replace(low=None, seeds=3)])
    monkeypatch.setattr(train_command, "read_card", lambda _: one_sided)
    assert f"| {score.value:.3g} | - | {score.high:.3g} | 3 |" in command("train small")
    monkeypatch.setattr(train_command, "read_card", lambda _: card.replace(scores=()))
    assert command("train small").partition("\n")[2] == last_lines
