from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env import Scenario, Warehouse, run_episode
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.policies import load
from swarm_logistics_env.world.scenario import SCENARIO_PRESETS, SOURCES


@given(
    n_robots=st.integers(1, 100),
    n_items=st.integers(1, 100),
    warehouse_width=st.floats(8.0, 40.0),
    delivery_width=st.floats(0.01, 3.0),
    duration=st.floats(0.1, 1e5),
    restock=st.booleans(),
    relay=st.sampled_from(["none", "gossip"]),
    view_range=st.floats(1e-3, 50.0),
)
def test_a_scenario_survives_json_to_the_last_bit(**fields: Any) -> None:
    scenario = Scenario(**fields)
    back = Scenario.from_json(scenario.to_json())
    assert (back, hash(back)) == (scenario, hash(scenario))


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        ({"n_robots": 0}, "Scenario.n_robots = 0: should be at least 1"),
        ({"duration": math.nan}, "duration = nan: should be a finite number"),
        ({"relay": "flood"}, "relay = 'flood': should be 'none' or 'gossip'"),
        ({"n_robot": 3}, "no field 'n_robot'; did you mean 'n_robots'?"),
        ({"n_robots": 0, "n_items": -1}, r"n_robots = 0: .*; .*n_items = -1: .*"),
        # What cannot be built.
        ({"warehouse_width": 0.5}, "delivery_width = 2.0 m leaves no storage: .* than .* 0.5 m"),
        (
            {"warehouse_width": 0.5, "warehouse_height": 0.5, "delivery_width": 0.1},
            r"n_robots = 25 of radius 0.125 m do not fit .* 0.4 x 0.5 m: should be at most 1 ",
        ),
        ({"n_obstacles": 300}, "n_obstacles = 300 .* should be at most 113"),
        ({"n_obstacles": 100, "n_items": 200}, "n_items = 200 .* should be at most 75 "),
        ({"warehouse_width": 2.2}, r"width - delivery_width = 0.2 m is narrower .* least 0.25 m"),
        ({"control_period": 0.05}, "control_period = 0.05 s should be a whole multiple of .* 0.02"),
        ({"physics_period": 0.05}, "physics_period = 0.05 s: should be at most 0.02 s, or robots"),
        ({"max_speed": 6.0}, r"lets a robot cross 0.12 m .* at most .* 0.0166667 s"),
        ({"duration": 0.05}, "duration = 0.05 s should be at least one control_period"),
        ({"n_requests": 61}, "n_requests = 61: should be at most n_items = 60"),
        ({"dock_capacity": 10.1}, "dock_capacity = 10.1: should be at most .* 10 per second"),
        # Numbers that no run survives.
        ({"duration": 1e308}, "duration = 1e.308: should be at most 1000000000"),
        (
            {"obstacle_radius": 1e-300},
            "obstacle_radius = 1e-300: should be at least 1e-09",
        ),
        ({"physics_period": 1e-8}, "physics steps of a control_period: should be at most 1000"),
    ],
)
def test_what_cannot_be_is_refused_with_the_reason(fields: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ScenarioError, match=complaint):
        Scenario(**fields)
    with pytest.raises(ScenarioError, match=complaint):
        Scenario().replace(**fields)


ONE: dict[str, Any] = {"n_robots": 1, "n_items": 1}


@pytest.mark.parametrize(
    ("fields", "beyond", "complaint"),
    [
        ({"duration": 0.1}, {"duration": 0.099}, "duration = 0.099 s should be at least one cont"),
        ({"n_requests": 60}, {"n_requests": 61}, "should be at most n_items = 60"),
        ({"dock_capacity": 10.0}, {"dock_capacity": 10.01}, "dock_capacity = 10.01: should be at"),
        ({"max_speed": 5.0}, {"max_speed": 5.01}, "lets a robot cross 0.1002 m between"),
        ({"physics_period": 1e-4}, {"physics_period": 9.9e-5}, "makes 1010.1 physics steps of a"),
        (
            {"robot_kinds": "a robot_radius=0.125"}, {"robot_kinds": "a robot_radius=0.126"},
            "robot_radius = 0.126 m of the kind 'a': should be at most the scenario's",
        ),
        (
            {"delivery_width": 9.75, **ONE}, {"delivery_width": 10.0, **ONE},
            "delivery_width = 10.0 m leaves no storage: should be less than",
        ),
        (
            {"warehouse_height": 0.25, **ONE}, {"warehouse_height": 0.24, **ONE},
            "warehouse_height = 0.24 m is narrower than .*: should be at least 0.25 m$",
        ),
        (
            {"warehouse_height": 0.6, "n_obstacles": 1, **ONE},
            {"warehouse_height": 0.59, "n_obstacles": 1, **ONE},
            "warehouse_height = 0.59 m is narrower than .*: should be at least 0.6 m$",
        ),
        (
            {"delivery_width": 9.7, "item_radius": 0.15, **ONE},
            {"delivery_width": 9.72, "item_radius": 0.15, **ONE},
            "delivery_width = 0.28 m is narrower than .*: should be at least 0.3 m$",
        ),
    ],
)  # fmt: skip
def test_what_lies_on_a_limit_can_be_and_what_lies_beyond_is_refused(
    fields: dict[str, Any], beyond: dict[str, Any], complaint: str
) -> None:
    Scenario(**fields)
    with pytest.raises(ScenarioError, match=complaint):
        Scenario(**beyond)


@pytest.mark.parametrize(
    ("field", "count"), [("n_robots", 651), ("n_items", 651), ("n_obstacles", 112)]
)
def test_as_many_as_it_says_fit_do_fit(field: str, count: int) -> None:
    smallest = Scenario(n_robots=1, n_items=1)  # which need the room of one obstacle
    Warehouse(smallest.replace(**{field: count})).reset(0)
    with pytest.raises(ScenarioError, match=field):
        smallest.replace(**{field: 652})


