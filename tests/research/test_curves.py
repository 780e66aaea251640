"""Curves of P and R: what is played at each point, and what the tables say."""

from __future__ import annotations

from pathlib import Path

import pytest

from research import play_curves
from research.play_tables import PAGE
from research.tables import block_rows, curve_of
from swarm_logistics_env.study import Study
from tests.conftest import figures_drawn


def test_each_point_changes_one_thing_alone_and_items_go_with_robots() -> None:
    assert play_curves.conditions("items a robot", 4) == {
        "n_robots": 25, "n_items": 100, "duration": 500.0
    }  # fmt: skip
    assert play_curves.conditions("robots", 100)["n_items"] == 240
    assert play_curves.conditions("seconds", 125.0)["n_items"] == 60
    broken = {
        arm.case.scenario.n_robots: fault.model_dump()["robots"]
        for _, _, arm in play_curves.study().plan().cells
        for fault in arm.case.faults
    }
    assert broken == {5: 1, 10: 1, 25: 2, 50: 4, 100: 8}


@pytest.mark.daily
def test_a_table_of_a_curve_has_p_standstills_and_r_at_each_point(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(play_curves, "CURVES", {"robots": (3, 6), "seconds": (4.0,)})
    monkeypatch.setattr(play_curves, "DURATION", 3.0)
    study: Study = play_curves.study()
    study.out = None
    study.specification = study.specification.replace(policies=("homing",), seeds=2)
    study.run()
    results = study.findings()
    blocks = dict(play_curves.blocks(results))
    assert list(blocks) == ["curve_robots", "curve_seconds"]
    head, _, *rows = blocks["curve_robots"].splitlines()
    assert head == "| policy |  | 3 robots | 6 robots |"
    labels = ["P", "runs that stand still", "R"]
    assert [row.split(" | ")[1] for row in rows[:3]] == labels
    assert rows[1].startswith("| `homing` | runs that stand still | 100 % |")  # none in 3 s
    assert "FM4 in 8 % of the robots" in rows[-1]


def test_the_picture_shows_what_the_page_prints(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(play_curves, "MEDIA", tmp_path)
    with figures_drawn("png"):
        play_curves.draw()
    assert (tmp_path / "curves.png").stat().st_size > 1_000
    (first, *_) = block_rows(PAGE, "curve_items")
    drawn = curve_of(first[0], play_curves.ITEMS, first[2:])
    assert [drawn.label, *drawn.y[:2], drawn.low[0]] == ["swarm-dt", 16.5, 14.6, 13.5]
