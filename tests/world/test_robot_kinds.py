"""Robots of several kinds: how a scenario names them, and what each of them can do."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.core.errors import FaultError, ScenarioError
from swarm_logistics_env.views.cli.world_choice import scenario_of
from swarm_logistics_env.world.observations import bounds
from swarm_logistics_env.world.scenario.robot_kinds import KIND_FIELDS
from swarm_logistics_env.world.warehouse.faults import failed_robots, fault_of, text_of

TEXT = "lifter:4 drive=differential, scout:1 max_speed=0.5 view_range=2.0 lifts=false"
MIXED = Scenario(n_robots=10, n_items=20).replace(robot_kinds=TEXT)
HOLDS = (1.0, 1.0, 0.0, 1.0)  # drives askew, and its gripper holds


@given(counts=st.lists(st.integers(1, 12), min_size=1, max_size=4), n_robots=st.integers(48, 150))
def test_any_first_robots_have_the_shares_of_the_kinds_whatever_the_swarm_size(
    counts: list[int], n_robots: int
) -> None:
    kinds = [{"name": f"kind_{number}", "count": count} for number, count in enumerate(counts)]
    scenario = Scenario(n_robots=n_robots).replace(robot_kinds=kinds)
    numbers = scenario.kind_numbers(n_robots)
    assert np.bincount(numbers[: sum(counts)]).tolist() == counts
    shares = np.array(counts) / sum(counts)
    for n in range(1, n_robots + 1):
        n_of_kind = np.bincount(numbers[:n], minlength=len(counts))
        assert (np.abs(n_of_kind - n * shares) <= len(counts) / 2).all()
    more = scenario.replace(n_robots=n_robots + 9)
    assert more.kind_numbers(more.n_robots)[:n_robots].tolist() == numbers.tolist()


def test_text_tables_json_and_the_command_line_say_the_same(tmp_path: Any) -> None:
    tables = [
        {"name": "lifter", "count": 4, "drive": "differential"},
        {"name": "scout", "max_speed": 0.5, "view_range": 2, "lifts": False},
    ]
    size: dict[str, Any] = {"n_robots": 10, "n_items": 20}
    for kinds in (tables, tuple(tables), MIXED.robot_kinds):
        assert Scenario(**size).replace(robot_kinds=kinds) == MIXED
    one_each = MIXED.replace(robot_kinds=" lifter , scout:3  lifts=false ")
    assert one_each.model_dump()["robot_kinds"] == "lifter:1, scout:3 lifts=false"
    assert Scenario.from_json(MIXED.to_json()) == Scenario(**MIXED.model_dump()) == MIXED
    assert MIXED.model_dump()["robot_kinds"] == TEXT
    file = tmp_path / "mixed.toml"
    file.write_text(
        "n_robots = 10\nn_items = 20\n[[robot_kinds]]\nname = 'lifter'\ncount = 4\n"
        "drive = 'differential'\n[[robot_kinds]]\nname = 'scout'\nmax_speed = 0.5\n"
        "view_range = 2\nlifts = false\n"
    )
    assert scenario_of(None, file, None) == MIXED
    changes = ["n_robots=10", "n_items=20", f"robot_kinds={TEXT}"]
    assert scenario_of("paper", None, changes) == MIXED
    (shown,) = (text for name, text, _ in MIXED.conditions() if name == "robot_kinds")
    assert shown == f"{TEXT} (default none)"


def test_a_scenario_without_kinds_is_written_as_before_there_were_any() -> None:
    assert "robot_kinds" not in Scenario().to_json()
    assert MIXED.replace(robot_kinds=()) == MIXED.replace(robot_kinds="")
    assert "robot_kinds" not in MIXED.replace(robot_kinds=[]).model_dump()
    largest = MIXED.replace(robot_kinds="a:10000 lifts=true")
    assert [kind.count for kind in largest.robot_kinds] == [10_000]


@pytest.mark.parametrize(
    ("kinds", "complaint"),
    [
        ("scout:0", r"count = 0 of the kind 'scout': should be 1 to 10000 robots"),
        ("a:10001", r"count = 10001 of the kind 'a': should be 1 to 10000 robots"),
        ("a, a:2", r"name = 'a' is given twice: should be once"),
        ("carrier:1", r"name = 'carrier': .* no role of robots"),
        ("1st:1", r"name = '1st': should be a letter, then letters"),
        ("a:99, b:1", r"n_robots = 25 has no robot of the kind 'b': should be more robots"),
        ("a max_sped=1", r"no field 'max_sped'; did you mean 'max_speed'"),
        ("a max_speed=-1", r"max_speed = -1: should be at least 1e-09"),
        ("a max_speed=9", r"physics_period = 0.02 s lets a robot cross 0.18 m"),
        ("a drive=tracks", r"drive = 'tracks': should be 'holonomic' or 'differential'"),
        ("a max_speed=1 max_speed=2", r"max_speed is set twice: should be set once"),
        ("a b", r"'a b' should be NAME\[:COUNT\] \[FIELD=VALUE"),
        ("a lifts=false", r"lifts = False in every kind: should be True in one of them"),
        ("a lifts=maybe", r"lifts = 'maybe': should be true or false"),
        ("a max_speed=fast", r"RobotKind.max_speed = 'fast': should be a number$"),
        ([{"name": "a", "count": 1.5}], r"RobotKind.count = 1.5: should be a whole number$"),
        (["a"], r"robot_kinds.0 = 'a': should be a table of fields$"),
        ("a, b robot_radius=0.2", r"radius = 0.2 m of the kind 'b': should be at most .* 0.125 m"),
        ("a robot_radius=0.03", r"a robot cross 0.04 m .* robot_radius / max_speed = 0.012 s"),
        ({"name": "a"}, r"should be a list of tables: \[\[robot_kinds\]\] in a TOML file"),
        (3, r"robot_kinds = 3: should be a list"),
    ],
)
def test_kinds_that_cannot_be_are_refused_in_words(kinds: Any, complaint: str) -> None:
    with pytest.raises(ScenarioError, match=complaint) as caught:
        Scenario(robot_kinds=kinds)
    assert "\n" not in str(caught.value)


def test_each_robot_is_able_to_do_what_its_kind_can_times_its_factors() -> None:
    kinds = (
        "plain, other robot_radius=0.1 robot_mass=6.0 max_speed=0.5 max_turn_rate=1.0 "
        "max_acceleration=2.0 drive=differential ranger_range=3.0 view_range=0.5 lifts=false"
    )
    scenario = Scenario(n_robots=4, n_items=2, speed_mix=(1.0, 1.0, 0.5)).replace(robot_kinds=kinds)
    world = Warehouse(scenario)
    world.reset(0, [Fault("view_reduced", (3,))])
    state = world.state
    assert state.robot_kind.tolist() == [0, 1, 0, 1]
    assert state.max_speed.tolist() == [2.0, 0.5, 1.0, 0.5]
    assert state.view_range.tolist() == [1.0, 0.5, 1.0, 0.25]
    assert state.lifts.tolist() == [True, False, True, False]
    assert {*scenario.robot_kinds[1].differing, "battery"} == set(KIND_FIELDS)
    for name in (
        "max_turn_rate", "max_acceleration", "ranger_range", "robot_radius", "robot_mass",
    ):  # fmt: skip
        of_kind = getattr(scenario.robot_kinds[1], name)
        assert getattr(state, name)[[0, 1]].tolist() == [getattr(scenario, name), of_kind]
    world.change(drive="differential", view_range=2.0)  # of the kinds that do not say otherwise
    assert state.is_holonomic.tolist() == [False] * 4
    assert state.view_range.tolist() == [2.0, 0.5, 2.0, 0.25]


def test_rows_have_one_length_and_stay_within_the_bounds_of_all_kinds() -> None:
    scenario = MIXED.replace(robot_kinds=f"{TEXT}, far ranger_range=4.0 max_turn_rate=9.0")
    low, high = bounds(scenario)
    world = Warehouse(scenario)
    rows = world.reset(1)
    rng = np.random.default_rng(1)
    for _ in range(30):
        assert ((rows >= low) & (rows <= high)).all()
        rows = world.step(rng.uniform(-1.0, 1.0, (10, 4)))
    assert rows.shape == (10, 141)


def test_a_fault_strikes_robots_of_its_kind_the_same_for_every_mode_and_nested() -> None:
    scouts = np.flatnonzero(MIXED.kind_numbers(10) == 1).tolist()
    for seed in range(5):
        struck = failed_robots(Fault("FM1", 1, kind="scout"), seed, MIXED).tolist()
        assert set(struck) < set(scouts)
        assert failed_robots(fault_of("removed:1:scout@9"), seed, MIXED).tolist() == struck
        assert failed_robots(Fault("FM4", 2, kind="scout"), seed, MIXED).tolist() == scouts
    world = Warehouse(MIXED)
    world.reset(0, ["dead:1:scout@0.1", "FM1:1:carrier@0.1"])
    world.step([HOLDS] * 10)
    assert set(np.flatnonzero([("dead" in names) for names in world.state.failure_modes])) < {
        *scouts
    }
    assert world.numbered_faults[0].kind is None
    text = "FM1:2:scout@5+3"
    assert text_of(fault_of(text)) == text
    assert "kind" not in Fault("FM1").model_dump()


@pytest.mark.parametrize(
    ("fault", "scenario", "complaint"),
    [
        ("FM1:1:scuot", MIXED, r"kind = 'scuot': should be a kind of robots \(lifter, scout\)"),
        ("FM1:1:scout", Scenario(), r"kind = 'scout': .* \(robot_kinds has none\)"),
        ("FM1:3:scout", MIXED, r"robots = 3 of kind = 'scout': should be at most 2"),
        ({"mode": "FM1", "kind": "scout", "role": "carrier"}, MIXED, "should be one of them"),
        ({"mode": "FM1", "kind": "scout", "robots": (1,)}, MIXED, "robots should be a number"),
    ],
)
def test_faults_of_kinds_that_cannot_be_are_refused(
    fault: Any, scenario: Scenario, complaint: str
) -> None:
    with pytest.raises(FaultError, match=complaint):
        Warehouse(scenario).reset(0, [fault])
