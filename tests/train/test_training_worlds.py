from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.train.settings import Conditions
from swarm_logistics_env.train.training_worlds import EpisodeMix, NetworkView, make_worlds
from swarm_logistics_env.world.motion.memory import BODY, MEMORY, OPEN, body_of
from swarm_logistics_env.world.warehouse import Fault
from swarm_logistics_env.wrappers import Condition


def mixed(*kinds: Conditions) -> EpisodeMix:
    return EpisodeMix(SwarmLogisticsEnv(n_robots=4, n_items=5, duration=1.0), kinds)


@pytest.mark.unmeasured
def test_episodes_are_drawn_by_weight_and_seed() -> None:
    kinds = (
        Conditions(weight=3.0),
        Conditions(modes=("FM1", "FM4"), robots=(1, 3), onset=(0.0, 0.5)),
    )
    env, other = mixed(*kinds), mixed(*kinds)
    met: Counter[tuple[str, object]] = Counter()
    onsets = []
    for seed in range(200):
        env.reset_arrays(seed)
        faults = env.warehouse.faults
        met[(faults[0].mode, faults[0].robots) if faults else ("none", 0)] += 1
        onsets += [fault.onset for fault in faults]
    assert 0.0 <= min(onsets) < 0.1 < 0.4 < max(onsets) <= 0.5
    assert 130 <= met["none", 0] <= 170
    assert set(met) == {("none", 0), ("FM1", 1), ("FM1", 3), ("FM4", 1), ("FM4", 3)}
    other.reset_arrays(199)
    assert other.warehouse.faults == env.warehouse.faults


def test_scenarios_are_drawn_and_options_come_first() -> None:
    env = mixed(Conditions(scenario={"delivery_width": [1.0, 3.0]}))
    widths = set()
    for seed in range(20):
        env.reset_arrays(seed)
        widths.add(env.warehouse.scenario.delivery_width)
    assert widths == {1.0, 3.0}
    env.reset_arrays(0, {"scenario": {"delivery_width": 2.5}, "faults": [Fault("FM2", 1)]})
    assert env.warehouse.scenario.delivery_width == 2.5
    assert [fault.mode for fault in env.warehouse.faults] == ["FM2"]


def test_kinds_of_worlds_play_their_own_conditions_or_else_those_of_the_training(
    small: Any,
) -> None:
    own_conditions = [{"modes": ["FM2"], "robots": [1]}]
    kinds = [{"n_robots": 3, "conditions": own_conditions}, {"n_robots": 5}]
    env = make_worlds(small(worlds=kinds, conditions=[{"modes": ["FM4"], "robots": [2]}]))
    env.seed(0)
    env.reset()
    faults = [[(f.mode, f.robots) for f in world.warehouse.faults] for world in env.worlds]
    assert faults == [[("FM2", 1)], [("FM4", 2)]]


def test_indicators_are_relative_to_what_was_measured_in_worlds_that_are_alike(small: Any) -> None:
    conditions = [
        {"modes": ["FM4"], "robots": [1]},
        {"modes": ["removed"], "robots": [1]},
        {"scenario": {"max_speed": [1.5]}},
    ]
    kinds = [{"n_robots": 2}, {"n_robots": 4}, {"n_robots": 4, "scenario": {"n_items": 6}}]
    weights = {"S": 1.0, "FT": 1.0, "R": 1.0, "A": 1.0, "P": 0.1}
    indicators = {"weights": weights, "references": "measured"}
    env = make_worlds(small(worlds=kinds, conditions=conditions, indicators=indicators))
    few, many, apart = env.worlds
    assert few.measured is many.measured is not apart.measured
    assert env.num_envs == 2 + 4 + 4
    for condition, p in (
        (Condition(2), 10),
        (Condition(2, ("FM4",), 1), 5),
        (Condition(2, n_removed=1), 4),
        (Condition(4), 16),
    ):
        few.measured.add(condition, p)
    # S of twice as many robots is relative to the small world: 2 / 2 x (P - 10) / 10.
    assert many.payments_of(Condition(4))["S"].share == pytest.approx(0.1)
    assert many.payments_of(Condition(4))["S"].constant == pytest.approx(-1.0)
    ft = few.payments_of(Condition(2, ("FM4",), 1))["FT"]
    assert (ft.share, ft.constant) == (pytest.approx(0.1), pytest.approx(-0.4))
    env.seed(0)
    env.reset()
    for _ in range(2 * 60):  # two episodes in each world
        env.step(np.zeros((env.num_envs, 4), np.float32))
    assert {condition.n_robots for condition in apart.measured.conditions} == {4}


