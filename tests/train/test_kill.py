"""Trainings as processes that are killed by SIGKILL, and go on."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from safetensors.numpy import load_file

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from swarm_logistics_env.cli import app

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")

TRAINING = """\
name = "tiny"
threads = 1
agent_steps = 1600

[[worlds]]
n_robots = 3

[[worlds]]
n_robots = 5

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
references = 5.0

[network]
hidden = [8]

[ppo]
n_steps = 20
n_minibatches = 2
epochs = 2
value_hidden = [8]

[evaluation]
every = 400
seeds = 2
n_robots = 5
faults = { FM4 = 1 }

[scores]
seeds = 0
"""
# The command line, but for checkpoints at every update instead of every 20 s, and for one after
# which the process is killed: from within, so that it always is the same one.
SCRIPT = """\
import os, signal, sys
from swarm_logistics_env.cli import app
from swarm_logistics_env.train import trainer
last, save, saved = int(sys.argv.pop(1)), trainer.save_checkpoint, []
def save_and_die(*given):
    save(*given)
    saved.append(given)
    if len(saved) == last:
        os.kill(os.getpid(), signal.SIGKILL)
trainer.CHECKPOINT_EVERY, trainer.save_checkpoint = 0.0, save_and_die
app()
"""


def test_a_training_that_was_killed_ends_as_one_that_was_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "tiny.toml").write_text(TRAINING)
    whole = tmp_path / "whole" / "tiny.safetensors"
    words = ["train", str(tmp_path / "tiny.toml"), "--out", str(whole.parent), "--device", "cpu"]
    assert app.run(words) == 0
    cut = tmp_path / "cut"
    script = [sys.executable, "-c", SCRIPT, "5", "train", "tiny.toml", "--out", "cut"]
    script += ["--device", "cpu"]
    ended = subprocess.run(script, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    assert not (cut / "tiny.safetensors").exists()
    capsys.readouterr()
    words[words.index(str(whole.parent))] = str(cut)
    assert app.run(words) == 0
    assert "tiny: 0 of" not in capsys.readouterr().err
    assert_same_weights(cut / "tiny.safetensors", whole)
    assert_same_weights(cut / "best.safetensors", whole.with_name("best.safetensors"))
    assert curve(cut) == curve(whole.parent)


def assert_same_weights(one: Path, other: Path) -> None:
    first, second = load_file(one), load_file(other)
    assert first.keys() == second.keys()
    assert all(first[name].tobytes() == second[name].tobytes() for name in first)


def curve(directory: Path) -> list[list[str]]:
    """Return the rows of curve.csv but for the seconds, which no two trainings share."""
    rows = [line.split(",") for line in (directory / "curve.csv").read_text().splitlines()]
    assert len(rows) == 6
    return [[row[0], *row[3:]] for row in rows]