def test_conditions_list_every_field_with_its_value_unit_and_source() -> None:
    rows = {row[0]: row for row in Scenario(n_robots=7, max_speed=1.25).conditions()}
    for name, field in Scenario.model_fields.items():
        meaning = field.description or ""
        assert rows[name][2] == meaning
        # A length, a time and the like has its unit; the source comes last.
        assert not isinstance(field.default, float) or "[" in meaning, name
        kind, _, sources = meaning.rsplit("; ", 1)[-1].partition(": ")
        assert kind in ("source", "fitted", "chosen", "off"), name
        assert set(sources.split(", ")) <= (SOURCES.keys() if kind == "source" else {""}), name
    assert rows["n_robots"][1] == "7 (default 25)"
    assert rows["max_speed"][1] == "1.25 (default 2)"
    assert rows["n_items"][1] == "60"


def test_the_preset_of_dotbots_delivers_with_the_packages_own_bodies_too() -> None:
    scenario = Scenario.preset("dotbots")
    assert (scenario.bodies, scenario.drive, scenario.n_robots) == ("chipmunk", "differential", 20)
    assert run_episode(scenario.replace(duration=60.0), load("homing"), seed=0).delivered > 0


# Every value that a result, a stored study or a policy was measured with.
PAPER: dict[str, Any] = {
    "n_robots": 25, "n_items": 60, "floor": None, "cell_size": 0.5,
    "warehouse_width": 10.0, "warehouse_height": 10.0, "delivery_width": 2.0, "duration": 500.0,
    "restock": False, "n_requests": 1, "demand": "closed", "request_docks": "any",
    "request_timeout": None, "request_delay": 0.0, "request_loss": 0.0,
    "orders": "next", "order_rate": 0.1, "order_cycle": 100.0, "order_due": None,
    "announced": "oldest",
    "dock_capacity": None, "handling_time": 0.0, "n_obstacles": 0, "obstacle_radius": 0.3,
    "bodies": "chipmunk", "robot_radius": 0.125, "robot_mass": 3.0,
    "max_speed": 2.0, "max_acceleration": 20.0, "max_turn_rate": 6.0,
    "ranger_range": 2.0, "view_range": 1.0, "radio_range": 4.0, "pickup_range": 0.25,
    "drive": "holonomic", "heading_drift": 0.02, "speed_mix": (1.0,), "sensing_mix": (1.0,),
    "robot_kinds": (), "battery": None, "idle_power": 5.0, "driving_energy": 10.0,
    "lifting_energy": 20.0, "charging_power": 300.0, "n_stations": None, "dead_stations": 0,
    "memory_size": 2, "timer_limit": 10.0, "relay": "none",
    "ranger_noise": 0.0, "position_noise": 0.0, "sensor_dropout": 0.0, "radio_loss": 0.0,
    "message_size": 0, "item_radius": 0.125, "control_period": 0.1, "physics_period": 0.02,
}  # fmt: skip
REALISTIC: dict[str, Any] = {
    "drive": "differential", "max_speed": 1.0, "max_acceleration": 2.0, "ranger_noise": 0.03,
    "position_noise": 0.05, "sensor_dropout": 0.02, "radio_loss": 0.1, "heading_drift": 0.05,
    "handling_time": 1.0, "dock_capacity": 1.0,
}  # fmt: skip
PRESETS: dict[str, dict[str, Any]] = {
    "paper": {},
    "paper_scalability": {"n_items": 100},
    "dots": {"max_speed": 1.0, "max_acceleration": 2.0},
    "realistic": REALISTIC,
    "orders": {
        **REALISTIC, "duration": 600.0, "restock": True, "orders": "bursts", "order_rate": 0.15,
        "order_cycle": 200.0, "order_due": 60.0, "n_requests": 5, "request_timeout": 60.0,
    },
    "dotbots": {
        "n_robots": 20, "n_items": 20, "warehouse_width": 2.0, "warehouse_height": 2.0,
        "delivery_width": 0.4, "duration": 120.0, "restock": True, "n_requests": 5,
        "drive": "differential", "robot_radius": 0.05, "robot_mass": 0.2, "max_speed": 0.3,
        "max_acceleration": 2.0, "max_turn_rate": 4.9, "ranger_range": 0.8, "view_range": 0.4,
        "radio_range": 1.6, "pickup_range": 0.1, "heading_drift": 0.0, "item_radius": 0.05,
    },
}  # fmt: skip


def test_presets_are_those_that_results_were_measured_with() -> None:
    measured = {name: {**PAPER, **changes} for name, changes in PRESETS.items()}
    presets = {name: dict(preset) for name, preset in SCENARIO_PRESETS.items()}
    assert presets.pop("day")["n_robots"] == 16  # nothing was measured with it yet
    assert presets == measured
    with pytest.raises(ScenarioError, match="no scenario preset 'papr'; did you mean 'paper'"):
        Scenario.preset("papr")


def test_an_episode_has_enough_steps_for_its_duration() -> None:
    paper = Scenario.preset("paper")
    assert (paper.storage_width, paper.n_steps, paper.n_substeps) == (8.0, 5000, 5)
    realistic = Scenario.preset("realistic")
    assert (realistic.handling_steps, realistic.dock_period) == (10, 1.0)
    for duration, period, steps in ((0.7, 0.1, 7), (0.75, 0.1, 8), (2.0, 0.3, 7)):
        assert Scenario(duration=duration, control_period=period).n_steps == steps
