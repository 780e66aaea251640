from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import MotionView, command_own_frames
from swarm_logistics_env.world.motion.memory import (
    MEMORY,
    SURELY_IN_VAIN,
    body_of,
)
from swarm_logistics_env.world.motion.network_inputs import INPUTS, LEAD
from swarm_logistics_env.world.scenario import Scenario

Rows = NDArray[np.float32]


def frame_of(n_robots: int = 1, seed: int = 0, listens: bool = True) -> MotionView:
    frame = MotionView(Scenario(), listens)
    frame.begin(row_keys(seed, "test", n_robots))
    return frame


def anything(n_robots: int) -> Rows:
    rng = np.random.default_rng(0)
    return rng.uniform(0, 1, (n_robots, row.N_COLUMNS)).astype(np.float32)


def amid(*items: tuple[float, float, bool], carries: str = "") -> Rows:
    """What a robot senses that stands amid items at (x, y) [m], some of them requested."""
    rows = np.zeros((1, row.N_COLUMNS), np.float32)
    rows[:, : row.ITEMS] = 2.0
    rows[0, row.CARRYING] = carries != ""
    rows[0, row.CARRYING_REQUESTED] = carries == "requested"
    for index, (x, y, requested) in enumerate(items):
        first_column = row.ITEMS + row.ITEM_WIDTH * index
        rows[0, first_column : first_column + 4] = 1.0, x, y, requested
    return rows


def told(inputs: Rows, name: str) -> float:
    return float(inputs[0, INPUTS.index(name)])


def turned(x: NDArray[np.floating], y: NDArray[np.floating]) -> tuple[NDArray[np.floating], ...]:
    """Turn vectors to the left by three beams."""
    angle = 2 * math.pi * 3 / row.N_BEAMS
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x - sin * y, sin * x + cos * y


def test_how_the_body_stands_does_not_matter() -> None:
    rows = anything(40)
    # What the same robots would observe if their bodies were turned to the right by three beams.
    other_rows = rows.copy()
    scans = rows[:, : row.ITEMS].reshape(40, -1, row.N_BEAMS)
    other_rows[:, : row.ITEMS] = np.roll(scans, 3, axis=2).reshape(40, -1)
    firsts = [*range(row.ITEMS, row.LOWEST_TIMER, 5), row.LOWEST_TIMER]
    for x in [*(first + 1 for first in firsts), row.VELOCITY]:
        other_rows[:, x], other_rows[:, x + 1] = turned(rows[:, x], rows[:, x + 1])
    frame, turned_frame = frame_of(40), frame_of(40)
    heading = turned(frame.memory[:, MEMORY.heading_x], frame.memory[:, MEMORY.heading_y])
    turned_frame.memory[:, MEMORY.heading_x], turned_frame.memory[:, MEMORY.heading_y] = heading
    first, second = frame.read(rows), turned_frame.read(other_rows)
    whims = [INPUTS.index("whim_along"), INPUTS.index("whim_aside")]
    np.testing.assert_allclose(
        np.delete(second, whims, axis=1), np.delete(first, whims, axis=1), atol=2e-6
    )


def test_commands_are_outputs_in_the_robots_own_frames_within_their_limits() -> None:
    frame, rng = frame_of(30), np.random.default_rng(0)
    frame.read(np.tile(amid(), (30, 1)))
    outputs = rng.uniform(-0.7, 0.7, (30, 3))
    commands = frame.command(outputs)
    assert (commands[:, 2] == 0.0).all()
    # In the robots' own frames they ask for the same.
    again = commands.copy()
    command_own_frames(again, frame.turned, frame.rows, frame.memory)
    np.testing.assert_allclose(again, commands, atol=1e-12)
    turned = np.exp(-1j * frame.turned) * (commands[:, 0] + 1j * commands[:, 1])
    np.testing.assert_allclose(turned, outputs[:, 0] + 1j * outputs[:, 1], atol=1e-12)
    commands = frame.command(rng.normal(0, 9, (30, 3)))
    assert (np.hypot(commands[:, 0], commands[:, 1]) <= 1.0 + 1e-12).all()
    assert (np.abs(commands) <= 1.0 + 1e-12).all()


