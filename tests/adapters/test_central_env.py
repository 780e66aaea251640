"""The whole swarm as one Gymnasium environment."""

from __future__ import annotations

import copy
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from swarm_logistics_env import Fault
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.core.errors import CommandError, SetupError, SwarmLogisticsError
from swarm_logistics_env.wrappers import FaultInjection, ParameterChange, SwarmSize
from tests.wrappers.conftest import BRIEF, brief, eastward
from tests.wrappers.test_conformance import ORDERS


def in_wrappers(env: Any) -> Any:
    n = env.unwrapped.scenario.n_robots
    sized = SwarmSize(FaultInjection(env, "FM3_hear", onset=[0.0, 1.0]), [n, n + 3])
    return ParameterChange(sized, "delivery_width", [1.0, 3.0], at=0.0)


@pytest.mark.parametrize("n_robots", [1, 5])
def test_gymnasiums_check_passes(n_robots: int, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    check_env(gymnasium.make("SwarmLogistics-v0", n_robots=n_robots).unwrapped)
    with warnings.catch_warnings():
        # No name in a registry stands for it.
        warnings.filterwarnings("ignore", ".*Not able to test alternative render modes")
        wrapped = in_wrappers(brief(n_robots=n_robots, message_size=1, **ORDERS))
        check_env(CentralEnv(wrapped, flat=n_robots > 1))


def test_it_is_the_parallel_environment_in_one_piece() -> None:
    inner = in_wrappers(brief(n_robots=5))
    central = CentralEnv(copy.deepcopy(inner))
    rng = np.random.default_rng(0)
    for seed in (0, 1):
        rows = inner.reset_arrays(seed)
        observation, info = central.reset(seed=seed)
        ended = cut = False
        while not (ended or cut):
            assert central.observation_space.contains(observation)
            np.testing.assert_array_equal(observation[: len(rows)], rows)
            assert not observation[len(rows) :].any()
            failed = inner.warehouse.state.failed
            assert info["failed"].tolist() == [*failed, *[0] * (8 - len(rows))]
            action = rng.uniform(-1, 1, central.action_space.shape).astype(np.float32)
            observation, reward, ended, cut, info = central.step(action)
            action[np.flatnonzero(failed)] = 0.0  # they are deaf
            rows, rewards, _, _ = inner.step_arrays(action[: len(rows)])
            assert reward == rewards.mean()
        assert (ended, cut) == (False, True)
        assert info.keys() == {"delivered", "failed", "away"}
        assert info["delivered"] == inner.warehouse.state.delivered
        assert not inner.agents


def test_the_reward_is_one_per_delivery_whoever_is_gone_and_all_delivered_terminates() -> None:
    faults = [Fault("removed", 2, onset=0.1)]
    env = CentralEnv(n_robots=3, n_items=1, pickup_range=14.0, duration=60.0, faults=faults)
    env.reset(seed=0)
    total, ended, cut = 0.0, False, False
    while not (ended or cut):
        _, reward, ended, cut, info = env.step(eastward(env.env))
        assert isinstance(reward, float)
        total += reward
    assert (ended, cut) == (True, False)
    assert total == info["delivered"] == 1
    env.reset(seed=0, options={"faults": [Fault("removed", 3, onset=0.2)]})
    assert [env.step(np.zeros((3, 4)))[2:4] for _ in range(2)] == [(False, False), (True, False)]


def test_what_cannot_be_is_refused() -> None:
    env = CentralEnv(n_robots=3)
    env.reset(seed=0)
    wrong: Any
    for wrong in (np.zeros((2, 4)), np.full((3, 4), np.nan), "go"):
        with pytest.raises(CommandError):
            env.step(wrong)
    assert env.env.warehouse.state.step == 0
    with pytest.raises(SetupError, match="n_robots = 4: should be at most 3"):
        env.reset(options={"scenario": {"n_robots": 4}})
    with pytest.raises(SetupError, match="not both"):
        CentralEnv(brief(), n_robots=3)
    with pytest.raises(SwarmLogisticsError, match="did you mean 'n_robots'"):
        gymnasium.make("SwarmLogistics-v0", n_robot=3)


@pytest.mark.parametrize("prefix", ["", "swarm_logistics_env:"])
def test_gymnasium_makes_it_by_name_after_a_bare_import(prefix: str) -> None:
    script = (
        f"import sys, gymnasium{'' if prefix else ', swarm_logistics_env'};"
        "assert 'swarm_logistics_env.environment.parallel_env' not in sys.modules;"
        f"gymnasium.make('{prefix}SwarmLogistics-v0', n_robots=4);"
        "assert not {'torch', 'stable_baselines3'} & sys.modules.keys()"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


MODES = ["NextStep", "SameStep", "Disabled"] if hasattr(gymnasium.vector, "AutoresetMode") else []


@pytest.mark.parametrize("mode", [None, *MODES])  # Gymnasium 1.1 has modes
def test_gymnasium_makes_several_at_once(mode: str | None) -> None:
    fields: Any = {"n_robots": 3, "duration": 0.3, "flat": mode is None}
    kwargs: Any = {"vector_kwargs": {"autoreset_mode": mode}} if mode else {}
    vector: Any = gymnasium.make_vec("SwarmLogistics-v0", num_envs=2, **fields, **kwargs)
    alone: Any = gymnasium.make("SwarmLogistics-v0", **fields)
    first, _ = vector.reset(seed=[4, 5])
    for index in range(2):
        assert alone.reset(seed=4 + index)[0].tobytes() == first[index].tobytes()
    for step in range(3):
        rows, _, _, cut, infos = vector.step(vector.action_space.sample())
        assert cut.tolist() == [step == 2] * 2
    assert infos["failed"].shape == (2, 3)
    assert ("final_obs" in infos) == (mode == "SameStep")
    if mode == "Disabled":
        rows, _ = vector.reset(seed=[4, 5], options={"reset_mask": np.array([True, False])})
        assert rows[0].tobytes() == first[0].tobytes()
    else:
        rows, _, _, cut, _ = vector.step(vector.action_space.sample())
        assert not cut.any()
    assert rows.shape == (2, *alone.observation_space.shape)
    vector.close()


def test_flat_is_the_same_in_vectors() -> None:
    flat, rows = (CentralEnv(n_robots=3, flat=flat, **BRIEF) for flat in (True, False))
    assert (flat.observation_space.high == rows.observation_space.high.ravel()).all()  # type: ignore[attr-defined]
    assert flat.action_space.shape == (12,)
    np.testing.assert_array_equal(flat.reset(seed=3)[0], rows.reset(seed=3)[0].ravel())
    rng = np.random.default_rng(0)
    for _ in range(20):
        action = rng.uniform(-1, 1, 12).astype(np.float32)
        seen, *ends, _ = flat.step(action)
        wanted, *expected_ends, _ = rows.step(action.reshape(3, 4))
        assert flat.observation_space.contains(seen)
        np.testing.assert_array_equal(seen, wanted.ravel())
        assert ends == expected_ends
    with pytest.raises(CommandError, match=r"action of shape \(3, 4\) .* should be \(12,\)"):
        flat.step(np.zeros((3, 4)))


@pytest.mark.daily
def test_stable_baselines3_learns_from_flat_without_a_warning() -> None:
    sb3 = pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.env_checker import check_env as check_for_sb3

    env = CentralEnv(n_robots=2, flat=True, **BRIEF)
    check_for_sb3(env)
    model = sb3.PPO("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0)
    before = [part.detach().clone() for part in model.policy.parameters()]
    assert model.learn(64).num_timesteps == 64
    after = model.policy.parameters()
    assert all(not bool((old == new).all()) for old, new in zip(before, after, strict=True))


def test_np_random_seed_plays_an_episode_again() -> None:
    env = CentralEnv(n_robots=3, **BRIEF)
    seeds = []
    for seed in (None, 7, None, None):
        first, _ = env.reset(seed=seed)
        seeds.append(env.np_random_seed)
        again, _ = CentralEnv(n_robots=3, **BRIEF).reset(seed=env.np_random_seed)
        np.testing.assert_array_equal(first, again)
    assert seeds[1] == 7
    assert len(set(seeds)) == 4


def test_gymnasium_writes_a_film(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    pytest.importorskip("moviepy")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make("SwarmLogistics-v0", n_robots=2, render_mode="rgb_array", **BRIEF)
    film: Any = gymnasium.wrappers.RecordVideo(env, str(tmp_path / "films"))
    film.reset(seed=0)
    np.testing.assert_array_equal(film.unwrapped.state(), film.unwrapped.env.state())
    for _ in range(5):
        film.step(film.action_space.sample())
    film.close()
    film.close()
    [written] = (tmp_path / "films").iterdir()
    assert written.suffix == ".mp4"
    assert written.stat().st_size > 1000


def test_a_delivery_pays_one_in_the_step_of_a_removal_as_well() -> None:
    def total(**fields: Any) -> tuple[float, CentralEnv]:
        env = CentralEnv(n_robots=3, n_items=2, pickup_range=14.0, duration=60.0, **fields)
        env.reset(seed=0)
        paid, is_over = 0.0, False
        while not is_over:
            _, reward, *ends, _ = env.step(eastward(env.env))
            paid, is_over = paid + reward, any(ends)
        return paid, env

    _, env = total()
    state = env.env.warehouse.state
    last = next(robot for robot in range(3) if robot not in state.delivered_by)
    paid, env = total(faults=[Fault("removed", (last,), onset=state.delivery_times[0])])
    assert paid == env.env.warehouse.state.delivered == 2
