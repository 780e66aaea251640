"""Trainings as processes that are killed by SIGKILL, and go on."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from safetensors.numpy import load_file

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from swarm_logistics_env.train.request import train_as_asked

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")

TRAINING = """\
name = "tiny"
scenario = { warehouse_width = 4.0, warehouse_height = 3.0, delivery_width = 2.0, n_items = 6, duration = 6.0, restock = true }
sizes = [3, 5]
worlds = 2
threads = 1
agent_steps = 6400

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
every = 1600
seeds = 8
n_robots = 5
faults = { FM4 = 1 }

[scores]
seeds = 0
"""
# The command line, but for checkpoints at every update instead of every 20 s.
SCRIPT = """\
from swarm_logistics_env.cli import app
from swarm_logistics_env.train import trainer
trainer.CHECKPOINT_EVERY = 0.0
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


def test_a_training_that_was_killed_twice_ends_as_one_that_was_not(tmp_path: Path) -> None:
    (tmp_path / "tiny.toml").write_text(TRAINING)
    whole = train_as_asked(str(tmp_path / "tiny.toml"), tmp_path / "whole", device="cpu")
    cut = tmp_path / "cut"
    for _ in range(2):
        process = started(tmp_path)
        wait_for_checkpoints(process, cut / "checkpoint.pt", 12)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
        process.stderr.close()  # type: ignore[union-attr]
        assert not (cut / "tiny.safetensors").exists()
    process = started(tmp_path)
    assert process.communicate()[1].count("P =") < 5, "began anew"
    assert process.returncode == 0
    ours, other = load_file(cut / "tiny.safetensors"), load_file(whole)
    assert {name: tensor.tobytes() for name, tensor in ours.items()} == {
        name: tensor.tobytes() for name, tensor in other.items()
    }
    assert curve(cut) == curve(whole.parent)


def curve(directory: Path) -> list[list[str]]:
    """Return the rows of curve.csv but for the seconds, which are those of the clock."""
    rows = [line.split(",") for line in (directory / "curve.csv").read_text().splitlines()]
    assert len(rows) == 6
    return [[row[0], *row[2:]] for row in rows]
