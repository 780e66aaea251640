"""The rules of foraging, and that a study plays it like any other task."""

from __future__ import annotations

import pickle
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env import observations as row
from swarm_logistics_env.episode import Episode, run_episode
from swarm_logistics_env.errors import CommandError, ScenarioError
from swarm_logistics_env.policies.forager import Forager
from swarm_logistics_env.tasks.foraging import Foraging, ForagingScenario
from swarm_logistics_env.warehouse.state import CARRIED, NOBODY, STORED, WarehouseState

MIDDLE = np.array([5.0, 5.0])
HOLD = np.array([0.0, 0.0, 0.0, 1.0])
WEST = np.array([-1.0, 0.0, 0.0, 1.0])


def placed(
    robots: ArrayLike, items: ArrayLike, faults: Sequence[Fault] = (), **fields: Any
) -> Foraging:
    """Return a world with everything where a test wants it; all robots look along +x."""
    places, item_places = (np.array(rows, np.float64).reshape(-1, 2) for rows in (robots, items))

    class Placed(Foraging):
        def _lay_out(self, state: WarehouseState, scenario: Scenario, seed: int) -> None:
            super()._lay_out(state, scenario, seed)
            state.robot_position, state.item_position = places, item_places
            state.robot_heading = np.zeros(len(places))

    counts = {"n_robots": len(places), "n_items": len(item_places)}
    world = Placed(ForagingScenario(**{"heading_drift": 0.0, **counts, **fields}))
    world.reset(0, faults)
    return world


def drive(world: Foraging, *commands: NDArray[np.float64], steps: int = 1) -> NDArray[np.float32]:
    for _ in range(steps):
        rows = world.step(np.array(commands))
    return rows


def play(seed: int, faults: Sequence[Fault] = (), **fields: Any) -> Episode:
    scenario = ForagingScenario(**{"n_robots": 12, "duration": 60.0, **fields})
    return run_episode(scenario, Forager(), seed, faults, world_type=Foraging)


def from_nest(world: Foraging) -> NDArray[np.float64]:
    """Return each item's distance from the middle of the nest [m]."""
    return np.asarray(np.linalg.norm(world.state.item_position - MIDDLE, axis=1))


def test_any_item_counts_and_comes_back_out_of_the_nests_reach() -> None:
    # Two robots and two items side by side, 1.5 m east of the middle; the later item comes first.
    world = placed([[6.5, 5.2], [6.5, 4.8]], [[6.5, 5.2], [6.5, 4.8]])
    drive(world, HOLD, HOLD)
    assert world.state.robot_item.tolist() == [0, 1]
    drive(world, HOLD, WEST, steps=8)
    assert world.state.delivered_by == [1]
    drive(world, WEST, HOLD, steps=8)
    assert world.state.delivered_by == [1, 0]
    assert world.state.robot_item.tolist() == [NOBODY, NOBODY]
    assert world.state.item_status.tolist() == [STORED, STORED]
    assert (from_nest(world) > 1.25).all()
    assert not world.all_delivered


def test_what_came_back_is_solid_again_and_can_be_lifted_again() -> None:
    world = placed([[6.5, 5.0]], [[6.5, 5.0]])
    drive(world, HOLD)
    drive(world, WEST, steps=8)
    assert world.state.delivered_by == [0]
    drive(world, HOLD)
    assert world.state.item_covered.tolist() == [0]
    for _ in range(200):  # drives there and lifts it
        offset = world.state.item_position[0] - world.state.robot_position[0]
        drive(world, np.array([*np.clip(offset, -1.0, 1.0), 0.0, 1.0]))
    assert world.state.robot_item.tolist() == [0]


def test_without_restock_it_ends_when_the_last_item_is_home() -> None:
    episode = play(3, n_items=4, restock=False, duration=500.0, n_robots=25)
    assert episode.all_delivered
    assert episode.delivered == 4
    assert episode.ended_at == episode.delivery_times[-1] < 500.0


def test_the_nest_is_a_disc_in_the_middle_and_resets_timers() -> None:
    world = placed([[5.95, 5.0], [5.72, 5.72], [9.9, 5.0]], [[1.0, 1.0]])
    rows = drive(world, HOLD, HOLD, HOLD)
    assert rows[:, row.IN_DELIVERY_AREA].tolist() == [1.0, 0.0, 0.0]
    assert rows[:, row.TIMER_RUNS].tolist() == [1.0, 0.0, 0.0]
    assert rows[1, row.LOWEST_TIMER : row.LOWEST_TIMER + 4] == pytest.approx(
        [1.0, 0.23, -0.72, 0.0], abs=1e-6
    )
    assert rows[2, row.LOWEST_TIMER] == 1.0  # 3.95 m away, within the radio's 4 m


def test_nobody_senses_a_requested_item() -> None:
    world = placed([[8.0, 5.0]], [[8.0, 5.2], [8.3, 5.0]])
    rows = world.observe()
    first = row.ITEMS + row.ITEM_FEATURES.index("requested")
    assert rows[0, row.ITEMS] == 1.0
    assert not rows[:, first : row.NEIGHBOURS : row.ITEM_WIDTH].any()
    rows = drive(world, HOLD)
    assert (rows[0, row.CARRYING], rows[0, row.CARRYING_REQUESTED]) == (1.0, 0.0)


