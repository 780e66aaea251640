"""The world that a command line means, and the words that mean it again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.core.errors import FaultError
from swarm_logistics_env.views.cli.judge_policy import JudgedWorld
from swarm_logistics_env.views.cli.world_choice import faults_of, options_of_world, scenario_of


@pytest.mark.parametrize(
    ("choice", "options"),
    [
        ((None, None, None, None), []),
        (("dots", None, ["duration=9"], None), ["--preset", "dots", "--set", "duration=9"]),
        (
            (None, Path("hall.toml"), ["a=1", "b=2"], "mujoco"),
            ["--scenario", "hall.toml", "--bodies", "mujoco", "--set", "a=1", "--set", "b=2"],
        ),
    ],
)
def test_the_options_of_a_world_choose_it_again(
    choice: tuple[Any, Any, Any, Any], options: list[str]
) -> None:
    assert options_of_world(*choice) == options


OPTIONS = ["--preset", "dots", "--set", "n_items=5", "--bodies", "mujoco"]
NAMES = ["preset-dots", "n-items-5", "bodies-mujoco"]


@pytest.mark.parametrize(
    ("fields", "words", "options_again"),
    [
        ({"options": []}, [], []),
        ({"options": OPTIONS}, NAMES, OPTIONS),
        (
            {"options": OPTIONS, "first_seed": 0},
            [*NAMES, "first-seed-0"],
            OPTIONS,
        ),
        (
            {"options": OPTIONS, "clearing": True, "performance": "on_time", "first_seed": 7},
            ["clearing", "on-time", *NAMES, "first-seed-7"],
            ["--performance", "on_time", "--clearing", *OPTIONS],
        ),
        (
            {"options": ["--set", f"floor={'a' * 60}"], "performance": "on_time"},
            ["on-time", f"floor-{'a' * 34}"],
            ["--performance", "on_time", "--set", f"floor={'a' * 60}"],
        ),
    ],
)
def test_a_judged_world_has_a_name_and_the_options_that_judge_in_it_again(
    fields: dict[str, Any], words: list[str], options_again: list[str]
) -> None:
    world = JudgedWorld(Scenario(), **{"clearing": False, **fields})
    assert world.words == words
    assert world.options_again == options_again


@pytest.mark.parametrize(
    ("preset", "usual", "scenario", "sentence"),
    [
        (None, None, Scenario.preset("paper").replace(n_items=9), ""),
        ("dots", Scenario(n_robots=7), Scenario.preset("dots").replace(n_items=9), ""),
        (
            None,
            Scenario(n_robots=7, restock=True),
            Scenario(n_robots=7, n_items=9, restock=True),
            (
                "In the world of the preset paper, where items come back; --preset or --scenario "
                "names another.\n"
            ),
        ),
        (
            None,
            Scenario(n_robots=7),
            Scenario(n_robots=7, n_items=9),
            "In the world of the preset paper; --preset or --scenario names another.\n",
        ),
    ],
)
def test_which_world_is_meant_is_told_where_nobody_named_one(
    preset: str | None,
    usual: Scenario | None,
    scenario: Scenario,
    sentence: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert scenario_of(preset, None, ["n_items=9"], usual=usual) == scenario
    assert capsys.readouterr().out == sentence


def test_a_fault_begins_before_the_episode_ends() -> None:
    scenario = Scenario(duration=20.0)
    assert faults_of(None, scenario) == []
    assert faults_of(["FM1:2@19.9", "dead"], scenario) == [
        Fault("FM1", 2, onset=19.9),
        Fault("dead", 1),
    ]
    reason = r"^--fault FM1@20: should begin before the episode ends at 20 s$"
    with pytest.raises(FaultError, match=reason):
        faults_of(["FM1@20"], scenario)
