from __future__ import annotations

import csv
from pathlib import Path

import pytest

from swarm_logistics_env.train.curve import TrainingLog


def test_the_best_evaluation_is_the_highest_and_the_curve_is_written(tmp_path: Path) -> None:
    rows = [(0, 1.0), (500, 40.0), (1000, 90.0), (1500, 80.0)]
    log = TrainingLog(
        [{"agent_steps": steps, "seconds": 2.0 * steps, "P": p} for steps, p in rows],
        {"swarm-dt": {"P": 37.0}, "homing": {"P": 146.0}},
    )
    told = log.sentence({"P": 49.5, "R_FM4": 0.25})
    assert told == "P = 49.5 (swarm-dt 37, homing 146), R_FM4 = 0.25"
    assert log.best["agent_steps"] == 1000
    log.write(tmp_path)
    with (tmp_path / "curve.csv").open(newline="") as file:
        assert [float(row["P"]) for row in csv.DictReader(file)] == [1.0, 40.0, 90.0, 80.0]
    pytest.importorskip("matplotlib")
    log.draw(tmp_path / "curve.png", "ppo", seeds=4)
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
