from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, Warehouse, policies
from swarm_logistics_env.errors import FaultError
from swarm_logistics_env.observations import N_BEAMS
from swarm_logistics_env.warehouse.failure_modes import FailureMode
from swarm_logistics_env.warehouse.faults import failed_robots
from swarm_logistics_env.warehouse.state import NOBODY

Build = Callable[..., Warehouse]

STAY = (0.0, 0.0, 0.0, 0.0)
HOLD = (0.0, 0.0, 0.0, 1.0)
OPEN = (0.0, 0.0, 0.0, -1.0)
EAST, WEST = (1.0, 0.0, 0.0, 0.0), (-1.0, 0.0, 0.0, 0.0)
FAR = (1.0, 9.0)
SMALL = Scenario(n_robots=8, n_items=12, warehouse_width=5, warehouse_height=4)


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


def test_different_seeds_choose_different_robots_and_every_robot_has_its_turn() -> None:
    chosen = [int(failed_robots(Fault("FM1"), seed, 10)[0]) for seed in range(200)]
    counts = np.bincount(chosen, minlength=10)
    assert counts.min() > 5
    assert counts.max() < 45


def test_named_robots_fail_and_no_others() -> None:
    world = Warehouse(SMALL)
    world.reset(0, [Fault("FM2", (6, 1))])
    assert np.flatnonzero(world.state.failed).tolist() == [1, 6]
    assert world.struck_robots == (1, 6)
    assert world.state.failure_modes[1] == ("FM2",)
    assert world.state.failure_modes[0] == ()


@pytest.mark.parametrize(
    ("fault", "complaint"),
    [
        (Fault("FM1", 9), "robots = 9: should be at most n_robots = 8"),
        (Fault("FM1", (0, 8)), r"\(0, 8\): robots are numbered 0 to 7"),
        ("FM1", r"faults = \['FM1'\]: should be a list of Fault"),
    ],
)
def test_faults_that_cannot_be_are_refused_at_the_reset(fault: Any, complaint: str) -> None:
    with pytest.raises(FaultError, match=complaint):
        Warehouse(SMALL).reset(0, [fault])


# -- the record ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        ({"mode": "FM9"}, "no failure mode 'FM9'; did you mean 'FM"),
        ({"mode": "removd"}, "did you mean 'removed'"),
        ({"mode": "FM1", "robots": 0}, "Fault.robots = 0: should be greater than 0"),
        ({"mode": "FM1", "robots": ()}, "at least one robot"),
        ({"mode": "FM1", "robots": (-1,)}, "-1: should be greater than or equal to 0"),
        ({"mode": "FM1", "robots": (2, 0, 2)}, r"\(2, 0, 2\): should name each robot once"),
        ({"mode": "FM1", "robots": -1}, "^Fault.robots = -1: should be greater than 0$"),
        ({"mode": "FM1", "robots": 1.5}, "^Fault.robots = 1.5: should be a valid integer, [^;]*$"),
        ({"mode": "FM1", "onset": -1.0}, "Fault.onset = -1.0: should be greater than or equal"),
        ({"mode": "FM1", "onset": float("nan")}, "Fault.onset = nan: should be a finite"),
        ({"mode": "FM1", "duration": 0.0}, "Fault.duration = 0.0: should be greater than 0"),
        (
            {"mode": "FM1", "factor": 0.5},
            "FM1 takes no factor; modes that do: motor_slow, motor_wear",
        ),
        ({"mode": "motor_slow", "factor": 1.0}, "Fault.factor = 1.0: should be less than 1"),
        ({"mode": "removed", "duration": 5.0}, "does not come back: duration should be None"),
        ({"mode": "removed", "intermittent": (5, 5)}, "back: intermittent should be None"),
        ({"mode": "FM1", "intermittent": (0.0, 5.0)}, "= 0.0: should be greater than or equal"),
        ({"mode": "FM1", "intermittent": 5.0}, "Fault.intermittent = 5.0: should be a list"),
    ],
)
def test_an_impossible_fault_is_refused_with_the_reason(
    arguments: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(FaultError, match=complaint):
        Fault(**arguments)


@pytest.mark.parametrize(
    "fault",
    [
        Fault("FM1"),
        Fault("FM4", [3, 7]),
        Fault("motor_slow", 2, onset=200.0, duration=50.0, factor=0.1),
        Fault("rangers_blind", 2, intermittent=(5.0, 2.5)),
    ],
)
def test_a_fault_survives_json_and_is_hashable(fault: Fault) -> None:
    assert Fault.from_json(fault.to_json()) == fault
    assert Fault(**json.loads(json.dumps(fault.model_dump(mode="json")))) == fault
    assert len({fault, Fault.from_json(fault.to_json())}) == 1


ABILITIES = (
    "robot_present", "max_speed", "max_turn_rate", "ranger_range", "view_range", "lifts",
    "delivers", "sends", "hears", "honest", "obeys", "releases_inside", "rangers_refresh",
    "ranger_bias", "radio_delay",
)  # fmt: skip


@pytest.mark.parametrize("mode", FAILURE_MODES)
def test_every_mode_has_a_description_and_takes_something_from_its_robots_only(mode: str) -> None:
    assert FAILURE_MODES[mode].description
    healthy, failing = Warehouse(SMALL), Warehouse(SMALL)
    healthy.reset(0)
    failing.reset(0, [Fault(mode, (0, 5))])
    for world in (healthy, failing):
        world.step(np.zeros((8, 4)))  # as wear shows after a while only
    lost = [
        np.flatnonzero(getattr(healthy.state, name) != getattr(failing.state, name)).tolist()
        for name in ABILITIES
    ]
    assert [0, 5] in lost
    assert all(robots in ([], [0, 5]) for robots in lost)


# -- what is lost -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fault", "share"),
    [
        (Fault("motor_slow", (0,)), 0.5),
        (Fault("motor_slow", (0,), factor=0.1), 0.1),
        (Fault("motor_dead", (0,)), 0.0),
        (Fault("dead", (0,)), 0.0),
        (Fault("FM2", (0,)), 1.0),
    ],
)
def test_a_failed_motor_drives_and_turns_at_its_share(
    build: Build, fault: Fault, share: float
) -> None:
    world = build([(2.0, 5.0)], [FAR], [fault])
    world.step([EAST])
    start = world.state.robot_position[0, 0]
    for _ in range(10):
        world.step([EAST])
    assert world.state.robot_position[0, 0] - start == pytest.approx(2.0 * share, abs=1e-6)
    world.step([(0.0, 0.0, 0.5, 0.0)])
    assert world.state.robot_heading[0] == pytest.approx(0.3 * share)


