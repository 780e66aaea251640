"""What the built-in tasks say of their worlds."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.episode import run_episode
from swarm_logistics_env.study.tasks import Case, TaskWorld
from swarm_logistics_env.study.tasks.warehouse_task import CLEARING, RECORDED, WAREHOUSE
from swarm_logistics_env.world.warehouse import FAILURE_MODES, Fault

PAPER = "a warehouse of 10 m x 10 m with 60 items, robots of 2 m/s"
REALISTIC = "a warehouse of 10 m x 10 m with 60 items, robots of 1 m/s and differential drive"


@pytest.mark.parametrize(
    ("preset", "fields", "world", "nearest"),
    [
        ("paper", {}, PAPER, "preset paper"),
        ("paper", {"bodies": "dots"}, PAPER, "preset paper"),
        ("realistic", {}, f"{REALISTIC} that lift in 1 s", "preset realistic"),
        (
            "paper",
            {"robot_kinds": "lifter:4, scout:1"},
            f"{PAPER} (lifter:4, scout:1)",
            "preset paper with robot_kinds = lifter:4, scout:1",
        ),
        (
            "day",
            {"battery": 500.0, "n_items": 9},
            (
                "a warehouse of 16 m x 10 m (floor day) with 9 items that come back, robots of "
                "1 m/s and differential drive that lift in 1 s (porter:3, runner:1 max_speed=1.5 "
                "max_acceleration=3.0), batteries of 500 J, charging stations: 4"
            ),
            "preset day with n_items = 9 and battery = 500.0",
        ),
        (
            "paper",
            {"n_items": 9, "duration": 5.0, "n_robots": 3, "delivery_width": 1.5},
            "a warehouse of 10 m x 10 m with 9 items, robots of 2 m/s",
            (
                "preset paper with n_robots = 3 and n_items = 9 and delivery_width = 1.5 and "
                "duration = 5.0"
            ),
        ),
        (
            "paper",
            {"n_items": 9, "duration": 5.0, "n_robots": 3, "delivery_width": 1.5, "max_speed": 1.0},
            "a warehouse of 10 m x 10 m with 9 items, robots of 1 m/s",
            "",  # that much is no preset any more
        ),
    ],
)
def test_a_world_is_told_in_words(
    preset: str, fields: dict[str, Any], world: str, nearest: str
) -> None:
    scenario = Scenario.preset(preset).replace(**fields)
    assert WAREHOUSE.world_in_words(scenario) == world
    assert WAREHOUSE.preset_in_words(scenario) == nearest
    assert WAREHOUSE.engine(scenario) == scenario.bodies


def test_the_largest_p_is_the_number_of_items_that_do_not_come_back() -> None:
    scenario = Scenario(n_items=7)
    assert WAREHOUSE.largest_performance(scenario) == 7
    assert WAREHOUSE.largest_performance(scenario.replace(restock=True)) == math.inf
    assert CLEARING.largest_performance(scenario) == math.inf


def test_modes_and_fields_are_named_with_their_meaning() -> None:
    assert WAREHOUSE.mode_title("FM1") == FAILURE_MODES["FM1"].title != ""
    assert WAREHOUSE.mode_title("jam") == ""
    assert WAREHOUSE.failure_modes["FM1"] == FAILURE_MODES["FM1"].description
    assert {"n_items", "duration", "delivery_width"} <= WAREHOUSE.fields.keys()
    assert not {"n_robots", "restock", "floor"} & WAREHOUSE.fields.keys()
    assert WAREHOUSE.fields["duration"] == Scenario.model_fields["duration"].description


def test_a_command_shows_the_run_of_a_case() -> None:
    scenario = Scenario(n_robots=4, speed_mix=(1.0, 0.5))
    faults = (Fault("FM1", 1), Fault("FM4", 2, onset=5.0))
    fields: dict[str, Any] = {"scenario": scenario, "faults": faults, "task": WAREHOUSE}
    case = Case(PolicySpec(name="mine:Policy"), "", **fields)
    assert WAREHOUSE.watch_command(case) == (
        "swarm-logistics watch --policy mine:Policy --set n_robots=4 --set 'speed_mix=[1.0,0.5]' "
        "--fault FM1:1 --fault FM4:2@5"
    )
    assert (
        WAREHOUSE.watch_command(Case(PolicySpec(name="homing"), "", behaviour=1, **fields)) is None
    )
    named = Case(PolicySpec(name="homing"), "", scenario, task=WAREHOUSE)
    assert WAREHOUSE.watch_command(named) == (
        "swarm-logistics watch --policy homing --set n_robots=4 --set 'speed_mix=[1.0,0.5]'"
    )
    clearing: TaskWorld = CLEARING
    assert clearing.watch_command(case) is None


def test_a_run_of_a_case_is_the_episode_with_all_that_was_counted() -> None:
    scenario = Scenario.preset("orders").replace(n_robots=3, n_items=6, duration=4.0, order_due=2.0)
    faults = (Fault("FM4", 1),)
    case = Case(PolicySpec.of("homing"), "", scenario, faults, task=WAREHOUSE)
    case = replace(case, identity=case.policy.identity())
    episode = run_episode(scenario, case.policy.load(), 3, faults, 5)
    outcome = WAREHOUSE.play(case, 3, 5)
    counted = asdict(episode.contacts) | asdict(episode.orders)
    assert {*counted.values()} != {None}
    for name, value in counted.items():
        assert getattr(outcome, name) == value
    for name in ("ended_at", "all_delivered", "failed_robots", "anchoring_seconds", "digest"):
        assert getattr(outcome, name) == getattr(episode, name)
    assert outcome.delivery_times.tolist() == episode.delivery_times.tolist()


def test_conditions_of_recorded_trials_are_what_varies_in_them() -> None:
    scenario = RECORDED.vary(RECORDED.default, {"parameters": (("width", 1.5), ("load", 2.0))})
    assert scenario.conditions() == [("width", "1.5", ""), ("load", "2", "")]
    assert RECORDED.code() == "imported"
