from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

import torch

from swarm_logistics_env.train.learner import NetworkView, make_learner
from swarm_logistics_env.train.privileged import PRIVILEGED
from swarm_logistics_env.train.settings import PPOSettings
from swarm_logistics_env.world.motion.memory import BODY, MEMORY, OPEN, body_of
from swarm_logistics_env.world.motion.network_inputs import INPUTS


def test_a_row_whose_episode_is_over_remembers_nothing_of_it(small: Any) -> None:
    view = NetworkView(small())
    view.seed(0)
    view.reset()
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


def test_the_actor_sees_nothing_of_it(small: Any) -> None:
    policy = make_learner(small(), NetworkView(small()), "cpu").policy
    columns = torch.randn(50, len(INPUTS) + len(PRIVILEGED))
    changed = columns.clone()
    changed[:, len(INPUTS) :] += 1.0
    with torch.no_grad():
        before, after = (policy.get_distribution(rows).mode() for rows in (columns, changed))
        assert (before == after).all()
        assert (policy.predict_values(columns) != policy.predict_values(changed)).all()


def test_the_learner_learns_as_the_settings_say_and_begins_by_driving_ahead(small: Any) -> None:
    ppo = PPOSettings(
        n_steps=30, epochs=3, n_minibatches=4, gamma=0.9, gae_lambda=0.8, clip=0.3, entropy=0.01,
        value_weight=0.7, max_grad_norm=0.4, target_kl=0.05, deviations=(0.5, 0.3, 0.2),
    )  # fmt: skip
    training = small(ppo=ppo)
    learner = make_learner(training, NetworkView(training), "cpu")
    assert (learner.n_steps, learner.n_epochs, learner.batch_size) == (30, 3, 8 * 30 // 4)
    assert (learner.gamma, learner.gae_lambda, learner.clip_range(1.0)) == (0.9, 0.8, 0.3)
    assert (learner.ent_coef, learner.vf_coef, learner.max_grad_norm) == (0.01, 0.7, 0.4)
    assert (learner.target_kl, learner.lr_schedule(1.0)) == (0.05, ppo.learning_rate)
    with torch.no_grad():
        first = learner.policy.get_distribution(torch.zeros(1, len(INPUTS) + len(PRIVILEGED)))
    assert first.distribution.mean.tolist() == [pytest.approx([0.8, 0.0, 0.0])]
    assert first.distribution.stddev.tolist() == [pytest.approx([0.5, 0.3, 0.2])]


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