def test_a_dead_robot_keeps_what_it_carries_and_lifts_nothing(build: Build) -> None:
    fault = Fault("dead", (0, 1), onset=0.2)
    world = build([(2.0, 2.0), (4.0, 4.0)], [(2.1, 2.0), (4.1, 4.0)], [fault])
    world.step([HOLD, STAY])
    world.step([HOLD, STAY])
    for _ in range(3):
        world.step([OPEN, HOLD])
    assert world.state.robot_item.tolist() == [0, -1]


def test_fm2_keeps_what_it_carried_when_it_failed(build: Build) -> None:
    world = build([(2.0, 2.0)], [(2.1, 2.0)], [Fault("FM2", (0,), onset=0.1)])
    world.step([HOLD])
    assert world.state.robot_item[0] == 0
    world.step([OPEN])
    world.step([HOLD])
    assert world.state.robot_item[0] == -1


def test_fm4_delivers_nothing_and_a_healthy_robot_does(build: Build) -> None:
    for faults, delivered in (((), 1), ((Fault("FM4", (0,)),), 0)):
        world = build([(7.5, 5.0)], [(7.5, 5.1), FAR], faults)
        world.step([HOLD])
        for _ in range(10):
            world.step([EAST])
        assert world.state.delivered == delivered


INSIDE = 8.5  # x in the delivery area, which begins at 8 m


def test_fm4_jam_lets_nothing_go_inside_and_does_outside(build: Build) -> None:
    for mode, held in (("FM4", NOBODY), ("FM4_jam", 0)):
        world = build([(INSIDE, 5.0)], [(INSIDE, 5.1), FAR], [Fault(mode, (0,))])
        world.step([HOLD])
        world.step([OPEN])
        assert world.state.robot_item[0] == held
        assert world.state.delivered == 0
    while world.state.robot_in_delivery[0]:
        world.step([WEST])
    world.step([OPEN])
    assert world.state.robot_item[0] == NOBODY


def beams(rows: NDArray[np.float32], robot: int = 0) -> NDArray[np.float32]:
    return rows[robot, : 3 * N_BEAMS]


def test_frozen_rangers_repeat_what_they_read_at_the_onset_until_they_recover(
    build: Build,
) -> None:
    # Twice, so that the second time it is what they read then.
    faults = [Fault("rangers_frozen", (0,), onset=at, duration=0.5) for at in (0.3, 0.9)]
    world = build([(2.0, 5.0), (9.0, 1.0)], [FAR], faults, ranger_noise=0.01)
    sound = build([(2.0, 5.0), (9.0, 1.0)], [FAR], ranger_noise=0.01)
    seen = [(beams(world.step([WEST, STAY])), beams(sound.step([WEST, STAY]))) for _ in range(15)]
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


