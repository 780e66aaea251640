"""Faults that meet: what they leave, what is paid and how it ends, by the slow reference.

`HYPOTHESIS_PROFILE=nightly` plays 2,000 worlds.
"""

from __future__ import annotations

import math
import pickle
import random
from copy import deepcopy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.reward_terms import REWARD_TERMS
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.world.scenario import ROLES
from swarm_logistics_env.world.warehouse import FAILURE_MODES
from swarm_logistics_env.world.warehouse.state import WarehouseState
from verification.invariants import Watch
from verification.reference import Faults, Planned, Radio, ends, rewards

EXAMPLES = 2000 if settings().max_examples >= 2000 else 15
KINDS = "plain, other robot_radius=0.08 robot_mass=2.0 max_speed=0.7 lifts=false"
STEPS = 36  # a radio that is late by 2 s is late by 20 of these


@dataclass(frozen=True)
class Case:
    """A small world, its faults, and what is to meet a delivery in it."""

    number: int
    scenario: Scenario
    planned: tuple[Planned, ...]
    later: tuple[Planned, ...] | None
    weights: dict[str, float]
    aim: str
    changes: dict[str, float] = field(default_factory=dict)


@st.composite
def planned_faults(draw: st.DrawFn, n_robots: int) -> Planned:
    mode = draw(st.sampled_from(sorted(FAILURE_MODES.keys() - {"cell_fades"})))
    is_left = mode in ("removed", "away")  # after a step, as the reference looks at who was there
    begins = draw(st.integers(2, 60)) if is_left else draw(st.integers(0, 50))
    passes = st.integers(begins + 1, begins + 40)
    ends = None
    if mode != "removed":
        ends = draw(passes if mode == "away" else st.none() | passes)
    role = draw(st.none() | st.sampled_from(sorted(ROLES)))
    named = st.lists(st.integers(0, n_robots - 1), min_size=1, max_size=n_robots, unique=True)
    robots = draw(st.integers(1, n_robots) if role else st.integers(1, n_robots) | named.map(tuple))
    has_factor = mode in ("motor_slow", "motor_wear", "view_reduced")
    factor = draw(st.none() | st.sampled_from([0.0, 0.25, 0.9])) if has_factor else None
    breaks = None
    if mode != "removed":
        breaks = draw(st.none() | st.sampled_from([(0.5, 0.5), (0.2, 1.0), (2.0, 0.1)]))
    return Planned(mode, robots, begins, ends, factor, breaks, role)


@st.composite
def cases(draw: st.DrawFn) -> Case:
    n, n_items = draw(st.integers(2, 6)), draw(st.integers(1, 4))
    scenario = Scenario(
        n_robots=n, n_items=n_items, n_requests=draw(st.integers(1, n_items)),
        warehouse_width=2.5, warehouse_height=1.6,
        delivery_width=draw(st.sampled_from([0.6, 1.2])), duration=STEPS * 0.1,
        restock=draw(st.booleans()), pickup_range=0.6, view_range=0.8, radio_range=1.2,
        timer_limit=1.5, relay=draw(st.sampled_from(["none", "gossip"])), message_size=1,
        speed_mix=draw(st.sampled_from([(1.0,), (1.0, 0.5)])), heading_drift=0.5,
        sensing_mix=draw(st.sampled_from([(1.0,), (1.0, 0.4)])),
        drive=draw(st.sampled_from(["holonomic", "differential"])),
        robot_kinds=draw(st.sampled_from(["", KINDS])),
    )  # fmt: skip
    some = st.lists(planned_faults(n), min_size=1, max_size=4).map(tuple)
    planned = draw(some)
    later = draw(st.none() | some)
    limits = {"max_speed": 1.0, "view_range": 0.5, "ranger_range": 1.5}
    changed = draw(st.sets(st.sampled_from(sorted(limits))))
    terms = draw(st.sets(st.sampled_from(sorted(REWARD_TERMS)), min_size=1))
    weights = {name: draw(st.sampled_from([0.5, 1.0, -2.0])) for name in sorted(terms)}
    aim = draw(st.sampled_from(["nothing", "the end", "a removal"]))
    changes = {name: limits[name] for name in sorted(changed)}
    return Case(draw(st.integers(0, 2**32)), scenario, planned, later, weights, aim, changes)


def commands_of(world: Warehouse, source: random.Random) -> list[list[float]]:
    """Drive to the requested item and bring things away, so that deliveries come, or anyhow."""
    state, commands = world.state, []
    for robot in range(state.n_robots):
        x, y = state.robot_position[robot].tolist()
        to_x, to_y = (2.4, y) if state.robot_item[robot] >= 0 else (0.3, 0.8)
        if state.robot_item[robot] < 0 and state.requested >= 0:
            to_x, to_y = state.item_position[state.requested].tolist()
        aim = math.atan2(to_y - y, to_x - x) - float(state.robot_heading[robot])
        if source.random() < 0.3:
            aim = source.uniform(-math.pi, math.pi)
        gripper = source.choice([1.0, 1.0, 1.0, 1.0, 0.0, -1.0])
        turn = max(-1.0, min(1.0, math.remainder(aim, 2.0 * math.pi)))
        commands.append([math.cos(aim), math.sin(aim), turn, gripper, source.uniform(-1.5, 1.5)])
    return commands


