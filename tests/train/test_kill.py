"""Trainings as processes that are killed by SIGKILL, and go on."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from safetensors.numpy import load_file

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from swarm_logistics_env.train import trainer
from swarm_logistics_env.train.request import train_as_asked
from swarm_logistics_env.train.settings import Evaluation, Imitation

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")

TRAINING = """\
name = "tiny"
sizes = [3, 5]
worlds = 2
threads = 1
agent_steps = 3200

[scenario]
warehouse_width = 4.0
warehouse_height = 3.0
delivery_width = 2.0
n_items = 6
duration = 6.0
restock = true

[[conditions]]

[[conditions]]
modes = ["FM1", "removed"]
robots = [1]

[indicators]
weights = { R = 1.0, P = 0.1 }

[network]
hidden = [8]

[ppo]
n_steps = 20
n_minibatches = 2
epochs = 2
value_hidden = [8]

[evaluation]
every = 800
seeds = 4
n_robots = 5
faults = { FM4 = 1 }

[scores]
seeds = 0
"""
# The command line, but for checkpoints at every update instead of every 20 s.
SCRIPT = """\
from swarm_logistics_env.cli import app
from swarm_logistics_env.train import progress
progress.CHECKPOINT_EVERY = 0.0
app()
"""


def started(directory: Path) -> subprocess.Popen[str]:
    words = [sys.executable, "-c", SCRIPT, "train", "tiny.toml", "--out", "cut", "--device", "cpu"]
    return subprocess.Popen(words, cwd=directory, stderr=subprocess.PIPE, text=True)


def wait_for_checkpoints(process: subprocess.Popen[str], path: Path, number: int) -> None:
    """Return when the file was replaced so many times."""
    seen: set[int] = set()
    while len(seen) < number:
        if process.poll() is not None:
            raise AssertionError(f"ended before {number} checkpoints: {process.communicate()[1]}")
        if path.exists():
            seen.add(path.stat().st_mtime_ns)
        time.sleep(0.002)


def test_a_training_that_was_killed_ends_as_one_that_was_not(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TRAINING)
    whole = train_as_asked(str(tmp_path / "tiny.toml"), tmp_path / "whole", device="cpu")
    cut = tmp_path / "cut"
    with started(tmp_path) as process:
        wait_for_checkpoints(process, cut / "checkpoint.pt", 10)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not (cut / "tiny.safetensors").exists()
    with started(tmp_path) as process:
        told = process.communicate()[1]
    assert process.returncode == 0, told
    assert "tiny: 0 of" not in told
    assert_same_weights(cut / "tiny.safetensors", whole)
    assert curve(cut) == curve(whole.parent)


class Killed(BaseException):
    """Stands for kill -9: nothing of ours catches it."""


def test_a_training_that_was_killed_does_not_imitate_again(
    small: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    imitation = Imitation(rounds=1, seconds=2.0, sizes=(4,), fit=5, last_fit=5)
    training = small(imitation=imitation, evaluation=Evaluation(seeds=1, n_robots=3))
    whole = trainer.train(training, tmp_path / "whole")

    def dies(*_: Any) -> None:
        raise Killed

    with monkeypatch.context() as changed:
        changed.setattr(trainer, "Progress", dies)
        with pytest.raises(Killed):
            trainer.train(training, tmp_path / "cut")
    monkeypatch.setattr(trainer, "imitate", dies)
    assert_same_weights(trainer.train(training, tmp_path / "cut"), whole)


def assert_same_weights(one: Path, other: Path) -> None:
    first, second = load_file(one), load_file(other)
    assert first.keys() == second.keys()
    assert all(first[name].tobytes() == second[name].tobytes() for name in first)


def curve(directory: Path) -> list[list[str]]:
    """Return the rows of curve.csv but for the seconds, which are those of the clock."""
    rows = [line.split(",") for line in (directory / "curve.csv").read_text().splitlines()]
    assert len(rows) == 6
    return [[row[0], *row[2:]] for row in rows]
