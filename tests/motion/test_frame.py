from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import observations as row
from swarm_logistics_env.motion import memory as known
from swarm_logistics_env.motion.frame import INPUTS, LEAD, MotionFrame
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import row_keys

Rows = NDArray[np.float32]


def frame_of(n_robots: int, seed: int = 0) -> MotionFrame:
    frame = MotionFrame(Scenario())
    frame.begin(row_keys(seed, "test", n_robots))
    return frame


def nothing(n_robots: int = 1) -> Rows:
    rows = np.zeros((n_robots, row.N_COLUMNS), np.float32)
    rows[:, : row.ITEMS] = 2.0
    return rows


def told(inputs: Rows, name: str) -> float:
    return float(inputs[0, INPUTS.index(name)])


def turned(rows: Rows, beams: int) -> Rows:
    """What the same robots would observe if their bodies were turned right by so many beams."""
    angle = 2 * math.pi * beams / row.N_BEAMS
    cos, sin = math.cos(angle), math.sin(angle)
    out = rows.copy()
    for start in range(0, row.ITEMS, row.N_BEAMS):
        out[:, start : start + row.N_BEAMS] = np.roll(
            rows[:, start : start + row.N_BEAMS], beams, axis=1
        )
    firsts = [*range(row.ITEMS, row.LOWEST_TIMER, 5), row.LOWEST_TIMER]
    for x_column in [*(first + 1 for first in firsts), row.VELOCITY]:
        x, y = rows[:, x_column], rows[:, x_column + 1]
        out[:, x_column], out[:, x_column + 1] = cos * x - sin * y, sin * x + cos * y
    return out


def test_how_the_body_stands_does_not_matter() -> None:
    rng = np.random.default_rng(0)
    rows = rng.uniform(0, 1, (40, row.N_COLUMNS)).astype(np.float32)
    one, other = frame_of(40), frame_of(40)
    angle = 2 * math.pi * 3 / row.N_BEAMS
    cos, sin = math.cos(angle), math.sin(angle)
    x, y = one.memory[:, known.HEADING_X].copy(), one.memory[:, known.HEADING_Y].copy()
    other.memory[:, known.HEADING_X] = cos * x - sin * y
    other.memory[:, known.HEADING_Y] = sin * x + cos * y
    first, second = one.read(rows), other.read(turned(rows, 3))
    whims = [INPUTS.index("whim_along"), INPUTS.index("whim_aside")]
    np.testing.assert_allclose(
        np.delete(second, whims, axis=1), np.delete(first, whims, axis=1), atol=2e-6
    )


def test_outputs_and_commands_are_each_others_inverse_within_their_limits() -> None:
    frame = frame_of(30)
    frame.read(nothing(30))
    outputs = np.random.default_rng(0).uniform(-0.7, 0.7, (30, 3))
    commands = frame.command(outputs)
    np.testing.assert_allclose(frame.outputs_for(commands), outputs, atol=1e-12)
    assert (commands[:, 2] == 0.0).all()
    commands = frame.command(np.random.default_rng(0).normal(0, 9, (30, 3)))
    assert (np.hypot(commands[:, 0], commands[:, 1]) <= 1.0 + 1e-12).all()
    assert (np.abs(commands) <= 1.0 + 1e-12).all()


def test_the_way_home_is_the_way_in() -> None:
    frame = frame_of(1)
    outside, inside = nothing(), nothing()
    inside[0, row.IN_DELIVERY_AREA] = 1.0
    inside[0, row.VELOCITY : row.VELOCITY + 2] = 0.6, 0.8
    frame.read(outside)
    assert frame.memory[0, known.HOME_X : known.HOME_Y + 1].tolist() == [0.0, 0.0]
    for _ in range(3):
        frame.read(inside)
    # Two readings ago, fading in ten seconds.
    kept = math.exp(-0.02)
    np.testing.assert_allclose(
        frame.memory[0, known.HOME_X : known.HOME_Y + 1], [0.6 * kept, 0.8 * kept]
    )
    outside[0, row.VELOCITY : row.VELOCITY + 2] = -1.0, 0.0
    frame.read(outside)
    kept = math.exp(-0.03)
    np.testing.assert_allclose(
        frame.memory[0, known.HOME_X : known.HOME_Y + 1], [0.6 * kept + 1.0, 0.8 * kept]
    )


