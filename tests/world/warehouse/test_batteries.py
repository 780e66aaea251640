"""Batteries that are used and charged, and robots that stand when theirs are empty."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.core.errors import FaultError, ScenarioError
from swarm_logistics_env.world import observations as row
from tests.world.warehouse.conftest import EAST, FAR, HOLD, STAY, Build, steps

FULL: dict[str, Any] = {"battery": 1000.0, "driving_energy": 10.0, "idle_power": 5.0}
# With two stations: x = 10 - 0.25, y = 2.5 and 7.5.
ON_STATION = (9.75, 2.5)


def fill(world: Warehouse) -> None:
    world.state.batteries.energy[:] = world.state.able.battery


def test_a_robot_uses_what_standing_driving_gaining_speed_and_lifting_take(build: Build) -> None:
    world = build([(2.0, 5.0)], [(2.1, 5.0), FAR], **FULL, lifting_energy=20.0)
    used = world.state.batteries.used
    steps(world, STAY, times=10)
    assert used[0] == pytest.approx(5.0)
    steps(world, HOLD)
    assert used[0] == pytest.approx(5.5 + 20.0)
    x = world.state.robot_position[0, 0]
    steps(world, (0.25, 0.0, 0.0, 0.0), times=20)
    way = world.state.robot_position[0, 0] - x
    kinetic = 0.5 * world.scenario.robot_mass * 0.5**2  # at a quarter of 2 m/s
    assert used[0] == pytest.approx(25.5 + 10.0 + 10.0 * way + kinetic, rel=1e-3)
    before = used[0]
    steps(world, STAY)  # braking gives nothing back
    assert used[0] >= before + 0.5


def test_an_empty_robot_stands_tells_nothing_and_lifts_nothing(build: Build) -> None:
    world = build([(8.5, 5.0), (8.5, 6.0)], [(8.5, 5.1)], battery=500.0, driving_energy=0.0)
    world.state.batteries.energy[:] = (0.01, 500.0)
    steps(world, STAY, STAY)
    assert world.state.robot_is_empty.tolist() == [True, False]
    rows = steps(world, (0.0, 1.0, 1.0, 1.0), STAY, times=20)
    assert world.state.robot_position[0] == pytest.approx([8.5, 5.0])
    assert world.state.robot_heading[0] == 0.0
    assert world.state.robot_item[0] == -1
    assert rows[1, row.LOWEST_TIMER] == 0.0
    # What has emptied above a station goes on.
    world.state.robot_is_empty[:] = False
    world.state.batteries.energy[:] = 500.0
    assert steps(world, STAY, STAY, times=2)[1, row.LOWEST_TIMER] == 1.0


def test_a_station_charges_who_stands_on_it_until_the_battery_is_full(build: Build) -> None:
    world = build([ON_STATION, (9.0, 2.5)], [FAR], **FULL, n_stations=2, charging_power=100.0)
    batteries = world.state.batteries
    batteries.energy[:] = 500.0
    rows = steps(world, STAY, STAY, times=10)
    assert batteries.energy == pytest.approx([595.0, 495.0])
    battery = rows[:, -row.N_BATTERY_COLUMNS :]
    assert battery[:, row.BATTERY.charge] == pytest.approx([0.595, 0.495])
    assert battery[:, row.BATTERY.charging].tolist() == [1.0, 0.0]
    station = battery[1, row.BATTERY.stations :][: row.STATION_WIDTH]
    assert station.tolist() == pytest.approx([1.0, 0.75, 0.0])
    steps(world, STAY, STAY, times=100)
    assert batteries.energy[0] == pytest.approx(1000.0)
    assert world.state.robot_charge[0] == pytest.approx(1.0)


def test_a_dead_station_is_seen_and_charges_nobody(build: Build) -> None:
    world = build([ON_STATION, (9.75, 7.5)], [FAR], **FULL, n_stations=2)
    world.state.batteries.energy[:] = 500.0
    world.change(dead_stations=1)
    rows = steps(world, STAY, STAY)
    battery = rows[:, -row.N_BATTERY_COLUMNS :]
    assert sorted(battery[:, row.BATTERY.charging]) == [0.0, 1.0]
    assert battery[:, row.BATTERY.stations].tolist() == [1.0, 1.0]
    world.change(dead_stations=0)
    steps(world, STAY, STAY)
    assert (world.state.batteries.station >= 0).all()


def test_a_cell_that_fades_holds_less_and_loses_what_is_beyond(build: Build) -> None:
    fault = Fault("cell_fades", (0,), factor=0.5)
    fields = {**FULL, "duration": 10.0, "idle_power": 0.0}
    world = build([(2.0, 5.0), (4.0, 5.0)], [FAR], [fault], **fields)
    fill(world)
    steps(world, STAY, STAY, times=50)
    assert world.state.batteries.energy == pytest.approx([750.0, 1000.0], abs=6.0)
    assert world.state.robot_charge.tolist() == pytest.approx([1.0, 1.0], abs=0.01)


def test_a_cell_fades_only_where_there_are_batteries() -> None:
    with pytest.raises(FaultError, match="cell_fades: should have robots with batteries"):
        Warehouse(Scenario()).reset(0, ["cell_fades:2"])


def test_a_robot_drives_until_its_battery_is_empty(build: Build) -> None:
    world = build([(1.0, 5.0)], [FAR], battery=60.0, n_stations=0, idle_power=0.0)
    fill(world)
    steps(world, EAST, times=100)
    way = world.state.robot_position[0, 0] - 1.0
    # 6 J to gain 2 m/s, and what is left for the way.
    assert 10.0 * way == pytest.approx(54.0, abs=3.0)
    assert world.state.robot_is_empty[0]
    assert world.state.batteries.energy[0] == 0.0


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"dead_stations": 1}, "dead_stations = 1: should have batteries"),
        ({"n_stations": 1}, "n_stations = 1: should have batteries"),
        (
            {"robot_kinds": [{"name": "scout", "count": 1, "battery": 500.0}]},
            "battery = 500 of the kind 'scout': should stand beside the scenario's battery",
        ),
        ({"battery": 5000.0, "dead_stations": 5}, "dead_stations = 5: should be at most 4"),
        ({"battery": 50.0}, r"battery = 50 J .* a robot the 9.8 m .* at least 123 J"),
        ({"battery": 5000.0, "floor": "A::\n:::"}, r'the plan has no charging station \("\*"\)'),
        ({"battery": 5000.0, "floor": "A:*", "n_stations": 2}, "n_stations = 2 should be left out"),
        ({"battery": 5000.0, "floor": "A:#\n:#*"}, "line 2, column 3: no way leads from this stat"),
    ],
)
def test_batteries_that_cannot_be_are_refused(fields: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ScenarioError, match=complaint):
        Scenario(**{"n_robots": 1, "n_items": 1, **fields})


def test_stations_of_a_plan_stand_in_the_middle_of_their_cells() -> None:
    scenario = Scenario(floor="A::*\n*:::", n_robots=1, n_items=1, battery=500.0)
    assert scenario.stations.tolist() == [[0.25, 0.25], [1.75, 0.75]]
    assert len(Scenario().stations) == 0


def test_robots_start_with_half_a_battery_to_a_full_one() -> None:
    world = Warehouse(Scenario(battery=5000.0, n_robots=40))
    world.reset(0)
    energy = world.state.batteries.energy
    assert 2500.0 <= energy.min() < energy.max() <= 5000.0
    np.testing.assert_array_equal(world.state.robot_charge, energy / 5000.0)


def test_robots_of_every_kind_have_to_reach_a_station() -> None:
    kinds = [{"name": "fast", "count": 3}, {"name": "slow", "count": 1, "max_speed": 0.1}]
    with pytest.raises(ScenarioError, match=r"battery = 200 J .* of the kind 'slow' .* 590 J"):
        Scenario().replace(battery=200.0, robot_kinds=kinds)
    mixed = Scenario().replace(battery=600.0, robot_kinds=kinds)
    assert mixed.of_robot(3).max_speed in (0.1, 2.0)