def test_fm4_costs_the_work_of_its_robots_and_blocks_no_other() -> None:
    lanes = [[6.5, 5.2], [6.5, 4.8]]
    world = placed(lanes, lanes, [Fault("FM4", robots=[0])])
    drive(world, HOLD, HOLD)
    drive(world, WEST, WEST, steps=8)
    assert world.state.delivered_by == [1]
    assert world.state.robot_item.tolist() == [0, NOBODY]
    # It cannot let go in the nest either, so that FM4_jam is the same.
    let_go = np.array([0.0, 0.0, 0.0, -1.0])
    drive(world, let_go, HOLD)
    assert world.state.robot_item[0] == 0
    assert world.state.item_status[0] == CARRIED
    assert play(1, [Fault("FM4", 3)]).digest == play(1, [Fault("FM4_jam", 3)]).digest


@pytest.mark.parametrize("seed", range(5))
def test_items_lie_clear_of_the_nest_of_obstacles_and_of_each_other(seed: int) -> None:
    world = Foraging(ForagingScenario(n_items=100, n_obstacles=8, delivery_width=4.0))
    world.reset(seed)
    places, obstacles = world.state.item_position, world.state.obstacle_position
    assert (from_nest(world) > 2.25).all()
    assert (np.abs(places - MIDDLE) <= 4.875).all()
    apart = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(100, 1)]
    assert apart.min() >= 0.25
    assert np.linalg.norm(places[:, None] - obstacles, axis=2).min() >= 0.425


def test_places_do_not_depend_on_how_many_there_are() -> None:
    few, many = (Foraging(ForagingScenario(n_robots=n, n_items=n)) for n in (5, 20))
    few.reset(2)
    many.reset(2)
    np.testing.assert_array_equal(many.state.item_position[:5], few.state.item_position)
    np.testing.assert_array_equal(many.state.robot_position[:5], few.state.robot_position)


def test_items_that_do_not_fit_around_the_nest() -> None:
    with pytest.raises(ScenarioError, match=r"room for 60 items around a nest of 9\.99 m"):
        Foraging(ForagingScenario(delivery_width=9.99, pickup_range=3.0)).reset(0)


def test_equal_seeds_give_equal_bits_in_any_process() -> None:
    faults = [Fault("FM1", 2, onset=20.0), Fault("removed", 1, onset=30.0)]
    here = play(7, faults)
    assert here.delivered > 5
    assert play(8, faults).digest != here.digest
    script = (
        "from swarm_logistics_env import Fault\n"
        "from swarm_logistics_env.episode import run_episode\n"
        "from swarm_logistics_env.policies.forager import Forager\n"
        "from swarm_logistics_env.tasks.foraging import Foraging, ForagingScenario\n"
        "scenario = ForagingScenario(n_robots=12, duration=60.0)\n"
        "faults = [Fault('FM1', 2, onset=20.0), Fault('removed', 1, onset=30.0)]\n"
        "print(run_episode(scenario, Forager(), 7, faults, world_type=Foraging).digest)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == here.digest


def test_a_copy_goes_on_as_the_original_does() -> None:
    policy, world = Forager(), Foraging(ForagingScenario(n_robots=12))
    policy.reset(12, 0)
    rows = world.reset(0, [Fault("dead", 2, onset=10.0)])
    for _ in range(150):
        rows = world.step(policy.act(rows))
    copies = pickle.loads(pickle.dumps((policy, world, rows)))
    ends = []
    for actor, place, sensed in ((policy, world, rows), copies):
        for _ in range(150):
            sensed = place.step(actor.act(sensed))
        ends.append((sensed.tobytes(), place.state.robot_position.tobytes()))
    assert ends[0] == ends[1]


def test_every_item_is_in_one_place_at_every_step() -> None:
    policy, world = Forager(), Foraging(ForagingScenario(n_robots=20, n_items=15))
    rows = world.reset(4, [Fault("removed", 3, onset=8.0)])
    policy.reset(20, 4)
    for _ in range(300):
        rows = world.step(policy.act(rows))
        state = world.state
        laden = np.flatnonzero(state.robot_item != NOBODY)
        assert (
            sorted(state.robot_item[laden]) == np.flatnonzero(state.item_status == CARRIED).tolist()
        )
        free = state.item_status == STORED
        assert free.sum() + len(laden) == 15
        assert np.isfinite(rows).all()
    assert state.delivered == len(state.delivered_by) > 5
    assert not state.robot_present[[*world.struck_robots]].any()


def test_a_refused_command_changes_nothing() -> None:
    world = placed([[6.5, 5.0]], [[6.5, 5.0]])
    with pytest.raises(CommandError, match=r"commands\[0, 1\] = nan"):
        drive(world, np.array([0.0, np.nan, 0.0, 0.0]))
    assert world.state.step == 0
    drive(world, HOLD)
    assert world.state.step == 1


def test_the_forager_keeps_what_it_lifts_and_takes_it_towards_the_lowest_timer() -> None:
    # The first robot stands in the nest and tells timer 0; the other two hear it.
    world = placed([[5.0, 5.0], [7.5, 5.0], [7.5, 6.0]], [[7.5, 5.0]])
    policy = Forager(diffusion=0.0, avoidance_gain=0.0)
    policy.reset(3, 0)
    drive(world, HOLD, HOLD, HOLD)
    directions = []
    for gain in (0.0, 0.75):
        policy = Forager(diffusion=0.0, avoidance_gain=0.0, taxis_gain=gain)
        policy.reset(3, 0)
        directions.append(policy.act(world.observe()))
    without, with_taxis = directions
    np.testing.assert_allclose(with_taxis[2], without[2])  # empty: it searches on
    assert with_taxis[1, 0] < without[1, 0]  # laden: the nest is at its back, along -x
    assert (with_taxis[:, 3] == 1.0).all()