def play(case: Case, last: int) -> list[int]:
    """Play a case against the reference; return the steps with deliveries."""
    scenario, period, source = case.scenario, case.scenario.control_period, case.number % 2**31
    env = SwarmLogisticsEnv(
        scenario, faults=[fault.fault(period) for fault in case.planned], rewards=case.weights,
        max_cycles=last,
    )  # fmt: skip
    env.reset_arrays(case.number)
    world, rng = env.warehouse, random.Random(source)
    watch, faults = Watch(world), Faults(scenario, case.number, case.planned)
    radio, before = Radio(scenario, case.number), deepcopy(world.state)
    copy: Warehouse | None = None
    able = check_able(world, faults, before)
    deaf = deepcopy(before)
    deaf.robot_heard[:] = math.nan  # nobody has heard anything yet
    assert_told(world, radio.told(before, deaf, able))
    watch.look()
    delivery_steps = []
    while env.agents:
        if before.step == STEPS // 3:
            world.change(**case.changes)
            faults.change(world.scenario)
            able = check_able(world, faults, before)
        if before.step == STEPS // 2:
            if case.later is not None:
                world.set_faults([fault.fault(period) for fault in case.later])
                watch.faults_changed()
                faults.plan(case.later)
                able = check_able(world, faults, before)
            # Who is removed so terminates in the step that follows, so `before` stays as it is.
            copy = pickle.loads(pickle.dumps(world))
        commands = commands_of(world, rng)
        agents = list(env.agents)
        rows, paid, terminated, truncated = env.step_arrays(commands)
        if copy is not None:
            assert np.array_equal(copy.step(commands), rows)
            assert copy.state.failure_modes == world.state.failure_modes
        now = deepcopy(world.state)
        assert world.state.robot_message.tolist() == radio.messages(commands, able)
        able = check_able(world, faults, before)
        assert_told(world, radio.told(now, before, able))
        expected = rewards(case.weights, scenario, before, now)
        for robot, value in enumerate(expected):
            assert paid[robot] == pytest.approx(value)
        wanted = ends(before, now, min(last, STEPS))
        assert (terminated.tolist(), truncated.tolist()) == wanted
        over = np.logical_or(*wanted)
        left = [f"robot_{r}" for r in np.flatnonzero(before.in_episode & ~over)]
        assert env.agents == left
        assert {f"robot_{r}" for r in np.flatnonzero(before.in_episode)} == set(agents)
        assert env.state_space.contains(env.state())
        watch.look()
        if len(now.delivered_by) > len(before.delivered_by):
            delivery_steps.append(now.step)
        before = now
    return delivery_steps


def check_able(world: Warehouse, faults: Faults, before: WarehouseState) -> list[dict[str, Any]]:
    expected, state = faults.expected(world, before), world.state
    for name in expected[0]:
        wanted = [able[name] for able in expected]
        if name == "modes":
            assert list(state.failure_modes) == wanted
            assert state.failed.tolist() == list(map(bool, wanted))
        elif name == "present":
            assert state.robot_present.tolist() == wanted
        else:
            assert getattr(state.able, name).tolist() == pytest.approx(wanted), name
    assert world.n_removed == sum(faults.gone)
    return expected


def assert_told(world: Warehouse, expected: list[float]) -> None:
    assert world.state.robot_told.tolist() == pytest.approx(expected, nan_ok=True)


@pytest.mark.daily
@pytest.mark.parametrize("first", sorted(FAILURE_MODES.keys() - {"cell_fades"}))
def test_any_two_modes_add_up(first: str) -> None:
    scenario = Scenario(
        n_robots=3, n_items=3, warehouse_width=2.5, warehouse_height=1.6, delivery_width=1.2,
        duration=STEPS * 0.1, restock=True, pickup_range=0.6, message_size=1, timer_limit=5.0,
    )  # fmt: skip
    modes = sorted(FAILURE_MODES.keys() - {"cell_fades"})
    # Of the pairs of two modes one in four, and all of them at night; drawn cases have pairs, too.
    every = 1 if EXAMPLES >= 2000 else 4
    for number, second in list(enumerate(modes))[modes.index(first) :: every]:
        ends = {name: 20 if name == "away" else None for name in (first, second)}
        planned = (Planned(first, 2, 4, ends[first]), Planned(second, 2, 10, ends[second]))
        play(Case(number, scenario, planned, None, {"delivery": 1.0}, "nothing"), STEPS)


@given(case=cases())
@settings(max_examples=EXAMPLES, report_multiple_bugs=False)
def test_faults_that_meet_leave_pay_and_end_as_the_reference_says(case: Case) -> None:
    delivered = play(case, STEPS)
    if not delivered:
        return
    step = random.Random(case.number).choice(delivered)
    if case.aim == "the end":  # in the very step of a delivery
        play(case, step)
    if case.aim == "a removal":
        gone = Planned("removed", (case.number % case.scenario.n_robots,), 2 * step)
        play(replace(case, planned=(*case.planned, gone)), STEPS)


@pytest.mark.daily
@given(case=cases())
@settings(max_examples=EXAMPLES, report_multiple_bugs=False)
def test_many_steps_in_one_call_pass_over_no_beginning_or_end_of_a_fault(case: Case) -> None:
    scenario, period = case.scenario, case.scenario.control_period
    planned = [fault.fault(period) for fault in case.planned]
    by_step = Play(scenario, policies.load("ppo-delivery"), case.number, planned)
    by_event = Play(scenario, policies.load("ppo-delivery"), case.number, planned)
    faults = Faults(scenario, case.number, case.planned)
    world, before = by_step.world, deepcopy(by_step.world.state)
    positions = np.empty((STEPS, scenario.n_robots, 2))
    while not by_event.is_over:
        modes = by_event.world.state.failure_modes
        n_steps = by_event.advance_to_event(positions)
        for step in range(n_steps):
            check_able(world, faults, before)
            assert world.state.failure_modes == modes
            before = deepcopy(world.state)
            by_step.step()
            assert np.array_equal(positions[step], world.state.robot_position)
