from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from swarm_logistics_env.train.curve import TrainingLog


@pytest.fixture
def log() -> TrainingLog:
    """A training that passed swarm-dt at its second evaluation, and homing never."""
    rows = [(0, 1.0), (500, 40.0), (1000, 90.0), (1500, 80.0)]
    curve = [
        {"agent_steps": steps, "seconds": 2.0 * steps, "cpu_seconds": 1.0 * steps, "P": p}
        for steps, p in rows
    ]
    references = {"swarm-dt": {"P": 37.0}, "homing": {"P": 146.0}}
    return TrainingLog(curve, references, collecting=5.0, updating=10.0)


def test_the_summary_tells_when_scripted_policies_were_passed(
    log: TrainingLog, tmp_path: Path
) -> None:
    log.write(tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["passed"]["swarm-dt"]["agent_steps"] == 500
    assert summary["passed"]["homing"] is None
    assert summary["best"]["P"] == 90.0
    speed = {"collecting": 300, "updating": 150, "both": 100}
    assert summary["agent_steps_per_cpu_second"] == speed
    with (tmp_path / "curve.csv").open(newline="") as file:
        assert [float(row["P"]) for row in csv.DictReader(file)] == [1.0, 40.0, 90.0, 80.0]


def test_the_picture_is_one(log: TrainingLog, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    log.draw(tmp_path / "curve.png", "ppo", seeds=4)
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
