from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, Warehouse, policies
from swarm_logistics_env.errors import (
    CommandError,
    FaultError,
    ScenarioError,
    SetupError,
    SwarmLogisticsError,
)
from swarm_logistics_env.observations import bounds, n_columns, unflatten
from swarm_logistics_env.warehouse import WarehouseState, stepping
from swarm_logistics_env.warehouse.state import CARRIED, DELIVERED, NOBODY, STORED

N_SCENARIOS = 100
N_STEPS = 80
SLACK = 0.02  # [m] that bodies may sink into walls, besides what one physics step brings


# -- 100 random worlds, checked after every step ------------------------------------------------


@pytest.mark.parametrize("number", range(N_SCENARIOS))
def test_no_law_is_broken_in_a_random_world(number: int) -> None:
    rng = np.random.default_rng([7, number])
    scenario = random_scenario(rng)
    faults = random_faults(rng, scenario, number)
    world = Warehouse(scenario)
    driver = Driver(rng, scenario, number)
    observations = world.reset(number, faults)
    check_laws(world, observations)
    for _ in range(N_STEPS):
        before = copy.deepcopy(world.state)
        observations = world.step(driver.commands(observations, world.state))
        check_laws(world, observations)
        check_changes(world, before)


def random_scenario(rng: np.random.Generator) -> Scenario:
    width, height = rng.uniform(2.0, 6.0), rng.uniform(1.0, 5.0)
    delivery_width = rng.uniform(0.3, 1.2)
    # A third of what would fit: full enough for jams, empty enough to be strewn.
    room = int((width - delivery_width) * height / 0.4)
    return Scenario(
        n_robots=int(rng.integers(1, min(room, 25) + 1)),
        n_items=int(rng.integers(1, min(room, 20) + 1)),
        warehouse_width=width,
        warehouse_height=height,
        delivery_width=delivery_width,
        n_obstacles=int(rng.integers(0, 3)),
        obstacle_radius=rng.uniform(0.05, 0.2),
        restock=bool(rng.random() < 0.4),
        max_speed=float(rng.choice([1.0, 2.0])),
        max_acceleration=float(rng.choice([2.0, 20.0])),
        memory_size=int(rng.integers(0, 4)),
        timer_limit=float(rng.choice([0.5, 2.0, 10.0])),
        radio_range=rng.uniform(0.3, 4.0),
        view_range=rng.uniform(0.3, 1.5),
        ranger_range=rng.uniform(0.3, 2.0),
        pickup_range=rng.uniform(0.15, 0.5),
        relay="gossip" if rng.random() < 0.5 else "none",
        physics_period=float(rng.choice([0.01, 0.02])),
        drive="differential" if rng.random() < 0.3 else "holonomic",
        sensing_mix=(1.0, 0.5) if rng.random() < 0.3 else (1.0,),
        ranger_noise=float(rng.choice([0.0, 0.1])),
        position_noise=float(rng.choice([0.0, 0.1])),
        sensor_dropout=float(rng.choice([0.0, 0.2])),
        radio_loss=float(rng.choice([0.0, 0.2])),
        message_size=int(rng.choice([0, 0, 3])),
    )


def random_faults(rng: np.random.Generator, scenario: Scenario, number: int) -> tuple[Fault, ...]:
    names = sorted(FAILURE_MODES)
    # The first in turn, so that every mode is met; the others as they come.
    modes = [names[number % len(names)], *rng.choice(names, rng.integers(0, 4)).tolist()]
    return tuple(random_fault(rng, str(mode), scenario) for mode in modes)


