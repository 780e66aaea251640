"""The whole swarm as one Gymnasium environment."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from swarm_logistics_env import Fault
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.errors import CommandError, SetupError, SwarmLogisticsError
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize

SMALL: dict[str, Any] = {
    "warehouse_width": 6.0,
    "warehouse_height": 5.0,
    "n_items": 10,
    "duration": 4.0,
}


def in_wrappers(env: Any) -> Any:
    n = env.unwrapped.scenario.n_robots
    sized = SwarmSize(FaultInjection(env, "FM3_hear", onset=[0.0, 1.0]), [n, n + 3])
    return ParameterChange(sized, "delivery_width", [1.0, 3.0], at=0.0)


WRAPPED: dict[str, Callable[[Any], Any]] = {"plain": lambda env: env, "in wrappers": in_wrappers}


@pytest.mark.parametrize("n_robots", [1, 5])
def test_gymnasiums_check_passes(n_robots: int, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    check_env(gymnasium.make("SwarmLogistics-v0", n_robots=n_robots).unwrapped)
    with warnings.catch_warnings():
        # No name in a registry stands for it.
        warnings.filterwarnings("ignore", ".*Not able to test alternative render modes")
        wrapped = in_wrappers(SwarmLogisticsEnv(n_robots=n_robots, **SMALL, message_size=1))
        check_env(CentralEnv(wrapped, flat=n_robots > 1))


@pytest.mark.parametrize("stack", WRAPPED)
def test_it_is_the_parallel_environment_in_one_piece(stack: str) -> None:
    inner = WRAPPED[stack](SwarmLogisticsEnv(n_robots=5, **SMALL))
    central = CentralEnv(copy.deepcopy(inner))
    rng = np.random.default_rng(0)
    for seed in (0, 1, None, None):
        if seed is None:
            inner.unwrapped.next_seed = central.env.next_seed
        rows = inner.reset_arrays(seed)
        observation, info = central.reset(seed=seed)
        ended = cut = False
        while not (ended or cut):
            assert central.observation_space.contains(observation)
            np.testing.assert_array_equal(observation[: len(rows)], rows)
            assert not observation[len(rows) :].any()
            action = rng.uniform(-1, 1, central.action_space.shape).astype(np.float32)
            observation, reward, ended, cut, info = central.step(action)
            failures = inner.warehouse.state.failure_modes
            deaf = [row for row, modes in enumerate(failures) if modes]
            action[deaf] = 0.0
            rows, rewards, _, _ = inner.step_arrays(action[: len(rows)])
            assert reward == rewards.mean()
        assert (ended, cut) == (False, True)
        assert info["delivered"] == inner.warehouse.state.delivered
        assert not inner.agents


def test_the_reward_is_one_per_delivery_and_all_delivered_terminates() -> None:
    env = CentralEnv(n_robots=3, n_items=2, pickup_range=14.0, duration=60.0)
    env.reset(seed=0)
    total, ended, cut, steps = 0.0, False, False, 0
    while not (ended or cut):
        heading = env.env.warehouse.state.robot_heading
        east = np.stack([np.cos(heading), -np.sin(heading), 0 * heading, 1 + 0 * heading], axis=1)
        _, reward, ended, cut, info = env.step(east)
        assert isinstance(reward, float)
        total += reward
        steps += 1
    assert (ended, cut) == (True, False)
    assert total == 2.0
    assert info["delivered"] == 2


def test_the_reward_is_the_mean_over_those_who_are_there_until_nobody_is() -> None:
    faults = [Fault("removed", 2, onset=0.1)]
    env = CentralEnv(n_robots=3, n_items=1, pickup_range=14.0, duration=60.0, faults=faults)
    env.reset(seed=0)
    state, rewards, ended = env.env.warehouse.state, [], False
    while not ended:
        east = np.stack([np.cos(state.robot_heading), -np.sin(state.robot_heading)], axis=1)
        action = np.hstack([east, np.zeros((3, 1)), np.ones((3, 1))])
        _, reward, ended, cut, _ = env.step(action)
        assert not cut
        rewards.append(reward)
    assert rewards[-1] == 1.0
    env.reset(seed=0, options={"faults": [Fault("removed", 3, onset=0.2)]})
    assert [env.step(np.zeros((3, 4)))[2:4] for _ in range(2)] == [(False, False), (True, False)]


def test_a_robot_that_does_not_hear_stands_still_and_infos_say_who() -> None:
    env = CentralEnv(n_robots=3, faults=[Fault("FM3_hear", (1,))])
    _, info = env.reset(seed=0)
    assert info.keys() == {"delivered", "failed"}
    assert info["delivered"] == 0
    assert info["failed"].tolist() == [0, 1, 0]
    before = env.env.warehouse.state.robot_position.copy()
    for _ in range(3):
        env.step(np.tile([0.3, 0.0, 0.0, 0.0], (3, 1)))
    moved = np.linalg.norm(env.env.warehouse.state.robot_position - before, axis=1)
    assert moved[1] == 0.0
    assert (moved[[0, 2]] > 0.05).all()


def test_more_robots_than_rows_are_refused_and_announced_ones_are_not() -> None:
    options = {"scenario": {"n_robots": 4}}
    with pytest.raises(SetupError, match="n_robots = 4: should be at most 3"):
        CentralEnv(n_robots=3).reset(options=options)
    env = CentralEnv(SwarmSize(SwarmLogisticsEnv(n_robots=3), [3, 4]))
    assert env.reset(seed=0, options=options)[0].shape[0] == 4


@pytest.mark.parametrize(
    "action",
    [
        np.zeros(4),
        np.zeros((2, 4)),
        np.full((3, 4), np.nan),
        "go",
        [[1], [2, 3]],
        None,
        [["1"] * 4] * 3,
    ],
)
def test_wrong_actions_are_refused(action: Any) -> None:
    env = CentralEnv(n_robots=3)
    env.reset(seed=0)
    with pytest.raises(CommandError):
        env.step(action)


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(SetupError, match="not both"):
        CentralEnv(SwarmLogisticsEnv(), n_robots=3)
    with pytest.raises(SetupError, match="should be a SwarmLogisticsEnv or a wrapper"):
        CentralEnv(env=3)  # type: ignore[arg-type]
    with pytest.raises(SwarmLogisticsError, match="did you mean 'n_robots'"):
        gymnasium.make("SwarmLogistics-v0", n_robot=3)
    with pytest.raises(SetupError, match="options = 5"):
        CentralEnv(n_robots=3).reset(options=5)  # type: ignore[arg-type]


def test_state_rendering_and_closing_are_the_environments() -> None:
    pytest.importorskip("pygame")
    env = gymnasium.make("SwarmLogistics-v0", n_robots=2, render_mode="rgb_array")
    env.reset(seed=0)
    picture: Any = env.render()
    assert picture.shape[2] == 3
    central = env.unwrapped
    assert isinstance(central, CentralEnv)
    np.testing.assert_array_equal(central.state(), central.env.state())
    env.close()
    env.close()


def test_flat_is_the_same_in_vectors() -> None:
    flat: Any = CentralEnv(n_robots=3, flat=True, **SMALL)
    rows: Any = CentralEnv(n_robots=3, **SMALL)
    n_columns = rows.observation_space.shape[1]
    assert flat.observation_space.shape == (3 * n_columns,)
    assert flat.action_space.shape == (12,)
    assert (flat.observation_space.high == rows.observation_space.high.ravel()).all()
    np.testing.assert_array_equal(flat.reset(seed=3)[0], rows.reset(seed=3)[0].ravel())
    rng = np.random.default_rng(0)
    for _ in range(40):
        action = rng.uniform(-1, 1, 12).astype(np.float32)
        seen, *ends, _ = flat.step(action)
        wanted, *others, _ = rows.step(action.reshape(3, 4))
        assert flat.observation_space.contains(seen)
        np.testing.assert_array_equal(seen, wanted.ravel())
        assert ends == others
    with pytest.raises(CommandError, match=r"action of shape \(3, 4\) .* should be \(12,\)"):
        flat.step(np.zeros((3, 4)))


def test_stable_baselines3_learns_from_flat_without_a_warning() -> None:
    sb3 = pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env as check_for_sb3

    env = CentralEnv(n_robots=2, flat=True, **SMALL)
    check_for_sb3(env)
    model = sb3.PPO("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0)
    before = [part.detach().clone() for part in model.policy.parameters()]
    assert model.learn(64).num_timesteps == 64
    after = model.policy.parameters()
    assert all(not bool((old == new).all()) for old, new in zip(before, after, strict=True))


def test_np_random_seed_plays_an_episode_again() -> None:
    env = CentralEnv(n_robots=3, **SMALL)
    seeds = []
    for given in (None, 7, None, None):
        first, _ = env.reset(seed=given)
        seeds.append(env.np_random_seed)
        again, _ = CentralEnv(n_robots=3, **SMALL).reset(seed=env.np_random_seed)
        np.testing.assert_array_equal(first, again)
    assert seeds[1] == 7
    assert len(set(seeds)) == 4


def test_gymnasium_writes_a_film(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    pytest.importorskip("moviepy")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make("SwarmLogistics-v0", n_robots=2, render_mode="rgb_array", **SMALL)
    film: Any = gymnasium.wrappers.RecordVideo(env, str(tmp_path / "films"))
    film.reset(seed=0)
    for _ in range(5):
        film.step(film.action_space.sample())
    film.close()
    [written] = (tmp_path / "films").iterdir()
    assert written.suffix == ".mp4"
    assert written.stat().st_size > 1000
