from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra train")

from benchmarks.learning_speed import main, passes

TRAINING = """\
agent_steps = 320
worlds = [{ n_robots = 4 }]
scenario = { n_items = 10, warehouse_width = 5.0, warehouse_height = 4.0, duration = 5.0 }
network = { hidden = [4] }
ppo = { n_steps = 20, n_minibatches = 2, value_hidden = [4] }
evaluation = { n_robots = 4, seeds = 1 }
"""


def test_speeds_are_told_beside_that_of_a_scripted_policy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "tiny.toml").write_text(TRAINING)
    words = ["--preset", str(tmp_path / "tiny.toml"), "--out", str(tmp_path / "out")]
    main([*words, "--episodes", "1"])
    told = capsys.readouterr().out
    rates = {
        name: float(re.search(rf"{name} +. +([\d,]+)", told)[1].replace(",", ""))  # type: ignore[index]
        for name in ("collecting", "updating", "both", "playing swarm-dt")
    }
    assert 0 < rates["both"] < rates["collecting"]
    both = 1.0 / (1.0 / rates["collecting"] + 1.0 / rates["updating"])
    assert rates["both"] == pytest.approx(both, rel=0.02)


def test_when_a_policy_was_passed_is_told() -> None:
    row = {"agent_steps": 500_000, "cpu_seconds": 20.0, "P": 41.0}
    summary = {
        "references": {"swarm-dt": {"P": 37.0}, "homing": {"P": 146.0}},
        "passed": {"swarm-dt": row, "homing": None},
    }
    columns = [list(column.cells) for column in passes(summary, 1000.0).columns]
    assert columns[2:] == [["500,000", "not passed"], ["20", ""], ["20,000", ""]]