def test_a_large_swarm_may_learn_beside_a_room_in_which_it_has_no_place(small: Any) -> None:
    hall = {"n_robots": 300, "scenario": {"warehouse_width": 30.0, "warehouse_height": 30.0}}
    indicators = {"weights": {"R": 1.0}, "references": 9.0}
    training = small(worlds=[{"n_robots": 2}, hall], indicators=indicators)
    assert make_worlds(training).num_envs == 302


def test_a_row_whose_episode_is_over_remembers_nothing_of_it(small: Any) -> None:
    view = NetworkView(small())
    view.seed(0)
    assert view.observation_space.contains(view.reset()[0])
    n_steps, commands = 0, np.ones((view.num_envs, 3), np.float32)
    dones = np.zeros(view.num_envs, np.bool_)
    while not dones.any():
        view.step_async(commands)
        _, _, dones, _ = view.step_wait()
        n_steps += 1
        # Decisions in this episode, and whether any command in it is remembered.
        assert view.frame.counts.tolist() == np.where(dones, 1, n_steps + 1).tolist()
        assert ((view.frame.memory[:, MEMORY.held] != OPEN) == ~dones).all()
    assert n_steps > 5


def test_between_decisions_worlds_go_on_and_their_rewards_are_summed(small: Any) -> None:
    network = {"hidden": (8,), "decides_every": 3}
    rewards = {"contact": -1.0, "delivery": 1.0}
    often, seldom = (
        NetworkView(small(rewards=rewards)),
        NetworkView(small(rewards=rewards, network=network)),
    )
    outputs = np.tile(
        np.array([1.0, 0.0, 1.0], np.float32), (8, 1)
    )  # ahead, until they run into something
    for view in (often, seldom):
        view.seed(0)
        view.reset()
    for _ in range(20):
        total = np.zeros(8)
        for _ in range(3):
            often.step_async(outputs)
            _, earned, dones, _ = often.step_wait()
            total += earned
        seldom.step_async(outputs)
        _, earned, seldom_dones, _ = seldom.step_wait()
        # Holonomic robots that drive ahead in the frame of their motion never turn it.
        np.testing.assert_allclose(earned, total, atol=1e-6)
        assert seldom.frame.counts.tolist() == often.frame.counts.tolist()
    assert dones.all()
    assert seldom_dones.all()


def test_rewards_change_in_every_world_from_the_next_step_on(small: Any) -> None:
    first, second = (NetworkView(small(rewards={"contact": -1.0})) for _ in range(2))
    ahead = np.tile(np.array([1.0, 0.0, 1.0], np.float32), (8, 1))
    for view in (first, second):
        view.seed(0)
        view.reset()
        assert not view.step(ahead)[1].any()
    second.change_rewards({"contact": -3.0})
    paid = np.array([[view.step(ahead)[1] for _ in range(40)] for view in (first, second)])
    np.testing.assert_allclose(paid[1], 3.0 * paid[0], rtol=1e-6)
    for world in first.venv.rows_of_worlds:
        assert (paid[0][:, world] < 0.0).any()


def test_headings_at_the_start_are_those_of_the_seed(small: Any) -> None:
    headings = []
    for seed in (3, 3, 4):
        view = NetworkView(small())
        view.seed(seed)
        view.reset()
        headings.append(view.frame.memory[:, MEMORY.heading_x].tolist())
    assert headings[0] == headings[1] != headings[2]


def test_every_episode_has_the_bodies_of_its_robots_and_random_numbers_of_its_own(
    small: Any,
) -> None:
    mixed = [{"scenario": {"drive": ["holonomic", "differential"]}}]
    view = NetworkView(small(conditions=mixed))
    view.seed(0)
    view.reset()
    drives, keys = set(), set(view.frame.keys.tolist())
    for _ in range(6):
        for world, rows in zip(view.venv.worlds, view.venv.rows_of_worlds):
            scenario = world.warehouse.scenario
            drives.add((rows.start, scenario.drive))
            assert (view.frame.memory[rows, BODY] == body_of(scenario)).all()
        dones = np.zeros(view.num_envs, np.bool_)
        while not dones.any():
            view.step_async(np.zeros((view.num_envs, 3), np.float32))
            _, _, dones, _ = view.step_wait()
        keys |= set(view.frame.keys.tolist())
    assert drives == {(row, drive) for row in (0, 3) for drive in ("holonomic", "differential")}
    assert len(keys) == 7 * view.num_envs