def test_a_robot_that_cannot_lift_or_deliver_notices_and_forgets() -> None:
    frame = frame_of(1)
    rows = nothing()
    rows[0, row.ITEMS : row.ITEMS + 4] = 1.0, 0.1, 0.0, 1.0  # the requested item, in reach
    for step in range(12):
        read = frame.read(rows)
        assert (told(read, "failed") > 0.9) == (told(read, "cannot_lift") > 0.9) == (step > 9)
        frame.command(np.array([[0.0, 0.0, 1.0]]))
    for _ in range(600):
        frame.command(np.zeros((1, 3)))
        read = frame.read(nothing())
    assert told(read, "failed") == pytest.approx(math.exp(-1.0), abs=0.01)

    frame = frame_of(1)
    rows = nothing()
    rows[0, [row.CARRYING, row.CARRYING_REQUESTED, row.IN_DELIVERY_AREA]] = 1.0
    inputs = [frame.read(rows) for _ in range(12)]
    assert [told(read, "failed") > 0.9 for read in inputs] == [False] * 9 + [True] * 3
    assert told(inputs[4], "delivering_in_vain") == pytest.approx(0.5, abs=0.01)
    assert told(inputs[-1], "cannot_deliver") == pytest.approx(1.0, abs=0.01)


def test_standing_still_with_the_requested_item_is_being_stuck() -> None:
    frame = frame_of(1)
    rows = nothing()
    rows[0, [row.CARRYING, row.CARRYING_REQUESTED]] = 1.0
    frame.read(rows)
    frame.command(np.array([[1.0, 0.0, 0.0]]))
    assert told(frame.read(rows), "stuck") == 1.0
    rows[0, row.VELOCITY] = 2.0
    for _ in range(16):
        frame.command(np.array([[1.0, 0.0, 0.0]]))
        read = frame.read(rows)
    assert told(read, "stuck") == 0.0


def test_rows_begin_anew_by_themselves() -> None:
    rng = np.random.default_rng(0)
    rows = rng.uniform(0, 1, (4, row.N_COLUMNS)).astype(np.float32)

    def run(frame: MotionFrame, steps: int) -> Rows:
        for _ in range(steps):
            seen = frame.read(rows)
            frame.command(np.full((4, 3), 0.25))
        return seen

    some, whole, fresh = frame_of(4), frame_of(4), frame_of(4, seed=9)
    run(some, 12)
    some.begin_rows(np.array([1, 2]), row_keys(9, "test", 4)[1:3])
    seen = run(some, 9)
    assert (seen[1:3] == run(fresh, 9)[1:3]).all()
    assert (seen[[0, 3]] == run(whole, 21)[[0, 3]]).all()


def test_peeking_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    rows = rng.uniform(0, 1, (6, row.N_COLUMNS)).astype(np.float32)
    one, other = frame_of(6), frame_of(6)
    for frame in (one, other):
        frame.read(rows)
        frame.command(np.zeros((6, 3)))
    peeked = one.peek(rows[2:4], np.array([2, 3]))
    read = one.read(rows)
    assert (read == other.read(rows)).all()
    assert (peeked == read[2:4]).all()


def test_a_robot_that_knows_the_way_home_is_not_led_astray() -> None:
    frame = frame_of(1)
    rows = nothing()
    rows[0, row.LOWEST_TIMER : row.LOWEST_TIMER + 4] = 1.0, 2.0, 0.0, 5.0
    read = frame.read(rows)
    assert told(read, "lead_present") == 1.0
    assert math.hypot(told(read, "lead_along"), told(read, "lead_aside")) == pytest.approx(1.0)
    assert told(read, "lead_distance") == told(read, "lead_timer") == 0.5
    frame.memory[0, known.HOME_X] = 6.0
    read = frame.read(rows)
    led = [value for name, value in zip(INPUTS, read[0]) if name.startswith("lead_")]
    np.testing.assert_allclose(led, 0.0, atol=1e-4)