def test_the_way_home_is_the_way_in() -> None:
    frame = frame_of()
    outside, inside = amid(), amid()
    inside[0, row.IN_DELIVERY_AREA] = 1.0
    inside[0, row.VELOCITY : row.VELOCITY + 2] = 0.6, 0.8
    home = frame.memory[0, MEMORY.home_x : MEMORY.home_y + 1]
    frame.read(outside)
    assert home.tolist() == [0.0, 0.0]
    for _ in range(3):
        inputs = frame.read(inside)
    # Two readings ago, fading in ten seconds.
    certainty = math.exp(-0.02)
    np.testing.assert_allclose(home, np.array([0.6, 0.8]) * certainty)
    length = math.hypot(told(inputs, "home_along"), told(inputs, "home_aside"))
    assert length == pytest.approx(math.tanh(certainty))
    assert told(inputs, "home_certainty") == pytest.approx(math.tanh(certainty / 3.0))
    outside[0, row.VELOCITY : row.VELOCITY + 2] = -1.0, 0.0
    frame.read(outside)
    np.testing.assert_allclose(home, np.array([0.6, 0.8]) * math.exp(-0.03) + [1.0, 0.0])


def test_standing_still_with_the_requested_item_is_being_stuck() -> None:
    frame = frame_of()
    rows = amid(carries="requested")
    frame.read(rows)
    frame.command(np.array([[1.0, 0.0, 0.0]]))
    assert told(frame.read(rows), "stuck") == 1.0
    rows[0, row.VELOCITY] = 2.0
    for _ in range(16):
        frame.command(np.array([[1.0, 0.0, 0.0]]))
        read = frame.read(rows)
    assert told(read, "stuck") == 0.0


def test_rows_begin_anew_by_themselves() -> None:
    def run(frame: MotionView, steps: int) -> Rows:
        for _ in range(steps):
            seen = frame.read(anything(6))
            frame.command(np.full((6, 3), 0.25))
        return seen

    some, uninterrupted, fresh = frame_of(6), frame_of(6), frame_of(6, seed=9)
    run(some, 12)
    some.begin_rows(np.arange(3, 6), row_keys(9, "test", 6)[3:])
    seen = run(some, 9)
    assert (seen[3:] == run(fresh, 9)[3:]).all()
    assert (seen[:3] == run(uninterrupted, 21)[:3]).all()


def test_a_robot_that_knows_the_way_home_is_not_led_astray_and_one_that_is_deaf_by_nobody() -> None:
    frame, deaf = frame_of(), frame_of(listens=False)
    rows = amid()
    rows[0, row.LOWEST_TIMER : row.LOWEST_TIMER + 4] = 1.0, 2.0, 0.0, 5.0
    peeked = frame.peek(rows, np.array([0]))
    read, unheard = frame.read(rows), deaf.read(rows)
    np.testing.assert_array_equal(peeked, read)
    assert told(read, "lead_present") == 1.0
    assert math.hypot(told(read, "lead_along"), told(read, "lead_aside")) == pytest.approx(1.0)
    assert told(read, "lead_distance") == told(read, "lead_timer") == 0.5
    np.testing.assert_array_equal(np.delete(unheard, LEAD, 1), np.delete(read, LEAD, 1))
    assert not unheard[:, LEAD].any()
    assert not deaf.peek(rows, np.array([0]))[:, LEAD].any()
    frame.memory[0, MEMORY.home_x] = 6.0
    np.testing.assert_allclose(frame.read(rows)[:, LEAD], 0.0, atol=1e-4)


