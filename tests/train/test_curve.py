from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest
from rich.console import Console

from swarm_logistics_env.train.curve import LiveTable, TrainingLog


def test_the_best_evaluation_is_the_highest_and_the_curve_is_written(tmp_path: Path) -> None:
    rows = [(0, 1.0), (500, 40.0), (1000, 90.0), (1500, 80.0)]
    log = TrainingLog(
        [{"agent_steps": steps, "seconds": 2.0 * steps, "P": p} for steps, p in rows],
        {"swarm-dt": {"P": 37.0}},
    )
    assert log.best["agent_steps"] == 1000
    log.write(tmp_path)
    with (tmp_path / "curve.csv").open(newline="") as file:
        assert [float(row["P"]) for row in csv.DictReader(file)] == [1.0, 40.0, 90.0, 80.0]
    pytest.importorskip("matplotlib")
    log.draw(tmp_path / "curve.png", "ppo", seeds=4)
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")


REFERENCES = {"swarm-dt": {"P": 36.75}, "homing": {"P": 146.0}}


def test_a_terminal_of_80_columns_shows_all_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    written = io.StringIO()
    console = Console(file=written, force_terminal=True, width=80, color_system=None)
    before = [(0, {"P": 1.0, "R_FM4": 0.0}), (2_000_000, {"P": 51.0, "R_FM4": -0.5})]
    table = LiveTable(
        "ppo-[robust]", 8_000_000, "agent-steps", done=2_000_000, about="N = 25, 4 seeds",
        references=REFERENCES, before=[*before], console=console,
    )  # fmt: skip
    with table:
        now += 3.0
        table.reach(5_000_000)
        table.measured({"P": 49.5, "R_FM4": 0.25})
    written.truncate(0)
    written.seek(0)
    console.print(table)
    lines = written.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    text = "\n".join(line.rstrip() for line in lines)
    assert "ppo-[robust]" in text
    assert "5,000,000 of 8,000,000 agent-steps" in text
    assert "1,000,000 agent-steps/s, 0:03 left" in text
    words = [line.split() for line in lines]
    assert ["N", "=", "25,", "4", "seeds", "latest", "best", "swarm-dt", "homing"] in words
    assert ["P", "49.5", "51", "36.75", "146"] in words
    assert ["R_FM4", "0.25", "-0.5"] in words
    assert ["agent-steps", "5,000,000", "2,000,000"] in words


def test_a_pipe_gets_one_plain_line_per_evaluation(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with LiveTable("tiny", 8, "agent-steps", done=4, references=REFERENCES) as table:
        table.reach(6)
        table.measured({"P": 49.5, "R_FM4": 0.25})
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("tiny: 6 of 8 agent-steps, ")
    assert line.endswith(", P = 49.5 (swarm-dt 36.75, homing 146), R_FM4 = 0.25")
    assert "\x1b" not in line
