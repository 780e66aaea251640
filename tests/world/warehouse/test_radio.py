"""Timers and messages on the radio, and neighbours that are seen and not heard."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Fault
from swarm_logistics_env.world import observations as row
from tests.world.warehouse.conftest import FAR, STAY, WEST, Build, steps


def test_gossip_ends_at_the_timers_limit_however_often_it_was_passed_on(build: Build) -> None:
    world = build([(8.1, 5.0), (7.6, 5.0), (7.6, 5.5)], [FAR], relay="gossip", timer_limit=1.0)
    state = world.state
    n_tellers = []
    for step in range(30):
        rows = steps(world, WEST if step < 3 else STAY, STAY, STAY)
        assert (np.isnan(state.robot_told) | (state.robot_told < 1.0)).all()
        n_tellers.append(int((~np.isnan(state.robot_told)).sum()))
    assert (max(n_tellers), n_tellers[-1]) == (3, 0)
    assert not rows[:, row.LOWEST_TIMER].any()


def test_a_late_radio_is_silent_where_the_limit_fell_below_what_it_has_to_tell(
    build: Build,
) -> None:
    world = build([(8.1, 5.0), (7.0, 5.0)], [FAR], [Fault("radio_delayed", (0,))])
    steps(world, WEST, STAY, times=3)
    while not world.state.robot_told[0] > 1.5:
        steps(world, STAY, STAY)
    world.change(timer_limit=1.0)
    rows = steps(world, STAY, STAY)
    assert np.isnan(world.state.robot_told[0])
    assert rows[1, row.LOWEST_TIMER] == 0.0


def test_a_late_message_is_that_of_two_seconds_ago(build: Build) -> None:
    faults = [Fault("radio_delayed", (0,))]
    world = build([(8.1, 5.0), (7.0, 5.0)], [FAR], faults, message_size=1)
    sent = np.linspace(-1.0, 1.0, 70)
    rows = [world.step([(0.0, 0.0, 0.0, 0.0, number)] * 2) for number in sent]
    heard_by = np.array(rows)[:, :, row.MESSAGES]
    assert heard_by[:, 0] == pytest.approx(sent)
    assert heard_by[:, 1] == pytest.approx([*[0.0] * 20, *sent[:-20]])


@pytest.mark.parametrize(
    ("mode", "sign"), [("message_frozen", 0.0), ("message_lying", -1.0), ("message_random", None)]
)
def test_a_channel_that_failed_repeats_turns_round_or_makes_up_what_it_is_handed(
    build: Build, mode: str, sign: float | None
) -> None:
    world = build([(8.1, 5.0), (7.0, 5.0)], [FAR], [Fault(mode, (0,), 1.0)], message_size=1)
    sent = np.linspace(-0.9, 1.0, 200)
    rows = [world.step([(0.0, 0.0, 0.0, 0.0, number)] * 2) for number in sent]
    heard_by = np.array(rows)[:, :, row.MESSAGES]
    assert heard_by[:, 0] == pytest.approx(sent)  # the other robot's channel works
    before, after = heard_by[:10, 1], heard_by[10:, 1]
    assert before == pytest.approx(sent[:10])
    if sign is None:
        assert np.abs(after).max() < 1.0
        assert abs(after.mean()) < 0.15
        assert after.std() == pytest.approx(3.0**-0.5, abs=0.1)  # evenly in [-1, 1]
    else:
        assert after == pytest.approx(sign * sent[10:] if sign else np.full(190, sent[9]))


def test_who_is_seen_and_not_heard_tells_neither_its_timer_nor_a_message(build: Build) -> None:
    fields: dict[str, Any] = {"view_range": 2.0, "radio_range": 1.0, "message_size": 1}
    world = build([(8.5, 5.0), (7.0, 5.0), (7.8, 5.0)], [FAR], **fields)
    rows = world.step([(0.0, 0.0, 0.0, 0.0, 0.5)] * 3)
    at = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH  # the second nearest of robot 1 is robot 0
    assert rows[1, at : at + 2] == pytest.approx([1.0, 1.5])
    assert rows[1, at + 3 : at + 5].tolist() == [0.0, world.scenario.timer_limit]
    assert rows[1, row.MESSAGES : row.MESSAGES + 2].tolist() == [0.5, 0.0]
    assert rows[2, row.MESSAGES : row.MESSAGES + 2].tolist() == [0.5, 0.5]


@pytest.mark.parametrize("loss", [0.0, 0.01])
def test_who_is_silent_is_not_heard_though_messages_get_lost(loss: float, build: Build) -> None:
    faults = [Fault("FM3_isolated", (0,))]
    fields: dict[str, Any] = {"radio_loss": loss, "message_size": 1}
    world = build([(8.5, 5.0), (7.8, 5.0), (7.1, 5.0)], [FAR], faults, **fields)
    for _ in range(10):
        rows = world.step([(0.0, 0.0, 0.0, 0.0, 0.5)] * 3)
        assert not rows[0, row.MESSAGES : row.MESSAGES + 2].any()
        assert not rows[1, row.MESSAGES + 1]


def test_a_liar_whose_radio_is_late_as_well_tells_zero_at_once(build: Build) -> None:
    faults = [Fault("FM1", (0,)), Fault("radio_delayed", (0,))]
    world = build([(8.1, 5.0), (7.0, 5.0)], [FAR], faults)
    for step in range(40):
        steps(world, WEST if step < 3 else STAY, STAY)
        assert world.state.robot_told[0] == 0.0
    assert world.state.robot_timer[0] > 2.5
