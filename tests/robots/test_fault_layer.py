"""A layer around a policy lets a robot fail as the simulator lets it fail."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse, policies
from swarm_logistics_env.core.errors import FaultError
from swarm_logistics_env.robots.fault_layer import FaultLayer, append_trial
from swarm_logistics_env.study import read_trials
from swarm_logistics_env.world import observations as row

# Nobody hears anybody, so that what a faulty robot broadcasts changes no run.
SILENT = Scenario(
    n_robots=8, n_items=14, warehouse_width=5.0, warehouse_height=4.0, duration=60.0, restock=True,
    radio_range=0.01,
)  # fmt: skip
N_STEPS = 170


def run(scenario: Scenario, faults: list[Any], layers: list[FaultLayer]) -> np.ndarray[Any, Any]:
    """Return the places of all robots after each step, with the faults or with the layers."""
    world = Warehouse(scenario)
    policy: Any = policies.load("homing")
    policy.configure(scenario)
    policy.reset(scenario.n_robots, 4)
    rows = world.reset(4, faults)
    places = []
    for _ in range(N_STEPS):
        time = world.state.time
        for robot, layer in enumerate(layers):
            rows[robot] = layer.sensed(rows[robot], time)
        commands = policy.act(rows)
        for robot, layer in enumerate(layers):
            commands[robot] = layer.driven(commands[robot], rows[robot], time)
        rows = world.step(commands).copy()
        places.append(world.state.robot_position.copy())
    return np.array(places)


@pytest.mark.parametrize(
    "fault",
    [
        "motor_slow:3@5", "motor_dead:3@5", "motor_wear:3", "view_reduced:3@5+10",
        "rangers_blind:3", "rangers_frozen:3@5", "rangers_biased:3@5", "FM2:3@5", "FM3:3",
        "FM3_isolated:3@5+10",
    ],
)  # fmt: skip
def test_a_swarm_with_layers_runs_as_one_with_the_faults_in_the_simulator(fault: str) -> None:
    layers = [FaultLayer([fault], SILENT, robot, seed=4) for robot in range(SILENT.n_robots)]
    np.testing.assert_allclose(run(SILENT, [], layers), run(SILENT, [fault], []), atol=1e-5)
    assert any(layer.modes(6.0) for layer in layers)


def layer_of(*faults: Any, **fields: Any) -> FaultLayer:
    return FaultLayer(faults, Scenario(n_robots=1, **fields), number=0, seed=0)


def test_a_dead_robot_stands_and_sends_nothing() -> None:
    layer = layer_of("dead:1@10")
    sensed = np.zeros(row.N_COLUMNS)
    assert layer.driven([-2.0, 0.5, 2.0, 1.0], sensed, 9.9).tolist() == [-1.0, 0.5, 1.0, 1.0]
    assert layer.driven([1.0, 0.0, 0.0, 1.0], sensed, 10.0).tolist() == [0.0] * 4
    assert layer.broadcast(3.0, [], 9.9) is not None
    assert layer.broadcast(3.0, [], 10.0) is None


def test_who_hears_no_requests_knows_of_none_that_it_sees_or_carries() -> None:
    layer = layer_of("FM3_isolated:1@10")
    sensed = np.full(row.N_COLUMNS, 0.1, np.float32)
    items = range(row.ITEMS, row.NEIGHBOURS, row.ITEM_WIDTH)
    sensed[items] = 1.0  # present
    requested = [row.CARRYING_REQUESTED, *(item + row.ITEM.requested for item in items)]
    assert layer.sensed(sensed, 9.9)[requested].all()
    assert not layer.sensed(sensed, 10.0)[requested].any()


def test_a_reduced_view_ends_at_a_share_of_the_robots_own() -> None:
    layer = layer_of("view_reduced:1@10", view_range=2.0)
    sensed = np.zeros(row.N_COLUMNS, np.float32)
    items = np.arange(2) * row.ITEM_WIDTH + row.ITEMS
    sensed[items] = 1.0
    sensed[items + row.ITEM.x] = 0.9, 1.1  # [m]
    assert layer.sensed(sensed, 9.9)[items].tolist() == [1.0, 1.0]
    assert layer.sensed(sensed, 10.0)[items].tolist() == [1.0, 0.0]


def test_a_robot_that_is_away_senses_and_does_nothing_until_it_is_back() -> None:
    layer = layer_of("away:1@10+5")
    sensed = np.ones(row.N_COLUMNS)
    for time, is_there in ((9.9, True), (10.0, False), (14.9, False), (15.0, True)):
        assert layer.sensed(sensed, time).any() == is_there
        assert layer.driven([1.0, 0.0, 0.0, 1.0], sensed, time).any() == is_there
        assert (layer.broadcast(3.0, [], time) is not None) == is_there


def test_grippers_fail_by_what_they_hold_and_where() -> None:
    outside = np.zeros(row.N_COLUMNS)
    inside = outside.copy()
    inside[[row.IN_DELIVERY_AREA, row.CARRYING]] = 1.0
    jam = layer_of("FM4_jam")
    assert jam.driven([0, 0, 0, -1], outside, 0.0)[3] == -1.0
    assert jam.driven([0, 0, 0, -1], inside, 0.0)[3] == 0.0
    assert not jam.counts(0.0)
    lame = layer_of("FM2")
    assert lame.driven([0, 0, 0, 1], outside, 0.0)[3] == 0.0
    assert lame.driven([0, 0, 0, 1], inside, 0.0)[3] == 1.0
    assert lame.counts(0.0)


@pytest.mark.parametrize(
    ("mode", "timers", "words"),
    [
        ("FM1", [0, 0, 0, 0], [1, 0.5, 0, -0.5]),
        ("FM3_send", [], []),
        ("message_frozen", [4, 5, 6, 7], [0.9] * 4),
        ("message_lying", [4, 5, 6, 7], [-1, -0.5, 0, 0.5]),
        ("radio_delayed", [math.nan, 3, 4, 5], [0, 0.9, 1, 0.5]),
    ],
)
def test_the_radio_sends_what_the_mode_leaves_of_timer_and_message(
    mode: str, timers: list[float], words: list[float]
) -> None:
    # A delay of 2 s is two periods.
    layer = layer_of(Fault(mode, 1, onset=1.0), control_period=1.0, message_size=1)
    inputs = [(4.0, 1.0), (5.0, 0.5), (6.0, 0.0), (7.0, -0.5)]
    before = layer.broadcast(3.0, [0.9], 0.0)
    assert before is not None
    assert tuple(before) == (3.0, [0.9])
    broadcasts = [layer.broadcast(timer, [word], 1.0 + k) for k, (timer, word) in enumerate(inputs)]
    messages = [broadcast for broadcast in broadcasts if broadcast]
    assert [message.timer for message in messages] == pytest.approx(timers, nan_ok=True)
    assert [message.message[0] for message in messages] == pytest.approx(words)


def test_a_late_radio_sends_what_was_said_before_it_failed() -> None:
    layer = layer_of(Fault("radio_delayed", 1, onset=5.0), control_period=1.0)
    broadcasts = [layer.broadcast(float(second), [], float(second)) for second in range(8)]
    timers = [broadcast.timer for broadcast in broadcasts if broadcast]
    assert timers == [0.0, 1.0, 2.0, 3.0, 4.0, 3.0, 4.0, 5.0]


@pytest.mark.parametrize("mode", ["late", "away"])
def test_a_late_radio_sends_no_message_of_when_the_robot_did_not_work(mode: str) -> None:
    faults = [Fault(mode, 1, onset=1.0, duration=3.0), Fault("radio_delayed", 1, onset=0.0)]
    layer = layer_of(*faults, control_period=1.0, message_size=1)
    broadcasts = [layer.broadcast(float(second), [2.0], float(second)) for second in range(7)]
    messages = [broadcast and (broadcast.timer, *broadcast.message) for broadcast in broadcasts[1:]]
    assert messages == [None, None, None, (2.0, 0.0), (3.0, 0.0), (4.0, 1.0)]


# Neighbours at 0.5, 1.5, 3.0 and 0.9 m: within half the view, the view or the radio.
@pytest.mark.parametrize(
    ("mode", "places", "timers", "words"),
    [
        ("FM1", [0.5, 1.5, 0.9], [5.0, 6.0, 8.0], [0.1, 0.2, 0.4]),
        ("FM3_hear", [0.5, 1.5, 0.9], [90.0] * 3, [0.0] * 3),
        ("view_reduced", [0.5, 0.9], [5.0, 8.0], [0.1, 0.4]),
        ("dead", [], [], []),
    ],
)
def test_neighbours_that_are_neither_seen_nor_heard_go_with_their_messages(
    mode: str, places: list[float], timers: list[float], words: list[float]
) -> None:
    swarm = {"view_range": 2.0, "radio_range": 1.2, "timer_limit": 90.0, "message_size": 1}
    sensed = np.zeros(row.N_COLUMNS + row.N_NEIGHBOURS, np.float32)
    neighbours = sensed[row.NEIGHBOURS : row.LOWEST_TIMER].reshape(row.N_NEIGHBOURS, -1)
    for index, x in enumerate((0.5, 1.5, 3.0, 0.9)):
        neighbours[index] = 1.0, 0.0, x, 1.0, 5.0 + index
        sensed[row.MESSAGES + index] = 0.1 + 0.1 * index
    sensed[row.LOWEST_TIMER : row.CARRYING] = 5.0, 0.0, 0.5, 1.0
    expected = np.zeros_like(sensed)
    hears = mode not in ("FM3_hear", "dead")
    block = expected[row.NEIGHBOURS : row.LOWEST_TIMER].reshape(row.N_NEIGHBOURS, -1)
    for index, (x, timer) in enumerate(zip(places, timers, strict=True)):
        block[index] = 1.0, 0.0, x, hears, timer
    expected[row.MESSAGES : row.MESSAGES + len(words)] = words
    expected[row.LOWEST_TIMER : row.CARRYING] = sensed[row.LOWEST_TIMER : row.CARRYING] * hears
    expected[: row.ITEMS] = 4.0 * (mode == "dead")
    layer = layer_of(f"{mode}:1@10", ranger_range=4.0, **swarm)
    np.testing.assert_allclose(layer.sensed(sensed, 10.0), expected, atol=1e-6)


def test_a_radio_of_random_words_says_others_in_each_period() -> None:
    layer = layer_of("message_random:1@1", control_period=1.0, message_size=2)
    broadcasts = [layer.broadcast(3.0, [0.5, 0.5], float(second)) for second in range(100)]
    words = np.array([broadcast.message for broadcast in broadcasts if broadcast])
    assert words[0].tolist() == [0.5, 0.5]
    assert len({*words[1:].ravel()}) == 198
    assert np.abs(words).max() <= 1.0
    assert words[1:].min() < -0.9
    assert words[1:].max() > 0.9


def test_whose_view_is_reduced_sees_no_station_beyond_it() -> None:
    layer = layer_of("view_reduced:1@10", battery=1000.0)
    reach = Scenario(n_robots=1).view_range
    sensed = np.zeros(row.N_COLUMNS + row.N_BATTERY_COLUMNS, np.float32)
    first = row.N_COLUMNS + row.BATTERY.stations
    sensed[row.N_COLUMNS : first] = 0.7
    sensed[first:] = [1.0, 0.9 * reach, 0.0, 1.0, 0.0, 0.4 * reach]
    np.testing.assert_array_equal(layer.sensed(sensed, 9.9), sensed)
    of_battery = layer.sensed(sensed, 10.0)[row.N_COLUMNS :]
    assert of_battery == pytest.approx([0.7, 0.7, 1.0, 0.0, 0.4 * reach, 0.0, 0.0, 0.0])


def test_trials_of_robots_are_a_table_that_judge_reads(tmp_path: Path) -> None:
    path = tmp_path / "trials.csv"
    path.touch()  # an empty file gets its head, too
    swarm = Scenario(n_robots=12)
    for seed, (sound, broken) in enumerate([(20, 15), (22, 16), (19, 12)]):
        append_trial(path, [], swarm, seed, sound)
        append_trial(path, ["FM4:2@30"], swarm, seed, broken)
    append_trial(path, [Fault("FM1", (1, 4, 7), onset=2.5)], swarm, 3, 7.5)
    lines = path.read_text().splitlines()
    assert lines[:3] == [
        "seed,robots,fault,faulty,onset,delivered", "0,12,none,0,,20", "0,12,FM4,2,30.0,15"
    ]  # fmt: skip
    assert lines[-1] == "3,12,FM1,3,2.5,7.5"
    trials = read_trials(path)
    assert trials.performance(fault="FM4", faulty=2).tolist() == [15, 16, 12]
    assert trials.performance(faulty=0).tolist() == [20, 22, 19]
    with pytest.raises(FaultError, match="2 faults: should be at most 1"):
        append_trial(path, ["FM4", "FM1"], swarm, 0, 1)


def test_a_fault_by_role_or_of_a_battery_and_a_robot_that_is_not_there_are_refused() -> None:
    with pytest.raises(FaultError, match="role = 'carrier': should be None"):
        layer_of("FM4:1:carrier")
    with pytest.raises(FaultError, match="mode = cell_fades: should be another, no layer weakens"):
        layer_of("motor_slow:1", "cell_fades:1", battery=1000.0)
    for number in (-1, 3):
        with pytest.raises(FaultError, match=f"number = {number}: robots are 0 to 2"):
            FaultLayer([], Scenario(n_robots=3), number=number, seed=0)


def test_modes_hold_from_their_onset_to_their_end_for_the_robots_that_they_strike() -> None:
    faults = [Fault("FM4", (0, 2), onset=5.0, duration=2.0), Fault("motor_slow", (0,), onset=6.0)]
    layers = [FaultLayer(faults, Scenario(n_robots=3), number, seed=0) for number in range(3)]
    modes = [[layer.modes(time) for layer in layers] for time in (4.9, 5.0, 6.5, 7.0)]
    assert modes == [
        [(), (), ()],
        [("FM4",), (), ("FM4",)],
        [("FM4", "motor_slow"), (), ("FM4",)],
        [("motor_slow",), (), ()],
    ]
    assert [layer.counts(6.0) for layer in layers] == [False, True, False]


def test_rangers_that_are_biased_or_frozen_report_this_of_what_they_meet() -> None:
    layer = layer_of("rangers_biased:1@1+1", "rangers_frozen:1@3+2", ranger_range=2.0)
    beams = np.array([0.5, 1.9, 2.0], np.float32)
    sensed = []
    for time in (0.0, 1.0, 2.0, 3.0, 4.0, 5.0):
        row_at = np.zeros(row.N_COLUMNS, np.float32)
        row_at[:3] = np.minimum(beams + 0.01 * time * (beams < 2.0), 2.0)
        sensed.append(layer.sensed(row_at, time)[:3].tolist())
    assert sensed == [
        pytest.approx(expected)
        for expected in (
            [0.5, 1.9, 2.0], [0.71, 2.0, 2.0], [0.52, 1.92, 2.0],
            [0.53, 1.93, 2.0], [0.53, 1.93, 2.0], [0.55, 1.95, 2.0],
        )
    ]  # fmt: skip
