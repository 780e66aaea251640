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

from swarm_logistics_env.views.cli import app

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here")

TRAINING = """\
threads = 1
agent_steps = 800
worlds = [{ n_robots = 3 }, { n_robots = 5 }]
conditions = [{}, { modes = ["FM1", "removed"], robots = [1] }]
indicators = { weights = { S = 1.0, FT = 1.0, R = 1.0, P = 0.1 }, references = "measured" }
network = { hidden = [8] }
ppo = { n_steps = 20, n_minibatches = 2, epochs = 2, value_hidden = [8] }
evaluation = { every = 200, seeds = 2, n_robots = 5, faults = { FM4 = 1 } }
scores = { seeds = 0 }

[scenario]
warehouse_width = 4.0
warehouse_height = 3.0
n_items = 6
duration = 6.0
restock = true
"""
# The command line, but for checkpoints at every update instead of every 20 s, and for one after
# which the process is killed: from within, so that it always is the same one.
SCRIPT = """\
import os, signal, sys
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.train import training_callback
last, save, saved = int(sys.argv.pop(1)), training_callback.save_checkpoint, []
def save_and_die(*given):
    save(*given)
    saved.append(given)
    if len(saved) == last:
        os.kill(os.getpid(), signal.SIGKILL)
training_callback.CHECKPOINT_EVERY, training_callback.save_checkpoint = 0.0, save_and_die
app()
"""


def left_in(directory: Path) -> tuple[list[dict[str, bytes]], list[list[str]]]:
    """Return weights, and curve.csv but for the seconds, which no two trainings share."""
    networks = [load_file(directory / f"{name}.safetensors") for name in ("tiny", "best")]
    weights = [{name: t.tobytes() for name, t in network.items()} for network in networks]
    rows = [line.split(",") for line in (directory / "curve.csv").read_text().splitlines()]
    assert len(rows) == 5
    return weights, [[row[0], *row[3:]] for row in rows]


@pytest.mark.daily
def test_a_training_that_was_killed_ends_as_one_that_was_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("tiny.toml").write_text(TRAINING)
    words = ["train", "tiny.toml", "--device", "cpu", "--out"]
    assert app.run([*words, "whole"]) == 0
    script = [sys.executable, "-c", SCRIPT, "3", *words, "cut"]
    ended = subprocess.run(script, capture_output=True, text=True, check=False)
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    assert not Path("cut", "tiny.safetensors").exists()
    capsys.readouterr()
    part = Path("cut", f".best.{16 * '0'}.part.safetensors")  # as of a process killed meanwhile
    part.touch()
    assert app.run([*words, "cut"]) == 0
    assert not part.exists()
    assert "tiny: 0 of" not in capsys.readouterr().err
    assert left_in(Path("cut")) == left_in(Path("whole"))