def random_fault(rng: np.random.Generator, mode: str, scenario: Scenario) -> Fault:
    n = scenario.n_robots
    some: Any = int(rng.integers(1, n + 1))
    if rng.random() < 0.5:
        some = tuple(rng.choice(n, max(n // 3, 1), replace=False).tolist())
    passes = mode != "removed" and rng.random() < 0.5
    return Fault(
        mode,
        some,
        onset=float(rng.choice([0.0, rng.uniform(0.0, 6.0)])),
        duration=rng.uniform(0.1, 3.0) if passes else None,
        factor=0.2 if FAILURE_MODES[mode].factor and rng.random() < 0.5 else None,
    )


class Driver:
    """Swarm D-T, noise, or carriers who know where everything is, in turn."""

    def __init__(self, rng: np.random.Generator, scenario: Scenario, number: int) -> None:
        self._rng, self._n, self._width = rng, scenario.n_robots, 4 + scenario.message_size
        self._kind = ("couriers", "swarm-dt", "noise")[number % 3]
        self._noise = np.zeros((self._n, self._width))
        self._policy = policies.load("swarm-dt")
        self._policy.reset(self._n, number)

    def commands(
        self, observations: NDArray[np.float32], state: WarehouseState
    ) -> NDArray[np.float64]:
        changes = self._rng.random(self._n) < 0.2
        fresh = self._rng.uniform(-1.5, 1.5, (self._n, self._width))
        self._noise = np.where(changes[:, None], fresh, self._noise)
        commands = self._noise.copy()  # the messages, if any, stay noise
        if self._kind == "swarm-dt":
            commands[:, :4] = self._policy.act(observations)
        if self._kind == "couriers":
            commands[:, :4] = couriers(state, self._rng)
        return commands


def couriers(state: WarehouseState, rng: np.random.Generator) -> NDArray[np.float64]:
    """Everybody fetches the requested item, with some noise so that nobody stands for ever."""
    goal = np.tile(np.array([1e3, 0.0]), (state.n_robots, 1))
    gripper = np.ones(state.n_robots)
    if state.requested != NOBODY:
        seeks = state.robot_item != state.requested
        goal[seeks] = (state.item_position[state.requested] - state.robot_position)[seeks]
        gripper[seeks & (state.robot_item != NOBODY)] = -1.0
    goal /= np.maximum(np.linalg.norm(goal, axis=1), 1e-9)[:, None]
    goal += rng.uniform(-0.5, 0.5, goal.shape)
    cosine, sine = np.cos(state.robot_heading), np.sin(state.robot_heading)
    forward = goal[:, 0] * cosine + goal[:, 1] * sine
    left = goal[:, 1] * cosine - goal[:, 0] * sine
    return np.column_stack([forward, left, rng.uniform(-0.3, 0.3, state.n_robots), gripper])


def check_laws(world: Warehouse, observations: NDArray[np.float32]) -> None:
    """Assert all that must hold at any moment."""
    state, scenario = world.state, world.scenario
    here = state.robot_present

    # Items: each in one condition, and those carried agree with who carries them.
    counts = np.bincount(state.item_status, minlength=3)
    returned = state.delivered if scenario.restock else 0
    assert counts.sum() == scenario.n_items
    assert counts[STORED] + counts[CARRIED] + state.delivered - returned == scenario.n_items
    laden = np.flatnonzero(state.robot_item != NOBODY)
    assert len(set(state.robot_item[laden])) == len(laden)
    np.testing.assert_array_equal(state.item_carrier[state.robot_item[laden]], laden)
    carried = np.flatnonzero(state.item_status == CARRIED)
    np.testing.assert_array_equal(np.sort(state.robot_item[laden]), carried)
    np.testing.assert_array_equal(
        state.item_position[state.robot_item[laden]], state.robot_position[laden]
    )
    assert (state.item_carrier[state.item_status != CARRIED] == NOBODY).all()

    # One request, until nothing is left.
    if state.requested == NOBODY:
        assert (state.item_status == DELIVERED).all()
    else:
        assert state.item_status[state.requested] != DELIVERED
    assert state.delivery_times == sorted(state.delivery_times)
    assert len(state.delivered_by) == state.delivered

    # Places.
    size = np.array([scenario.warehouse_width, scenario.warehouse_height])
    closing = scenario.max_speed * scenario.physics_period
    margin = scenario.robot_radius - closing - SLACK
    at = state.robot_position[here]
    assert margin > 0.0
    assert (at >= margin).all()
    assert (at <= size - margin).all()
    free = state.item_position[state.item_status == STORED]
    assert (free >= 0.0).all()
    assert (free <= size).all()
    inside = here & (state.robot_position[:, 0] >= scenario.storage_width)
    if state.step:
        np.testing.assert_array_equal(state.robot_in_delivery, inside)
    assert (np.abs(state.robot_heading) <= np.pi).all()

    # Timers.
    for timer in (state.robot_timer, state.robot_told):
        running = timer[~np.isnan(timer)]
        assert (running >= 0.0).all()
        assert (running < scenario.timer_limit).all()
    assert (state.robot_timer[state.robot_in_delivery] == 0.0).all()

    # Robots that are absent.
    assert not observations[~here].any()
    for row in (state.robot_position, state.robot_velocity, state.robot_heading):
        assert not row[~here].any()
    for flag in (state.robot_in_delivery, state.robot_contact):
        assert not flag[~here].any()
    assert (state.robot_item[~here] == NOBODY).all()
    assert (state.robot_memory[~here] == NOBODY).all()
    assert np.isnan(state.robot_timer[~here]).all()
    assert np.isnan(state.robot_told[~here]).all()

    # What is sensed.
    low, high = bounds(scenario)
    assert observations.shape == (scenario.n_robots, n_columns(scenario))
    assert observations.dtype == np.float32
    assert (observations[here] >= low).all()
    assert (observations[here] <= high).all()


def check_changes(world: Warehouse, before: WarehouseState) -> None:
    """Assert all that one step must not do, least of all what a failed robot cannot."""
    state, scenario = world.state, world.scenario
    assert state.delivered >= before.delivered
    assert state.delivery_times[: before.delivered] == before.delivery_times
    assert not (state.robot_present & ~before.robot_present).any()
    if state.delivered == before.delivered:
        assert state.requested == before.requested

    newly_laden = (state.robot_item != before.robot_item) & (state.robot_item != NOBODY)
    overlap = deepest_overlap(state.robot_position[state.robot_present], scenario.robot_radius)
    assert overlap <= 2.0 * scenario.max_speed * scenario.physics_period

    # A robot may travel at its top speed, plus what others push it.
    moved = np.linalg.norm(state.robot_position - before.robot_position, axis=1)
    furthest = (2.0 * scenario.max_speed + 0.5) * scenario.control_period
    assert (moved[state.robot_present] <= furthest).all()
    for robot, modes in enumerate(before.failure_modes):
        if {"FM2", "dead"} & set(modes):
            assert not newly_laden[robot]
        if {"FM4", "dead"} & set(modes):
            assert robot not in state.delivered_by[before.delivered :]
        if "dead" in modes and state.robot_present[robot]:
            assert state.robot_item[robot] == before.robot_item[robot]
            assert state.robot_heading[robot] == before.robot_heading[robot]
        if {"motor_dead", "dead"} & set(modes) and is_left_alone(world, before, robot):
            assert moved[robot] < 1e-4  # what the solver still corrects of an old overlap
        if "FM1" in modes and "FM1" in state.failure_modes[robot] and state.robot_present[robot]:
            assert state.robot_told[robot] == 0.0
        assert "removed" not in modes or not state.robot_present[robot]


def is_left_alone(world: Warehouse, before: WarehouseState, robot: int) -> bool:
    """Return whether a robot stood still and nothing can have pushed it in the step just taken."""
    state, scenario = world.state, world.scenario
    if not state.robot_present[robot] or np.linalg.norm(before.robot_velocity[robot]) > 1e-3:
        return False
    if before.robot_contact[robot]:
        return False
    others = before.robot_present.copy()
    others[robot] = False
    gaps = np.linalg.norm(before.robot_position[others] - before.robot_position[robot], axis=1)
    reach = 2.0 * scenario.robot_radius + 2.5 * scenario.max_speed * scenario.control_period
    return bool((gaps > reach).all())


def deepest_overlap(position: NDArray[np.float64], radius: float) -> float:
    gaps = np.linalg.norm(position[:, None] - position[None], axis=2)
    np.fill_diagonal(gaps, np.inf)
    return float(2.0 * radius - gaps.min(initial=np.inf))


# -- reset, step, observe -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "ask",
    [
        lambda world: world.step(np.zeros((2, 4))),
        lambda world: world.observe(),
        lambda world: world.change(view_range=0.5),
        lambda world: world.set_faults([Fault("FM1")]),
    ],
)
def test_what_needs_an_episode_is_refused_before_the_first_reset(
    ask: Callable[[Warehouse], object],
) -> None:
    world = Warehouse(Scenario(n_robots=2))
    with pytest.raises(SetupError, match=r"before reset: call reset\(seed\) first"):
        ask(world)
    assert (world.struck_robots, world.n_removed, world.is_over_time) == ((), 0, False)


@pytest.mark.parametrize(
    ("make", "error", "complaint"),
    [
        (lambda world: world.reset(0, None), FaultError, "faults = None: should be a list of"),
        (lambda world: world.reset(0, ["FM1"]), FaultError, "should be a list of Fault"),
        (lambda world: world.reset(0, (), {}), ScenarioError, "scenario = {}: should be a Scen"),
        (lambda world: world.set_faults(None), FaultError, "faults = None"),
        (lambda world: type(world)(dict), ScenarioError, "scenario = <class 'dict'>: should be"),
        (lambda world: type(world)({}), ScenarioError, "scenario = {}: should be a Scenario"),
    ],
)
def test_what_is_no_scenario_fault_or_seed_is_refused(
    make: Callable[[Any], object], error: type[Exception], complaint: str
) -> None:
    world = Warehouse(Scenario(n_robots=2))
    first = world.reset(0)
    with pytest.raises(error, match=complaint):
        make(world)
    np.testing.assert_array_equal(world.observe(), first)


@pytest.mark.parametrize(
    ("commands", "complaint"),
    [
        (np.zeros((3, 4)), r"\(3, 4\): should be \(2, 4\)"),
        (np.zeros((2, 3)), r"\(2, 3\): should be \(2, 4\)"),
        (np.zeros(8), r"\(8,\): should be \(2, 4\)"),
        ([["a"] * 4] * 2, "numbers"),
        ([["1"] * 4] * 2, "numbers: real ones, not <U1"),
        (np.ones((2, 4), "m8[s]"), "numbers: real ones, not timedelta64"),
        (np.ones((2, 4), "M8[s]"), "numbers: real ones, not datetime64"),
        (np.full((2, 4), "1", dtype=object), "numbers: real ones, not object"),
        (np.ones((2, 4), complex), "numbers: real ones, not complex128"),
        ([[0, 0, 0, 0], [0, 0]], "numbers"),
        (np.array([[0, 0, 0, 0], [0, np.nan, 0, 0]]), r"\[1, 1\] = nan: should be finite"),
        (np.array([[0, 0, 0, -np.inf], [0, 0, 0, 0]]), r"\[0, 3\] = -inf: should be finite"),
    ],
)
def test_impossible_commands_are_refused_and_change_nothing(commands: Any, complaint: str) -> None:
    scenario = Scenario(n_robots=2, n_items=3)
    world, undisturbed = Warehouse(scenario), Warehouse(scenario)
    drive = np.array([[1.0, 0.0, 0.5, 1.0], [0.3, -0.4, 0.0, 1.0]])
    for each in (world, undisturbed):
        each.reset(1)
        each.step(drive)
    with pytest.raises(CommandError, match=complaint):
        world.step(commands)
    for _ in range(5):
        np.testing.assert_array_equal(world.step(drive), undisturbed.step(drive))
    np.testing.assert_array_equal(world.state.robot_heading, undisturbed.state.robot_heading)
    assert world.state.time == undisturbed.state.time


def test_the_row_of_a_removed_robot_is_ignored_whatever_it_holds() -> None:
    scenario = Scenario(n_robots=3, n_items=3)
    removed = Fault("removed", (1,))
    worlds = [Warehouse(scenario) for _ in range(3)]
    commands = [np.full((3, 4), 0.5) for _ in worlds]
    commands[1][1] = [-1.0, 1.0, 1.0, -1.0]
    commands[2][1] = np.nan
    for world in worlds:
        world.reset(0, [removed])
    for _ in range(5):
        plain, other, nan = (world.step(given) for world, given in zip(worlds, commands))
        np.testing.assert_array_equal(plain, other)
        np.testing.assert_array_equal(plain, nan)
        assert not plain[1].any()


def test_what_was_observed_stays_as_it_was() -> None:
    world = Warehouse(Scenario(n_robots=2))
    first = world.reset(0)
    kept = first.copy()
    second = world.step(np.ones((2, 4)))
    np.testing.assert_array_equal(first, kept)
    assert not np.array_equal(first, second)
    np.testing.assert_array_equal(second, world.observe())


def test_commands_are_left_as_they_were_given() -> None:
    world = Warehouse(Scenario(n_robots=2))
    world.reset(0, [Fault("removed", (0,))])
    commands = np.full((2, 4), 3.0)
    world.step(commands)
    assert (commands == 3.0).all()


def test_a_seed_decides_the_start_and_another_gives_another() -> None:
    world = Warehouse(Scenario(n_robots=4))
    first, again, other = world.reset(0), world.reset(0), world.reset(1)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_reset_forgets_everything_of_the_episode_before() -> None:
    scenario = Scenario(n_robots=6, n_items=10, warehouse_width=4, warehouse_height=3)
    used, fresh = Warehouse(scenario), Warehouse(scenario)
    used.reset(5, [Fault("removed", 2), Fault("dead", (0,), onset=0.5)])
    rng = np.random.default_rng(0)
    for _ in range(60):
        used.step(couriers(used.state, rng))
    np.testing.assert_array_equal(used.reset(3), fresh.reset(3))
    for _ in range(30):
        commands = couriers(fresh.state, rng)
        np.testing.assert_array_equal(used.step(commands), fresh.step(commands))


def test_reset_takes_another_scenario_from_then_on() -> None:
    world = Warehouse(Scenario(n_robots=2))
    assert world.reset(0, scenario=Scenario(n_robots=5)).shape[0] == 5
    assert world.step(np.zeros((5, 4))).shape[0] == 5
    assert world.reset(0).shape[0] == 5


def test_a_refused_reset_leaves_the_world_going() -> None:
    world, undisturbed = Warehouse(Scenario(n_robots=2)), Warehouse(Scenario(n_robots=2))
    for each in (world, undisturbed):
        each.reset(0)
    with pytest.raises(SwarmLogisticsError):
        world.reset(1, [Fault("FM1", 3)])
    commands = np.full((2, 4), 0.5)
    np.testing.assert_array_equal(world.step(commands), undisturbed.step(commands))


def test_time_is_counted_in_control_periods_until_the_duration() -> None:
    world = Warehouse(Scenario(n_robots=1, duration=0.7, control_period=0.1))
    world.reset(0)
    over = []
    for _ in range(7):
        world.step(np.zeros((1, 4)))
        over.append(world.is_over_time)
    assert over == [False] * 6 + [True]
    assert world.state.time == pytest.approx(0.7)


def test_at_the_start_all_are_in_the_storage_and_timers_are_silent() -> None:
    world = Warehouse(Scenario())
    world.reset(0)
    state = world.state
    assert (state.robot_position[:, 0] < world.scenario.storage_width).all()
    assert np.isnan(state.robot_timer).all()
    assert np.isnan(state.robot_told).all()
    assert (state.item_status == STORED).all()
    assert state.delivered == 0
    assert state.time == 0.0


def test_what_is_assigned_to_the_state_is_what_the_next_step_works_on() -> None:
    world = Warehouse(Scenario(n_robots=1, n_items=2))
    world.reset(0)
    before = world.state.item_position
    world.state.item_position = world.state.robot_position[[0, 0]] + [[0.5, 0.0], [0.0, 0.5]]
    assert world.state.item_position is before
    columns = unflatten(world.step(np.zeros((1, 4))), world.scenario)
    np.testing.assert_allclose(columns["item_present"][0, :2], 1.0)
    assert not columns["item_present"][0, 2:].any()


def test_a_full_log_that_nobody_took_over_is_told_again_and_grows_no_further() -> None:
    world = Warehouse(Scenario(n_robots=2, n_items=4))
    world.reset(0)
    commands, rows = world._world.commands, world.observe().copy()
    longest = len(commands.log) // 2
    told = [stepping.step(world.address, rows) for _ in range(longest + 2)]
    assert told[1 : longest - 1] == [False] * (longest - 2)
    assert told[longest - 1 :] == [True] * 3
    assert commands.n_logged[0] == longest
    world.step(np.zeros((2, 4)))
    copied = copy.deepcopy(world)
    np.testing.assert_array_equal(copied.step(np.ones((2, 4))), world.step(np.ones((2, 4))))