def test_that_does_not_listen_reads_the_same_but_no_timer() -> None:
    rows = nothing()
    rows[0, row.LOWEST_TIMER : row.LOWEST_TIMER + 4] = (1.0, 0.5, -0.5, 3.0)
    keys = row_keys(0, "test", 1)
    hears, deaf = MotionFrame(Scenario()), MotionFrame(Scenario(), listens=False)
    hears.begin(keys)
    deaf.begin(keys)
    heard, unheard = hears.read(rows), deaf.read(rows)
    assert told(heard, "lead_present") == 1.0
    assert not unheard[:, LEAD].any()
    heard[:, LEAD] = 0.0
    np.testing.assert_array_equal(unheard, heard)
    np.testing.assert_array_equal(deaf.peek(rows, np.array([0]))[:, LEAD], unheard[:, LEAD])


def caged(*items: tuple[float, float, bool], carries: str = "requested") -> Rows:
    """What a robot senses that stands amid items at (x, y) [m], some of them requested."""
    rows = nothing()
    rows[0, row.CARRYING] = carries != ""
    rows[0, row.CARRYING_REQUESTED] = carries == "requested"
    for place, (x, y, requested) in enumerate(items):
        there = row.ITEMS + 5 * place
        rows[0, there : there + 4] = 1.0, x, y, requested
    return rows


def test_a_caged_robot_lets_go_and_carries_off_what_is_in_its_way() -> None:
    frame, wants = frame_of(1), np.array([[1.0, 0.0, 1.0]])
    cage = ((0.35, 0.0, False), (-0.2, 0.3, False), (-0.2, -0.3, False))

    def commands(rows: Rows) -> list[float]:
        frame.read(rows)
        return [float(number) for number in frame.command(wants)[0]]

    # It drives on for five seconds in which it stands still, as it is told to; then it lets go.
    grippers = [commands(caged(*cage))[3] for _ in range(53)]
    assert grippers == [1.0] * 51 + [-1.0] * (53 - 51)
    # Empty, it drives under the nearest other item, and lifts it where the requested one is not.
    x, y, _, gripper = commands(caged((0.01, 0.0, True), *cage, carries=""))
    assert x > 0.5
    assert abs(y) < 1e-6
    assert gripper == -1.0
    assert commands(caged((-0.34, 0.0, True), (0.01, 0.0, False), carries=""))[3] == 1.0
    # Laden with it, away from the requested one; then it puts it down.
    x, _, _, gripper = commands(caged((-0.34, 0.0, True), carries="other"))
    assert (x, gripper) == (1.0, 1.0)
    for _ in range(53):
        last = commands(caged((-0.34, 0.0, True), carries="other"))
    assert last[3] == -1.0
    # The clearing is over, and it does again what it is told.
    for _ in range(10):
        last = commands(caged(carries=""))
    assert last[3] == 1.0
    moving = caged()  # who moves is not caged
    moving[0, row.VELOCITY] = 1.0
    assert all(commands(moving)[3] == 1.0 for _ in range(100))


def test_a_robot_knows_its_own_body_whatever_its_neighbours_have() -> None:
    scenario = Scenario(max_speed=1.0, handling_time=0.5, drive="differential")
    frame = MotionFrame(Scenario())
    bodies = np.stack([known.body_of(Scenario()), known.body_of(scenario)])
    frame.begin(row_keys(0, "test", 2), bodies)
    read = frame.read(nothing(2))
    assert [told(read[:1], one) for one in INPUTS[-3:]] == [1.0, 0.0, 0.0]
    assert [told(read[1:], one) for one in INPUTS[-3:]] == [0.5, 0.25, 1.0]
    commands = frame.command(np.array([[0.3, 0.9, 0.0]] * 2))
    assert commands[0, 2] == commands[1, 1] == 0.0
    assert commands[0, 1] != 0.0 != commands[1, 2], "one drives aside, the other one turns"
    frame.begin_rows(np.array([1]), frame.keys[1:])
    assert told(frame.read(nothing(2))[1:], "handling_time") == 0.0


def test_of_several_requests_the_nearest_is_read_and_who_carries_sees_obstacles() -> None:
    rows = caged((0.2, 0.0, False), (0.3, 0.0, True), (0.9, 0.0, True), carries="another")
    read = frame_of(1).read(rows)
    assert told(read, "requested_distance") == pytest.approx(0.3)
    assert told(read, "items_in_view") == 3 / 8
    assert [told(read, f"obstacle_{n}_present") for n in range(4)] == [1.0, 1.0, 1.0, 0.0]
    assert not told(frame_of(1).read(caged((0.2, 0.0, False), carries="")), "obstacle_0_present")