def test_a_delayed_radio_tells_and_sends_what_was_so_two_seconds_ago(build: Build) -> None:
    fault = Fault("radio_delayed", (0,))
    world = build([(7.9, 5.0), (6.0, 5.0)], [FAR], [fault], message_size=1)
    told, sent = [], []
    for step in range(40):
        drive = 1.0 if step < 3 else -1.0 if step < 6 else 0.0
        world.step([(drive, 0.0, 0.0, 0.0, step / 100), (0.0, 0.0, 0.0, 0.0, 0.5)])
        told.append((float(world.state.robot_timer[0]), float(world.state.robot_told[0])))
        sent.append(world.state.robot_message[:, 0].tolist())
    timers = [timer for timer, _ in told]
    assert not np.isnan(timers).all()
    assert np.isnan([late for _, late in told[:20]]).all()
    np.testing.assert_array_equal([late for _, late in told[20:]], timers[:20])
    assert [mine for mine, _ in sent[20:]] == [step / 100 for step in range(20)]
    assert all(other == 0.5 for _, other in sent)


def test_a_late_timer_that_a_lower_limit_silences_is_not_told(build: Build) -> None:
    world = build([(7.9, 5.0), (6.0, 5.0)], [FAR], [Fault("radio_delayed", (0,))])
    for step in range(40):
        world.step([(1.0 if step < 3 else -1.0 if step < 10 else 0.0, 0.0, 0.0, 0.0), STAY])
    assert world.state.robot_told[0] > 0.5
    world.change(timer_limit=0.5)
    world.step([STAY, STAY])
    assert np.isnan(world.state.robot_told[0])


def test_a_mode_may_delay_no_longer_than_is_kept() -> None:
    with pytest.raises(FaultError, match=r"radio_delay = 3\.0: should be 0 to 2\.0 s"):
        FailureMode("later still", radio_delay=3.0)


@pytest.mark.parametrize("factor", [None, 0.2])
def test_a_worn_motor_slows_down_linearly_until_the_end(build: Build, factor: float | None) -> None:
    fault = Fault("motor_wear", (0,), onset=1.0, factor=factor)
    world = build([(2.0, 5.0), (2.0, 8.0)], [FAR], [fault], duration=5.0)
    speeds = [world.state.max_speed.copy()]
    for _ in range(50):
        world.step([STAY, STAY])
        speeds.append(world.state.max_speed.copy())
    worn, sound = np.array(speeds).T
    left = 0.5 if factor is None else factor
    expected = 2.0 * np.interp(np.arange(51) * 0.1, [1.0, 5.0], [1.0, left])
    np.testing.assert_allclose(worn, expected, atol=1e-9)
    assert (sound == 2.0).all()
    assert world.state.max_turn_rate[0] == pytest.approx(6.0 * left)


@pytest.mark.parametrize(("failed", "held_up"), [((), 0), ((0,), 1), ((0, 1), 0), ((1, 2), 1)])
def test_sound_robots_that_touch_failed_ones_are_held_up(
    build: Build, failed: tuple[int, ...], held_up: int
) -> None:
    places = [(2.0, 5.0), (2.255, 5.0), (8.0, 1.0)]
    world = build(places, [FAR], [Fault("FM1", failed)] if failed else [])
    for _ in range(10):
        world.step([STAY] * 3)
    assert world.state.anchoring_seconds == pytest.approx(held_up * 1.0)


def test_faults_of_one_robot_add_up() -> None:
    world = Warehouse(SMALL)
    world.reset(0, [Fault("FM2", (3,)), Fault("motor_slow", (3,)), Fault("motor_slow", (3, 4))])
    assert world.state.max_speed[3] == pytest.approx(2.0 * 0.25)
    assert world.state.max_speed[4] == pytest.approx(2.0 * 0.5)
    assert not world.state.lifts[3]
    assert world.state.failure_modes[3] == ("FM2", "motor_slow", "motor_slow")


# -- when ---------------------------------------------------------------------------------------


def test_a_fault_holds_from_its_onset_for_its_duration(build: Build) -> None:
    world = build([(2.0, 5.0)], [FAR], [Fault("FM1", (0,), onset=0.5, duration=0.3)])
    held = [bool(world.state.failed[0])]
    for _ in range(12):
        world.step([STAY])
        held.append(bool(world.state.failed[0]))
    assert held == [False] * 5 + [True] * 3 + [False] * 5
    assert world.state.honest[0]


def test_a_fault_that_begins_in_no_episode_never_holds(build: Build) -> None:
    world = build([(2.0, 5.0)], [FAR], [Fault("FM1", (0,), onset=1e308)])
    for _ in range(3):
        world.step([STAY])
    assert not world.state.failed.any()


