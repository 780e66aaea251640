"""What is made of the times of a benchmark; no time is asserted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.floor import ForceFloor, record
from benchmarks.results import Contestant, in_turns, rows, save, shown
from swarm_logistics_env import Scenario, Warehouse


def test_ratios_are_medians_over_turns_and_are_shown_and_written(tmp_path: Path) -> None:
    seconds = {"base": iter([1.0, 2.0, 4.0]), "twice": iter([2.0, 4.0, 80.0])}
    contestants = [
        Contestant("base", "little", lambda: next(seconds["base"]), 100, 10),
        Contestant("twice", "more", lambda: next(seconds["twice"]), 100, 10, base="base"),
    ]
    in_turns(contestants, 3)
    entries = rows(contestants)
    assert entries[0]["agent_steps_per_second"] == 50.0
    assert entries[1]["microseconds_per_step"] == 400_000.0
    assert "2.00" in shown(entries)
    save(tmp_path, entries, {"import": 1.0})
    written = json.loads((tmp_path / "benchmark.json").read_text())
    assert [row["cost_to_base"] for row in written["contestants"]] == [None, 2.0]


@pytest.mark.daily
def test_the_floor_moves_robots_exactly_as_the_world_does() -> None:
    scenario = Scenario(n_robots=5, n_items=1)
    recording = record(scenario, 20)
    bare, world = ForceFloor(recording), Warehouse(scenario)
    world.reset(seed=0)
    at_first = world.state.robot_position.copy()
    is_free = np.ones(5, np.bool_)  # of contacts, which the floor solves with fewer iterations
    for step in range(20):
        bare.step(step)
        world.step(recording.commands[step])
        is_free &= ~world.state.robot_contact
    assert is_free.sum() >= 3
    position = world.state.robot_position
    assert np.linalg.norm(position - at_first, axis=1).max() > 0.5
    np.testing.assert_allclose(bare.state[:5, :2][is_free], position[is_free], atol=1e-9)
