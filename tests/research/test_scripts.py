"""What the other scripts count and write, from made-up numbers or from runs of seconds."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from research import (
    play_bodies,
    play_floors,
    play_medians,
    play_orders,
    play_published,
    play_readings,
    tables,
)
from swarm_logistics_env import Scenario
from swarm_logistics_env.spi import Interval
from swarm_logistics_env.world.scenario import CHIPMUNK
from tests.made_up import delivered, judged


def test_a_change_has_its_sign_and_an_interval_its_side() -> None:
    change = tables.percent_change(np.array([10.0, 20.0, 30.0]), np.array([11.0, 22.0, 33.0]))
    assert tables.signed_percent(change, 1) == "+10.0 % [10.0, 10.0]"
    assert tables.signed_percent(Interval(-1.0, None, None), 0) == "-1 %"
    intervals = [(0.1, 2.0), (-2.0, -0.1), (-1.0, 1.0), (0.0, 1.0), (None, None)]
    assert [tables.side(Interval(0.0, *ends)) for ends in intervals] == [1, -1, 0, 0, 0]


@pytest.mark.parametrize(("width", "n_racks"), [(1.0, 4), (0.75, 4), (1.5, 3), (2.0, 2)])
def test_a_hall_has_as_many_racks_as_its_aisles_leave_room_for(width: float, n_racks: int) -> None:
    floor = play_floors.hall(width).floor
    assert isinstance(floor, str)
    assert floor.count("==") == 28 * n_racks  # in 28 rows of cells


def test_a_run_falls_back_below_half_of_the_best_smaller_size() -> None:
    performances = {10: [8.0] * 6, 25: [20.0] * 6, 50: [12.0] * 6, 100: [11.0] * 6, 150: [9.9] * 6}
    performances[150][:2] = [10.0, 40.0]
    cells: Any = {
        ("homing", n): SimpleNamespace(
            mean=Interval(float(np.mean(p)), None, None), by_seed=np.array(p)
        )
        for n, p in performances.items()
    }
    none = "0 of 6 [0, 46] %"
    assert list(play_floors.fallen_back(cells, "homing")) == [none] * 3 + ["4 of 6 [22, 96] %"]


@pytest.mark.daily
def test_both_engines_of_a_world_stand_side_by_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(play_bodies, "ROOT", tmp_path)
    monkeypatch.setattr(tables, "usable_cores", lambda: 1)
    scenario = Scenario(n_robots=4, n_items=8, duration=40.0, restock=True)
    policies = ("swarm-dt", "homing", "homing-stock")
    world = play_bodies.World("small", scenario, CHIPMUNK, 3, faults=(), policies=policies)
    results = play_bodies.played(world)
    for _, _, condition, p, p_of_other, change, *contacts in play_bodies.p_rows(results):
        assert condition == "no fault"
        assert p == p_of_other
        assert change in ("+0 %", "–")
        assert contacts[0] == contacts[1]
    for _, _, interval, interval_of_other, word in play_bodies.order_rows(results):
        assert interval == interval_of_other
        assert word in ("holds", "open")
    shares = [*play_bodies.share_rows(results)]
    assert [pair for pair, *_ in shares][-1] == "`homing-stock` / `homing`"
    assert all(share == share_of_other for _, share, share_of_other in shares)


def test_the_page_of_published_sets_shows_what_was_judged(tmp_path: Path) -> None:
    rows = json.loads(play_published.ROWS.read_text(encoding="utf-8"))
    page = play_published.PAGE.read_text(encoding="utf-8")
    assert tables.with_blocks(page, play_published.blocks(rows)) == page
    trials = pd.DataFrame({"robots": [5, 10] * 10, "seed": np.repeat(range(10), 2)})
    trials["delivered"] = 2 * trials["robots"] + trials["robots"] * trials["seed"] % 3
    trials.to_csv(tmp_path / "trials.csv", index=False)
    judged = play_published.judged("milner-rates", str(tmp_path / "trials.csv"))
    assert judged["runs"] == 20
    ((_, sizes, _, verdicts, collapses),) = judged["scalability"]
    assert (sizes, verdicts, collapses) == ("5 → 10", "1 supported", "–")
    trials.assign(tags=trials["robots"]).to_csv(tmp_path / "trials.csv", index=False)
    refused = play_published.judged("milner-rates", str(tmp_path / "trials.csv"))
    assert refused["refused"].startswith("the number of robots and 'tags' change together")


@pytest.mark.daily
def test_published_controllers_stand_beside_published_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for walk in play_published.WALKS:
        (tmp_path / walk.file).write_text("{'robot': {'box': 'time'}, 3: {10: 400.0, 30: 25.0}}")
    briefly = play_published.SIMULATOR.replace(duration=1.0)  # too little to deliver 10 boxes
    monkeypatch.setattr(play_published, "SIMULATOR", briefly)
    rows = [*play_published.time_rows(tmp_path, sizes=(3,), n_runs=2)]
    assert [row[0] for row in rows] == ["task1", "task1-bias", "task1-bias", "task2-bias"]
    assert rows[0][1] == "`biased-walk (bias = 0.0)`"
    measured = "100 [100, 100]"
    assert rows[0][2:] == ["3", "400", measured, "25", measured, "1.00"]

    def outcome(_: str, setting: Any, seed: int) -> Any:
        return delivered(40 + seed % 3 - (20 if setting.name == "FM4" else 0))

    study = tables.example(tmp_path, "published_controllers", seeds=3, policies=["site-fidelity"])
    ((policy, p, p_in_fault, r, _),) = play_published.realistic_rows(judged(study, outcome))
    assert policy == "`site-fidelity`"
    assert (p[:4], p_in_fault[:4], r[:4]) == ("41.0", "21.0", "-0.4")


def test_a_reading_is_as_far_from_the_paper_as_its_cells(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(play_readings, "delivered", lambda *_: 38)
    processes: Any = SimpleNamespace(map=map)
    row = play_readings.row_of(0, 2, processes)
    assert row[2:] == ("38.0 (41)", "38.0 (38)", "38.0 (35)", "0.05", "0.30")
    assert play_readings.row_of(7, 2, processes)[-1] == "as shipped"


def test_the_median_of_an_even_number_is_the_lower_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shares = {"a": 1.2, "b": 0.8, "c": 1.1, "d": 0.9}
    monkeypatch.setattr(play_medians, "shares", lambda _: shares)
    monkeypatch.setattr(
        play_medians, "read_card", lambda path: SimpleNamespace(seed=len(path.name))
    )
    play_medians.main([*shares])
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "b: training seed 1, mean share 0.800"
    assert printed[-1] == "Median: d"


def test_both_rules_of_requests_stand_side_by_side(tmp_path: Path) -> None:
    def outcome(policy: str, setting: Any, seed: int) -> Any:
        return delivered(40 + seed % 3 - (20 if setting.name == "dead" else 0))

    study = tables.example(tmp_path, "request_timeout", seeds=3, policies=["homing"])
    rows = play_orders.robustness_by_rule(judged(study, outcome)).splitlines()
    assert rows[0].endswith("| R, one request until it is served | R, put back after 60 s |")
    faults = [row.split(" | ")[1] for row in rows[2:6]]
    assert faults == ["FM3", "FM4", "FM4_jam", "dead carriers"]
    assert "-0.4" in rows[5]