def test_recovery_gives_everything_back_unless_another_fault_holds(build: Build) -> None:
    faults = [
        Fault("dead", (0,), onset=0.1, duration=0.2),
        Fault("view_reduced", (0,), onset=0.0, duration=0.5),
    ]
    world = build([(2.0, 5.0)], [FAR], faults)
    for _ in range(3):
        world.step([EAST])
    assert world.state.max_speed[0] == 2.0
    assert world.state.view_range[0] == 0.5
    for _ in range(2):
        world.step([EAST])
    assert world.state.view_range[0] == 1.0
    assert world.state.failure_modes == ((),)


def held(fault: Fault, n_robots: int = 8, seed: int = 5, steps: int = 400) -> NDArray[np.bool_]:
    """Return whether each robot has failed after each step, (steps, N)."""
    world = Warehouse(SMALL.replace(n_robots=n_robots))
    world.reset(seed, [fault])
    failed = np.zeros((steps, n_robots), np.bool_)
    for step in range(steps):
        world.step(np.zeros((n_robots, 4)))
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


def test_a_part_of_a_mode_comes_and_goes_with_the_whole_of_it() -> None:
    whole, part = (
        held(Fault(mode, (1,), onset=2.0, intermittent=(1.0, 0.5)))
        for mode in ("dead", "dead[send]")
    )
    np.testing.assert_array_equal(part, whole)


def test_an_intermittent_fault_ends_for_good_after_its_duration() -> None:
    failed = held(Fault("FM1", (0,), onset=1.0, duration=10.0, intermittent=(0.5, 0.5)))
    assert failed[:109].any()
    assert not failed[109:].any()


def test_a_copy_meets_the_same_breaks() -> None:
    world = Warehouse(SMALL)
    world.reset(1, [Fault("motor_wear", 3, intermittent=(0.5, 0.5))])
    commands = np.tile(EAST, (8, 1))
    for _ in range(20):
        world.step(commands)
    copied = copy.deepcopy(world)
    for _ in range(100):
        np.testing.assert_array_equal(world.step(commands), copied.step(commands))
        assert world.state.failure_modes == copied.state.failure_modes


def test_a_removed_robot_does_not_come_back_when_other_faults_begin_and_end(build: Build) -> None:
    faults = [Fault("removed", (0,), onset=0.1), Fault("FM1", (0,), onset=0.2, duration=0.1)]
    world = build([(2.0, 5.0), (4.0, 5.0)], [FAR], faults)
    for _ in range(6):
        rows = world.step([EAST, STAY])
    assert world.state.robot_present.tolist() == [False, True]
    assert not rows[0].any()
    assert not world.state.robot_position[0].any()


def test_all_robots_may_be_removed(build: Build) -> None:
    world = build([(2.0, 5.0), (4.0, 5.0)], [FAR], [Fault("removed", 2, onset=0.1)])
    for _ in range(3):
        rows = world.step([HOLD, HOLD])
    assert not rows.any()


def history(faults: tuple[Fault, ...], n_steps: int) -> list[tuple[NDArray[Any], ...]]:
    """Return rows and bodies after each of `n_steps` steps of Swarm D-T."""
    world, policy = Warehouse(SMALL), policies.load("swarm-dt")
    policy.reset(SMALL.n_robots, 0)
    rows = world.reset(2, faults)
    past: list[tuple[NDArray[Any], ...]] = [(rows,)]
    for _ in range(n_steps):
        rows = world.step(policy.act(rows))
        state = world.state
        past.append(
            (rows, state.robot_position.copy(), state.robot_told.copy(), state.robot_item.copy())
        )
    return past


def same(first: tuple[NDArray[Any], ...], second: tuple[NDArray[Any], ...]) -> bool:
    return all(np.array_equal(a, b, equal_nan=a.dtype.kind == "f") for a, b in zip(first, second))


@pytest.mark.parametrize("mode", FAILURE_MODES)
def test_nothing_changes_by_a_bit_before_the_onset(mode: str) -> None:
    healthy = history((), 60)
    failing = history((Fault(mode, 4, onset=2.0),), 60)
    assert all(same(*pair) for pair in zip(healthy[:20], failing[:20]))
    # FM4 does not show in one's senses until somebody carries the requested item in, nor does a
    # delayed radio until somebody was there.
    assert mode in ("FM4", "FM4_jam", "radio_delayed") or not all(
        same(*pair) for pair in zip(healthy, failing)
    )


def test_faults_do_not_move_where_things_start() -> None:
    starts = []
    for faults in ((), (Fault("FM1", 2),), (Fault("dead", 3),), (Fault("removed", (2,)),)):
        world = Warehouse(SMALL)
        world.reset(9, faults)
        starts.append((world.state.robot_position, world.state.item_position))
    for robots, items in starts[1:]:
        np.testing.assert_array_equal(items, starts[0][1])
        np.testing.assert_array_equal(np.delete(robots, 2, 0), np.delete(starts[0][0], 2, 0))
