"""The fit of the paper's swarm: its search, which sets fit, and the page of what was played."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from research import fit_paper as fit
from research import play_paper_fit as confirmed
from research import tables
from swarm_logistics_env import Fault, Scenario, run_episode
from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.study.questions.presets import load_preset
from swarm_logistics_env.study.verdicts.reference import PAPER

PLAYED = tables.ROOT / "docs" / "results" / "paper_fit"


def exact(cells: Any, factor: float = 1.0) -> dict[str, float]:
    """Return P of each cell as the paper has it, times a factor."""
    return {f"{s.name} = {s.value:g}": factor * PAPER.performance[s] for s in cells}


def test_the_sound_cells_hold_no_failed_robot_and_all_cells_are_the_papers() -> None:
    assert len(fit.SOUND) + len(fit.FAULTY) == len(PAPER.cells) == 33
    for setting in fit.SOUND:
        _, faults = fit.conditions(setting, 4.0)
        assert {fault.mode for fault in faults} <= {"removed"}
    assert {setting.name for setting in fit.FAULTY} == {"FM1", "FM2", "FM3", "FM4"}


def test_a_cell_is_the_run_of_its_scenario_with_these_constants() -> None:
    constants = fit.constants_at([0.5] * len(fit.RANGES))
    cell = next(s for s in fit.FAULTY if (s.name, s.value) == ("FM2", 2))
    scenario, _ = fit.conditions(cell, constants["radio_range"])
    assert scenario.radio_range == constants["radio_range"]
    chosen = {k: v for k, v in constants.items() if k not in ("radio_range", "full_speed")}
    episode = run_episode(scenario, SwarmDT(full_speed=True, **chosen), 7, [Fault("FM2", 2)])
    assert fit.play([cell], constants, 7) == {"FM2 = 2": episode.delivered}


def test_points_of_the_cube_are_constants_within_their_ranges() -> None:
    for share in (0.0, 0.3, 1.0):
        constants = fit.constants_at([share] * len(fit.RANGES))
        assert fit.point_of(constants) == pytest.approx([share] * len(fit.RANGES), abs=1e-3)
    beyond = fit.constants_at([1.7] * len(fit.RANGES))
    assert all(beyond[name] == high for name, (_, high) in fit.RANGES.items())


def test_a_set_fits_up_to_the_noise_of_one_run_a_cell() -> None:
    assert fit.largest_error(1) > fit.largest_error(2) > fit.largest_error(100) > 0.15
    for factor, does_fit in ((1.0, True), (1.2, True), (2.0, False)):
        performance: Any = exact(PAPER.cells, factor)  # no whole numbers
        row = fit.Tried("sound", 0, 0, {}, performance)
        assert confirmed.fits([row]) == does_fit


def test_what_was_tried_is_read_again_but_for_a_line_that_was_cut_short(
    tmp_path: Path,
) -> None:
    path = tmp_path / "tried.csv"
    constants = fit.constants_at([0.4] * len(fit.RANGES))
    rows = [
        fit.Tried("sound", 2, 5, constants, {name: int(p) for name, p in exact(cells).items()})
        for cells in (fit.SOUND, PAPER.cells)
    ]
    for row in rows:
        fit.append(row, path)
    text = path.read_text()
    path.write_text(text + text.splitlines()[-1][:60])
    assert fit.read_tried(path) == rows
    assert [fit.is_full(row) for row in rows] == [False, True]


def test_swarm_dt_is_as_deadlocked_by_fm4_as_by_fm4_jam() -> None:
    scenario = Scenario(n_robots=6, n_items=10, warehouse_width=4.0, warehouse_height=3.0)
    modes = ("FM4", "FM4_jam")
    runs = [run_episode(scenario, SwarmDT(), 0, [Fault(mode, 2)]) for mode in modes]
    assert runs[0].digest == runs[1].digest
    assert not runs[0].all_delivered


def test_the_page_shows_what_was_played() -> None:
    page = confirmed.PAGE.read_text(encoding="utf-8")
    assert tables.with_blocks(page, confirmed.blocks(PLAYED)) == page


def test_the_preset_plays_the_fit_without_failed_robots() -> None:
    rows = fit.read_tried(PLAYED / "confirmed.csv")
    constants = next(row.constants for row in rows if row.fit == "sound")
    preset = load_preset("paper-fit")
    (policy,) = preset.policies
    for fields in (preset.scenario.model_dump(), preset.sizes[0].scenario):
        assert fields["radio_range"] == constants["radio_range"]
    chosen = {name: value for name, value in constants.items() if name != "radio_range"}
    assert policy.parameters == chosen