def test_a_caged_robot_lets_go_and_carries_off_what_is_in_its_way() -> None:
    frame, wants = frame_of(), np.array([[1.0, 0.0, 1.0]])
    cage = ((0.35, 0.0, False), (-0.2, 0.3, False), (-0.2, -0.3, False))

    def commands(rows: Rows) -> list[float]:
        frame.read(rows)
        return [float(number) for number in frame.command(wants)[0]]

    # It drives on for five seconds in which it stands still, as it is told to; then it lets go.
    grippers = [commands(amid(*cage, carries="requested"))[3] for _ in range(53)]
    assert grippers == [1.0] * 51 + [-1.0] * (53 - 51)
    # Empty, it drives under the nearest other item, and lifts it where the requested one is not.
    x, y, _, gripper = commands(amid((0.01, 0.0, True), *cage))
    assert x > 0.5
    assert abs(y) < 1e-6
    assert gripper == -1.0
    assert commands(amid((-0.34, 0.0, True), (0.01, 0.0, False)))[3] == 1.0
    # Laden with it, away from the requested one; then it puts it down.
    x, _, _, gripper = commands(amid((-0.34, 0.0, True), carries="other"))
    assert (x, gripper) == (1.0, 1.0)
    for _ in range(53):
        last = commands(amid((-0.34, 0.0, True), carries="other"))
    assert last[3] == -1.0
    # The clearing is over, and it does again what it is told.
    for _ in range(10):
        last = commands(amid())
    assert last[3] == 1.0


def test_a_robot_knows_its_own_body_whatever_its_neighbours_have() -> None:
    scenario = Scenario(max_speed=1.0, handling_time=0.5, drive="differential")
    frame, rows = MotionView(Scenario()), np.tile(amid(), (2, 1))
    bodies = np.stack([body_of(Scenario()), body_of(scenario)])
    frame.begin(row_keys(0, "test", 2), bodies)
    # Its top speed, handling time, whether it turns to drive, and the time to its top speed.
    body_inputs = frame.read(rows)[:, -4:]
    np.testing.assert_allclose(body_inputs, [[1.0, 0.0, 0.0, 0.1], [0.5, 0.25, 1.0, 0.05]])
    commands = frame.command(np.array([[0.3, 0.9, 0.0]] * 2))
    assert commands[0, 2] == commands[1, 1] == 0.0
    assert commands[0, 1] != 0.0 != commands[1, 2], "one drives aside, the other one turns"


def test_of_several_requests_the_nearest_is_read_and_who_carries_sees_obstacles() -> None:
    items = (0.2, 0.0, False), (0.3, 0.0, True), (0.9, 0.0, True)
    read = frame_of().read(amid(*items, carries="another"))
    assert told(read, "requested_distance") == pytest.approx(0.3)
    assert told(read, "items_in_view") == 3 / 8
    assert [told(read, f"obstacle_{n}_present") for n in range(4)] == [1.0, 1.0, 1.0, 0.0]
    assert not told(frame_of().read(amid(*items)), "obstacle_0_present")


@pytest.mark.parametrize("turn", [0.0, 0.35, -2.0])
def test_between_decisions_outputs_keep_their_direction_in_the_room(turn: float) -> None:
    frame = frame_of()
    rows = np.zeros((1, row.N_COLUMNS), np.float32)
    frame.read(rows)
    outputs = np.array([[0.6, 0.3, 0.0]])
    decided = complex(*frame.command(outputs)[0, :2])
    rows[0, row.TURN_RATE] = 10.0 * turn  # its body turned in this step
    frame.hold(rows)
    held = complex(*frame.command(outputs)[0, :2])
    assert held == pytest.approx(decided * np.exp(-1j * turn))
    assert frame.counts.tolist() == [2]


def test_a_network_is_told_that_it_delivers_in_vain_up_to_surely() -> None:
    frame = frame_of(3)
    longest = frame.memory[:, MEMORY.handling_time] + SURELY_IN_VAIN
    rows = amid(carries="requested").repeat(3, axis=0)
    rows[:, row.IN_DELIVERY_AREA] = 1.0
    frame.memory[:, MEMORY.delivering] = np.array([0.0, 0.5, 3.0]) * longest
    vain = frame.read(rows)[:, INPUTS.index("delivering_in_vain")]
    assert vain[0] == pytest.approx(0.0, abs=0.15)  # it has begun
    assert vain[1] == pytest.approx(0.5, abs=0.15)
    assert vain[2] == 1.0
