"""Who fails, when and what is lost; see tests/verification/test_combined_faults.py as well."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.core.errors import FaultError
from swarm_logistics_env.world.observations import N_BEAMS
from swarm_logistics_env.world.scenario import ROLES
from swarm_logistics_env.world.warehouse.faults import (
    Occurrence,
    failed_robots,
    fault_of,
    text_of,
)
from swarm_logistics_env.world.warehouse.state import robots_in_role, roles_of
from tests.world.warehouse.conftest import FAR, HOLD, INSIDE, SMALL, STAY, WEST, Build, steps


@given(seed=st.integers(0, 2**40), n_robots=st.integers(1, 60), data=st.data())
def test_chosen_sets_are_nested_the_same_for_every_mode_and_of_the_right_size(
    seed: int, n_robots: int, data: st.DataObject
) -> None:
    m = data.draw(st.integers(1, n_robots))
    scenario = Scenario(n_robots=n_robots)
    chosen = failed_robots(Fault("FM1", m), seed, scenario)
    assert len(set(chosen)) == m
    assert set(chosen) <= set(range(n_robots))
    for mode in ("removed", "FM4", "dead"):
        np.testing.assert_array_equal(failed_robots(Fault(mode, m, 7.0), seed, scenario), chosen)
    if m > 1:
        assert set(failed_robots(Fault("FM1", m - 1), seed, scenario)) < set(chosen)


def test_each_robot_has_its_turn_and_faults_do_not_move_where_things_start() -> None:
    ten = Scenario(n_robots=10)
    turns = np.bincount([failed_robots(Fault("FM1"), seed, ten)[0] for seed in range(200)])
    assert 5 < turns.min() <= turns.max() < 45
    world, sound = Warehouse(SMALL), Warehouse(SMALL)
    sound.reset(9)
    world.reset(9, [Fault("dead", (4,)), Fault("removed", (2,))])
    assert world.struck_robots == (2, 4)
    np.testing.assert_array_equal(world.state.item_position, sound.state.item_position)
    remaining, expected = (np.delete(w.state.robot_position, 2, 0) for w in (world, sound))
    np.testing.assert_array_equal(remaining, expected)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"mode": "FM9"}, "no failure mode 'FM9'; did you mean 'FM"),
        ({"robots": 0}, "Fault.robots = 0: "),
        ({"robots": (2, 0, 2)}, r"\(2, 0, 2\): should name each robot once"),
        ({"role": "carier"}, "Fault.role = 'carier': should be 'carrier', "),
        (
            {"role": "carrier", "robots": (1,)},
            r"^Fault: role = 'carrier': .* a number, not \(1,\)$",
        ),
        (
            {"role": "carrier", "kind": "a"},
            "role = 'carrier' and kind = 'a': should be one of them",
        ),
        ({"onset": float("nan")}, "Fault.onset = nan: "),
        ({"duration": 0.0}, "Fault.duration = 0.0: "),
        (
            {"factor": 0.5},
            "FM1 takes no factor; modes that do: motor_slow, motor_wear, cell_fades, view_reduced$",
        ),
        ({"mode": "motor_slow", "factor": 1.0}, "Fault.factor = 1.0: "),
        ({"mode": "removed", "duration": 5.0}, "duration should be None"),
        ({"mode": "removed", "intermittent": (5, 5)}, "intermittent should be None"),
        ({"mode": "away"}, "duration = None: should say when robots that are away come back"),
        ({"intermittent": (0.0, 5.0)}, "= 0.0: "),
    ],
)
def test_an_impossible_fault_is_refused_with_the_reason(
    arguments: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(FaultError, match=complaint):
        Fault(**{"mode": "FM1", **arguments})


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("FM1:2@1234.567", Fault("FM1", 2, onset=1234.567)),
        ("FM4_jam:2:carrier@100+50", Fault("FM4_jam", 2, 100.0, 50.0, role="carrier")),
        ("dead:3@0+2.5", Fault("dead", 3, 0.0, 2.5)),
        ("away:2@100+100", Fault("away", 2, 100.0, 100.0)),
        (None, Fault("motor_slow", 2, onset=200.0, duration=50.0, factor=0.1)),
        (None, Fault("FM4", [3, 7])),
        (None, Fault("rangers_blind", 2, intermittent=(5.0, 2.5))),
    ],
)
def test_a_fault_survives_json_and_as_text_where_there_is_one(
    text: str | None, fault: Fault
) -> None:
    assert text_of(fault) == text
    assert text is None or fault_of(text) == fault
    assert len({fault, Fault.from_json(fault.to_json())}) == 1
    assert Fault(**json.loads(json.dumps(fault.model_dump(mode="json")))) == fault
    assert ("role" in fault.to_json()) == (fault.role is not None)  # stored runs stay known


@pytest.mark.parametrize("text", ["FM4:carrier", "FM4:2:@9", "FM4+5", "FM4:2@9+", "FM4@-1", ""])
def test_what_does_not_read_so_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(FaultError, match=r"should be MODE\[:ROBOTS"):
        fault_of(text)
    assert fault_of("FM4@.5") == Fault("FM4", onset=0.5)  # parts may be left out


@pytest.mark.parametrize(
    ("text", "remedy"), [("late:2@100", r"late:2@0\+100"), ("late@.5", r"late:1@0\+.5")]
)
def test_late_robots_without_a_duration_are_refused_with_the_text_that_was_meant(
    text: str, remedy: str
) -> None:
    with pytest.raises(FaultError, match=f"begin when it ends: should be {remedy}"):
        fault_of(text)


# -- what is lost -------------------------------------------------------------------------------


def test_frozen_rangers_repeat_what_they_read_at_the_onset_until_they_recover(
    build: Build,
) -> None:
    # Twice, so that the second time it is what they read then.
    faults = [Fault("rangers_frozen", (0,), onset=at, duration=0.5) for at in (0.3, 0.9)]
    world = build([(2.0, 5.0), (9.0, 1.0)], [FAR], faults, ranger_noise=0.01)
    sound = build([(2.0, 5.0), (9.0, 1.0)], [FAR], ranger_noise=0.01)
    true, seen = [
        [steps(each, WEST, STAY)[0, : 3 * N_BEAMS] for _ in range(15)] for each in (sound, world)
    ]
    for step in range(1, 16):
        begun = 3 if 3 <= step < 8 else 9 if 9 <= step < 14 else step
        np.testing.assert_array_equal(seen[step - 1], true[begun - 1])
    assert not np.array_equal(true[3], true[6])


@pytest.mark.parametrize(("failed", "held_up"), [((0,), 1), ((0, 1), 0), ((1, 2), 1)])
def test_sound_robots_that_touch_failed_ones_are_held_up(
    build: Build, failed: tuple[int, ...], held_up: int
) -> None:
    world = build([(2.0, 5.0), (2.255, 5.0), (8.0, 1.0)], [FAR], [Fault("FM1", failed)])
    steps(world, STAY, STAY, STAY, times=10)
    assert world.state.anchoring_seconds == pytest.approx(held_up * 1.0)


# -- when, and by role --------------------------------------------------------------------------


def held(fault: Fault, n_robots: int = 8, seed: int = 5) -> NDArray[np.bool_]:
    """Return whether each robot has failed after each step, (400, N)."""
    world = Warehouse(SMALL.replace(n_robots=n_robots))
    world.reset(seed, [fault])
    failed = np.zeros((400, n_robots), np.bool_)
    for step in range(400):
        steps(world, *[STAY] * n_robots)
        failed[step] = world.state.failed
    return failed


def test_an_intermittent_fault_comes_and_goes_at_times_of_each_robots_own() -> None:
    fault = Fault("rangers_blind", (1, 4), onset=2.0, intermittent=(1.0, 0.5))
    failed = held(fault)
    assert not failed[:, [0, 2, 3, 5, 6, 7]].any()
    assert not failed[:19].any()
    assert failed[19, [1, 4]].all()  # it begins with its onset
    for robot in (1, 4):
        assert np.count_nonzero(np.diff(failed[:, robot])) > 10
        assert 0.45 < failed[19:, robot].mean() < 0.9  # two thirds are expected
    assert (failed[:, 1] != failed[:, 4]).any()
    # Neither the number of robots nor who else fails changes a robot's times.
    other = held(Fault("rangers_blind", (4, 6), onset=2.0, intermittent=(1.0, 0.5)), 10)
    np.testing.assert_array_equal(other[:, 4], failed[:, 4])
    assert (held(fault, seed=6)[:, 1] != failed[:, 1]).any()
    ended = held(Fault("FM1", (0,), onset=1.0, duration=10.0, intermittent=(0.5, 0.5)))
    assert ended[:109].any()
    assert not ended[109:].any()  # for good


def test_robots_have_roles_and_those_of_a_role_come_first_then_those_near_the_item() -> None:
    world = Warehouse(Scenario(n_robots=6, n_items=4))
    world.reset(0)
    state = world.state
    state.robot_position = np.array(
        [[5.0, 5.0], [5.0, 5.8], [INSIDE, 5.0], [1.0, 1.0], [2.0, 8.0], [5.0, 7.0]]
    )
    state.robot_in_delivery[2] = True
    requested = state.requested
    other_item = (requested + 1) % 4
    state.robot_item[[0, 3]] = requested, other_item
    state.item_carrier[[requested, other_item]] = 0, 3
    state.item_position[requested], state.item_position[other_item] = (5.0, 5.0), (1.0, 1.0)
    roles = ["carrier", "neighbour", "in_area", "shuffling", "searching", "searching"]
    assert roles_of(state).tolist() == roles
    assert set(roles) == set(ROLES)
    for count in (1, 2, 3):
        assert robots_in_role(state, "searching", count).tolist() == sorted([5, 4, 0][:count])
        assert robots_in_role(state, "carrier", count).tolist() == [0, 1, 5][:count]
    state.robot_present[0] = False
    assert 0 not in robots_in_role(state, "carrier", 5)
    assert roles_of(state)[0] == ""


def test_roles_are_those_about_every_item_that_is_asked_for() -> None:
    world = Warehouse(Scenario(n_robots=6, n_items=4, n_requests=3))
    world.reset(0)
    state = world.state
    state.robot_position = np.array(
        [[5.0, 5.0], [5.0, 5.8], [1.0, 1.0], [1.0, 1.5], [3.0, 9.0], [3.0, 7.0]]
    )
    oldest, second, third = state.open_requests.tolist()
    state.robot_item[[0, 2]], state.item_carrier[[third, second]] = (third, second), (0, 2)
    state.item_position[[oldest, second, third]] = [(3.0, 9.5), (1.0, 1.0), (5.0, 5.0)]
    roles = ["carrier", "neighbour", "carrier", "neighbour", "searching", "searching"]
    assert roles_of(state).tolist() == roles
    assert robots_in_role(state, "carrier", 2).tolist() == [0, 2]
    assert robots_in_role(state, "searching", 1).tolist() == [4]
    assert robots_in_role(state, "in_area", 3).tolist() == [0, 2, 3]  # the distances 0, 0, 0.5 m
    assert state.item_requested.sum() == 3
    assert np.flatnonzero(state.carries_requested).tolist() == [0, 2]


def test_an_intermittent_fault_never_has_the_same_breaks_again() -> None:
    occurrence = Occurrence(Fault("FM2", (0,), intermittent=(5.0, 5.0)), 0, Scenario(n_robots=1))
    times = [0.0]
    while len(times) < 130:
        times.append(occurrence.next_change(times[-1], math.inf))
    lasting = np.diff(times).round(9).tolist()
    assert len(set(lasting)) == len(lasting)


def test_who_carries_the_requested_item_is_the_carrier_inside_of_the_delivery_area_too(
    build: Build,
) -> None:
    robots = [(INSIDE, 5.0), (INSIDE, 5.4), (INSIDE, 9.0), (2.0, 2.0)]
    world = build(robots, [(INSIDE, 5.1), FAR], [Fault("FM4", (0,))])
    steps(world, HOLD, STAY, STAY, STAY)
    roles = roles_of(world.state).tolist()
    assert roles == ["carrier", "neighbour", "in_area", "searching"]


def test_robots_keep_their_speeds_and_senses_when_another_is_removed(build: Build) -> None:
    faults = [Fault("removed", (0,), onset=0.2), Fault("FM2", (1,), onset=0.4)]
    mixes: dict[str, Any] = {"speed_mix": (1.0, 0.5), "sensing_mix": (0.5, 1.0)}
    world = build([(2.0, 2.0), (3.0, 2.0), (4.0, 2.0)], [FAR], faults, **mixes)
    state = world.state
    before = [array[1:].tolist() for array in (state.max_speed, state.view_range)]
    steps(world, STAY, STAY, STAY, times=5)
    assert state.failure_modes == (("removed",), ("FM2",), ())
    assert [array[1:].tolist() for array in (state.max_speed, state.view_range)] == before


@pytest.mark.parametrize(
    ("mode", "part", "left"),
    [("motor_wear", "speed", 0.2), ("cell_fades", "battery", 0.2), ("motor_slow", "speed", 0.2)],
)
def test_what_wears_falls_evenly_from_the_onset_to_the_end_and_what_is_slow_is_so_at_once(
    mode: str, part: str, left: float
) -> None:
    fault = Fault(mode, (0,), onset=100.0, factor=left)
    occurrence = Occurrence(fault, 0, Scenario(n_robots=1, battery=5000.0))
    factors = [occurrence.remaining_factors(time, 500.0) for time in (100.0, 300.0, 500.0, 600.0)]
    expected = [left] * 4 if mode == "motor_slow" else [1.0, 0.6, left, left]
    assert [factor.pop(part) for factor in factors] == pytest.approx(expected)
    assert {value for factor in factors for value in factor.values()} == {1.0}
    assert occurrence.next_change(99.9, 100.0) == 100.0
    next_change = occurrence.next_change(200.0, 200.1)
    assert next_change == (math.inf if mode == "motor_slow" else 200.1)


def test_faults_are_numbered_once_their_robots_are_chosen() -> None:
    world = Warehouse(SMALL)
    faults = [Fault("dead", 2, onset=0.5, role="searching"), Fault("FM1", 3), Fault("FM2", (6,))]
    world.reset(5, faults)
    robots_of_fm1 = tuple(failed_robots(faults[1], 5, SMALL).tolist())
    assert world.numbered_faults == (faults[0], Fault("FM1", robots_of_fm1), faults[2])
    assert world.struck_robots == tuple(sorted({*robots_of_fm1, 6}))
    steps(world, *[STAY] * 8, times=5)
    dead = tuple(np.flatnonzero(["dead" in modes for modes in world.state.failure_modes]).tolist())
    assert len(dead) == 2
    numbered = world.numbered_faults
    assert numbered == (Fault("dead", dead, onset=0.5), Fault("FM1", robots_of_fm1), faults[2])
    before = world.state.failure_modes
    world.set_faults(numbered)
    assert world.state.failure_modes == before
    assert world.faults == numbered


def test_an_intermittent_fault_ends_with_its_duration_whatever_holds_then() -> None:
    fault = Fault("FM2", (0,), onset=1.0, duration=2.0, intermittent=(1000.0, 1000.0))
    occurrence = Occurrence(fault, 0, Scenario(n_robots=1))
    assert occurrence.next_change(0.0, math.inf) == 1.0
    assert occurrence.holds_for(1.0).tolist() == [0]
    assert occurrence.next_change(1.0, math.inf) == 3.0
    assert occurrence.holds_for(3.0).tolist() == []
    assert occurrence.next_change(3.0, math.inf) == math.inf


def test_a_neighbour_is_whom_the_carrier_sees_not_who_sees_it() -> None:
    world = Warehouse(Scenario(n_robots=4, n_items=2))
    world.reset(0)
    state = world.state
    state.robot_position = np.array([[5.0, 5.0], [5.8, 5.0], [5.0, 6.5], [3.0, 3.0]])
    state.robot_item[0], state.item_carrier[state.requested] = state.requested, 0
    state.view_range[:] = [1.0, 0.1, 2.0, 2.0]
    assert roles_of(state).tolist() == ["carrier", "neighbour", "searching", "searching"]


def test_faults_by_role_that_begin_together_strike_the_same_robots() -> None:
    world = Warehouse(Scenario(n_robots=3, n_items=2, n_requests=2))
    world.reset(0)
    state = world.state
    state.robot_position = np.array([[5.0, 5.0], [1.0, 1.0], [5.8, 5.0]])
    state.robot_item[:2] = state.open_requests
    state.item_position[state.open_requests] = state.robot_position[:2]
    state.item_carrier[state.open_requests] = 0, 1
    assert roles_of(state).tolist() == ["carrier", "carrier", "neighbour"]
    # Of two robots one is the neighbour, whom a dead carrier would no longer see.
    world.set_faults([Fault(mode, 2, role="neighbour") for mode in ("dead", "FM1")])
    assert state.failure_modes == (("dead", "FM1"), (), ("dead", "FM1"))


@pytest.mark.parametrize("role", ROLES)
def test_a_fault_by_role_comes_and_goes_as_one_of_the_same_robots_by_number(role: str) -> None:
    world = Warehouse(SMALL)
    world.reset(5, [Fault("dead", 2, onset=0.5, role=role, intermittent=(0.4, 1.0))])
    steps(world, *[STAY] * 8, times=5)
    fault = Fault("dead", world.struck_robots, onset=0.5, intermittent=(0.4, 1.0))
    wanted = held(fault)
    assert 0.1 < wanted[5:, list(world.struck_robots)].mean() < 0.6  # two of seven are expected
    for failed in wanted[5:]:
        steps(world, *[STAY] * 8)
        assert world.state.failed.tolist() == failed.tolist()
