"""Faults: who fails, from when, what is lost; and roles, by which they may strike.

What each mode takes, for how long, and what is told then: tests/verification/test_combined_faults.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.errors import FaultError
from swarm_logistics_env.observations import N_BEAMS
from swarm_logistics_env.warehouse.failure_modes import FailureMode
from swarm_logistics_env.warehouse.faults import ROLES, failed_robots, fault_of, text_of
from swarm_logistics_env.warehouse.state import NOBODY, robots_in_role, roles_of
from tests.warehouse.conftest import (
    EAST,
    FAR,
    HOLD,
    INSIDE,
    OPEN,
    SMALL,
    STAY,
    WEST,
    Build,
    follow,
    steps,
)

# -- who fails ----------------------------------------------------------------------------------


@given(seed=st.integers(0, 2**40), n_robots=st.integers(1, 60), data=st.data())
def test_chosen_sets_are_nested_the_same_for_every_mode_and_of_the_right_size(
    seed: int, n_robots: int, data: st.DataObject
) -> None:
    m = data.draw(st.integers(1, n_robots))
    chosen = failed_robots(Fault("FM1", m), seed, n_robots)
    assert len(set(chosen)) == m
    assert set(chosen) <= set(range(n_robots))
    for mode in ("removed", "FM4", "dead"):
        np.testing.assert_array_equal(failed_robots(Fault(mode, m, 7.0), seed, n_robots), chosen)
    if m > 1:
        assert set(failed_robots(Fault("FM1", m - 1), seed, n_robots)) < set(chosen)
    turns = np.bincount([failed_robots(Fault("FM1"), other, 10)[0] for other in range(200)])
    assert 5 < turns.min() <= turns.max() < 45  # each of ten has its turn


def test_named_robots_fail_and_their_faults_add_up() -> None:
    world = Warehouse(SMALL)
    world.reset(0, [Fault("FM2", (6, 1)), Fault("motor_slow", (1,)), Fault("motor_slow", (1, 4))])
    state = world.state
    assert np.flatnonzero(state.failed).tolist() == [1, 4, 6]
    assert world.struck_robots == (1, 4, 6)
    assert state.failure_modes[1] == ("FM2", "motor_slow", "motor_slow")
    assert (state.failure_modes[0], state.failure_modes[6]) == ((), ("FM2",))
    assert state.max_speed[[1, 4, 6]] == pytest.approx([0.5, 1.0, 2.0])
    assert not state.lifts[1]


def test_faults_do_not_move_where_things_start() -> None:
    starts = []
    for faults in ((), (Fault("FM1", 2),), (Fault("dead", 3),), (Fault("removed", (2,)),)):
        world = Warehouse(SMALL)
        world.reset(9, faults)
        starts.append((world.state.robot_position, world.state.item_position))
    for robots, items in starts[1:]:
        np.testing.assert_array_equal(items, starts[0][1])
        np.testing.assert_array_equal(np.delete(robots, 2, 0), np.delete(starts[0][0], 2, 0))


# -- the record ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"mode": "FM9"}, "no failure mode 'FM9'; did you mean 'FM"),
        ({"robots": 0}, "^Fault.robots = 0: should be greater than 0$"),
        ({"robots": 1.5}, "^Fault.robots = 1.5: should be a valid integer, [^;]*$"),
        ({"robots": ()}, "at least one robot"),
        ({"robots": (-1,)}, "-1: should be greater than or equal to 0"),
        ({"robots": (2, 0, 2)}, r"\(2, 0, 2\): should name each robot once"),
        ({"role": "carier"}, "did you mean 'carrier'"),
        ({"role": "carrier", "robots": (1,)}, "should be a number"),
        ({"onset": -1.0}, "Fault.onset = -1.0: should be greater than or equal"),
        ({"onset": float("nan")}, "Fault.onset = nan: should be a finite"),
        ({"duration": 0.0}, "Fault.duration = 0.0: should be greater than 0"),
        ({"factor": 0.5}, "FM1 takes no factor; modes that do: motor_slow, motor_wear"),
        ({"mode": "motor_slow", "factor": 1.0}, "Fault.factor = 1.0: should be less than 1"),
        ({"mode": "removed", "duration": 5.0}, "does not come back: duration should be None"),
        ({"mode": "removed", "intermittent": (5, 5)}, "back: intermittent should be None"),
        ({"intermittent": (0.0, 5.0)}, "= 0.0: should be greater than or equal"),
        ({"intermittent": 5.0}, "Fault.intermittent = 5.0: should be a list"),
    ],
)
def test_an_impossible_fault_is_refused_with_the_reason(
    arguments: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(FaultError, match=complaint):
        Fault(**{"mode": "FM1", **arguments})


def test_a_mode_may_delay_no_longer_than_is_kept() -> None:
    with pytest.raises(FaultError, match=r"radio_delay = 3\.0: should be 0 to 2\.0 s"):
        FailureMode("later still", radio_delay=3.0)


@pytest.mark.parametrize(
    "fault",
    [
        Fault("FM1"),
        Fault("FM1", 2, role="carrier"),
        Fault("FM4", [3, 7]),
        Fault("motor_slow", 2, onset=200.0, duration=50.0, factor=0.1),
        Fault("rangers_blind", 2, intermittent=(5.0, 2.5)),
    ],
)
def test_a_fault_survives_json_and_is_hashable(fault: Fault) -> None:
    assert Fault.from_json(fault.to_json()) == fault
    assert Fault(**json.loads(json.dumps(fault.model_dump(mode="json")))) == fault
    assert len({fault, Fault.from_json(fault.to_json())}) == 1
    assert ("role" in fault.to_json()) == (fault.role is not None)  # stored runs stay known


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("FM4:1", Fault("FM4")),
        ("FM1:2@200", Fault("FM1", 2, onset=200.0)),
        ("FM1:2@1234.567", Fault("FM1", 2, onset=1234.567)),
        ("FM4_jam:2:carrier@100+50", Fault("FM4_jam", 2, 100.0, 50.0, role="carrier")),
        ("dead:3@0+2.5", Fault("dead", 3, 0.0, 2.5)),
    ],
)
def test_a_fault_is_written_as_text_and_read_back(text: str, fault: Fault) -> None:
    assert fault_of(text) == fault
    assert text_of(fault) == text
    assert fault_of("FM4@.5") == Fault("FM4", onset=0.5)  # parts may be left out


@pytest.mark.parametrize(
    "fault", [Fault("motor_slow", 2, factor=0.3), Fault("FM4", [1, 2]), Fault("FM4", onset=1e-13)]
)
def test_what_no_text_describes_has_none(fault: Fault) -> None:
    assert text_of(fault) is None


@pytest.mark.parametrize("text", ["FM4:carrier", "FM4:2:@9", "FM4+5", "FM4:2@9+", "FM4@-1", ""])
def test_what_does_not_read_so_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(FaultError, match=r"should be MODE\[:ROBOTS\[:ROLE\]\]\[@ONSET"):
        fault_of(text)


# -- what is lost -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fault", "share"),
    [(Fault("motor_slow", (0,), factor=0.1), 0.1), (Fault("dead", (0,)), 0.0)],
)
def test_a_failed_motor_drives_and_turns_at_its_share(
    build: Build, fault: Fault, share: float
) -> None:
    world = build([(2.0, 5.0)], [FAR], [fault])
    steps(world, EAST)
    start = world.state.robot_position[0, 0]
    steps(world, EAST, times=10)
    assert world.state.robot_position[0, 0] - start == pytest.approx(2.0 * share, abs=1e-6)
    steps(world, (0.0, 0.0, 0.5, 0.0))
    assert world.state.robot_heading[0] == pytest.approx(0.3 * share)


def test_who_fails_keeps_what_it_carries_and_lifts_nothing(build: Build) -> None:
    world = build(
        [(2.0, 2.0), (4.0, 4.0)], [(2.1, 2.0), (4.1, 4.0)], [Fault("dead", (0, 1), onset=0.2)]
    )
    follow(world, [[HOLD, STAY]] * 2 + [[OPEN, HOLD]] * 3)
    assert world.state.robot_item.tolist() == [0, NOBODY]
    world = build([(2.0, 2.0)], [(2.1, 2.0)], [Fault("FM2", (0,), onset=0.1)])
    for command, held in ((HOLD, 0), (OPEN, NOBODY), (HOLD, NOBODY)):
        steps(world, command)
        assert world.state.robot_item[0] == held


@pytest.mark.parametrize(("mode", "delivered"), [("FM2", 1), ("FM4", 0), ("FM4_jam", 0)])
def test_fm4_delivers_nothing_and_what_is_jammed_is_let_go_outside(
    build: Build, mode: str, delivered: int
) -> None:
    world = build([(7.5, 5.0)], [(7.5, 5.1), FAR], [Fault(mode, (0,), onset=0.1)])
    state = world.state
    steps(world, HOLD)
    steps(world, EAST, times=10)
    assert (state.delivered, state.robot_in_delivery[0]) == (delivered, True)
    steps(world, OPEN)
    assert state.robot_item[0] == (0 if mode == "FM4_jam" else NOBODY)
    while state.robot_in_delivery[0]:
        steps(world, WEST)
    steps(world, OPEN)
    assert state.robot_item[0] == NOBODY


def beams(rows: NDArray[np.float32], robot: int = 0) -> NDArray[np.float32]:
    return rows[robot, : 3 * N_BEAMS]


def test_frozen_rangers_repeat_what_they_read_at_the_onset_until_they_recover(
    build: Build,
) -> None:
    # Twice, so that the second time it is what they read then.
    faults = [Fault("rangers_frozen", (0,), onset=at, duration=0.5) for at in (0.3, 0.9)]
    world = build([(2.0, 5.0), (9.0, 1.0)], [FAR], faults, ranger_noise=0.01)
    sound = build([(2.0, 5.0), (9.0, 1.0)], [FAR], ranger_noise=0.01)
    seen = [(beams(steps(world, WEST, STAY)), beams(steps(sound, WEST, STAY))) for _ in range(15)]
    for step, (failed, true) in enumerate(seen, start=1):
        begun = 3 if 3 <= step < 8 else 9 if 9 <= step < 14 else step
        np.testing.assert_array_equal(failed, true if begun == step else seen[begun - 1][1])
    assert not np.array_equal(seen[3][1], seen[6][1])


def test_biased_rangers_read_too_far_and_at_most_their_range(build: Build) -> None:
    places = [(1.0, 5.0), (1.8, 5.0), (5.0, 5.0)]
    true = build(places, [FAR]).observe()
    biased = build(places, [FAR], [Fault("rangers_biased", (0,))]).observe()
    meets = beams(true) < 2.0
    assert meets.any()
    assert not meets.all()
    expected = np.minimum(beams(true)[meets] + 0.2, 2.0)
    np.testing.assert_allclose(beams(biased)[meets], expected, atol=1e-6)
    assert (beams(biased)[~meets] == 2.0).all()
    np.testing.assert_array_equal(biased[1:], true[1:])


@pytest.mark.parametrize(("failed", "held_up"), [((), 0), ((0,), 1), ((0, 1), 0), ((1, 2), 1)])
def test_sound_robots_that_touch_failed_ones_are_held_up(
    build: Build, failed: tuple[int, ...], held_up: int
) -> None:
    places = [(2.0, 5.0), (2.255, 5.0), (8.0, 1.0)]
    world = build(places, [FAR], [Fault("FM1", failed)] if failed else [])
    steps(world, STAY, STAY, STAY, times=10)
    assert world.state.anchoring_seconds == pytest.approx(held_up * 1.0)


# -- when ---------------------------------------------------------------------------------------


def held(fault: Fault, n_robots: int = 8, seed: int = 5, n_steps: int = 400) -> NDArray[np.bool_]:
    """Return whether each robot has failed after each step, (n_steps, N)."""
    world = Warehouse(SMALL.replace(n_robots=n_robots))
    world.reset(seed, [fault])
    failed = np.zeros((n_steps, n_robots), np.bool_)
    for step in range(n_steps):
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


# -- roles --------------------------------------------------------------------------------------


def test_robots_have_roles_and_those_of_a_role_come_first_then_those_near_the_item() -> None:
    world = Warehouse(Scenario(n_robots=6, n_items=4))
    world.reset(0)
    state = world.state
    state.robot_position = np.array(
        [[5.0, 5.0], [5.0, 5.8], [INSIDE, 5.0], [1.0, 1.0], [2.0, 8.0], [5.0, 7.0]]
    )
    state.robot_in_delivery = np.array([False, False, True, False, False, False])
    asked = state.requested
    other = (asked + 1) % 4
    state.robot_item = np.array([asked, -1, -1, other, -1, -1])
    state.item_carrier[[asked, other]] = 0, 3
    state.item_position[asked], state.item_position[other] = (5.0, 5.0), (1.0, 1.0)
    roles = ["carrier", "neighbour", "in_area", "shuffling", "searching", "searching"]
    assert roles_of(state).tolist() == roles
    assert set(roles) == set(ROLES)
    for role, first in (("searching", [5, 4, 0]), ("carrier", [0, 1, 5])):
        for count in (1, 2, 3):
            assert robots_in_role(state, role, count).tolist() == sorted(first[:count])
    state.robot_present[0] = False
    assert 0 not in robots_in_role(state, "carrier", 5)
    assert roles_of(state)[0] == ""
