"""Robots as rows of Gymnasium's VectorEnv: padding, ends and first observations in each mode."""

from __future__ import annotations

import doctest
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import (
    NormalizeObservation,
    RecordEpisodeStatistics,
    RecordVideo,
)

from swarm_logistics_env.adapters import CentralEnv, SwarmRows, vector_env
from swarm_logistics_env.core.errors import CommandError, SetupError
from swarm_logistics_env.world.observations import N_COLUMNS
from swarm_logistics_env.world.warehouse import Fault
from swarm_logistics_env.wrappers import DiscreteActions, MotionFrame, Wrapper
from tests.wrappers.conftest import BRIEF, brief, wrapped

N_STEPS = 20  # of an episode of a brief world


def rows(n_worlds: int = 2, **arguments: Any) -> SwarmRows:
    return SwarmRows(n_worlds, **{**BRIEF, "n_robots": 3, **arguments})


def test_gymnasium_makes_it_by_its_name() -> None:
    env = gymnasium.make_vec(
        "SwarmLogisticsRows-v0",
        2,
        vectorization_mode="vector_entry_point",
        n_robots=[2, 3],
        **BRIEF,
    )
    assert (env.num_envs, env.observation_space.shape, env.action_space.shape) == (
        5,
        (5, 141),
        (5, 4),
    )
    assert env.spec is not None
    assert env.spec.max_episode_steps == N_STEPS
    observations, infos = env.reset(seed=0)
    assert env.observation_space.contains(observations)
    assert infos["n_robots"].tolist() == [2, 2, 3, 3, 3]
    central = gymnasium.make("SwarmLogistics-v0", n_robots=2, max_cycles=7)
    assert isinstance(central.unwrapped, CentralEnv)
    assert central.spec is not None
    assert central.spec.max_episode_steps == 7


class Wider(Wrapper):
    """Says between which numbers observations lie: `bounds`."""

    def observation_space(self, agent: str) -> Box:
        low, high = self.bounds
        return Box(low, high, (N_COLUMNS,), np.float32)


def test_the_space_holds_the_observations_of_every_world() -> None:
    def make(world: int) -> Any:
        env = Wider(brief(n_robots=2))
        env.bounds = [(-1.0, 1.0), (-9.0, 8.0)][world]
        return env

    space = SwarmRows(2, make_env=make).single_observation_space
    assert isinstance(space, Box)
    assert (space.low.min(), space.low.max(), space.high.min()) == (-9.0, -9.0, 8.0)


def trace(mode: AutoresetMode, steps: int) -> list[list[Any]]:
    """Return what each world parts, first observations among them, whatever the mode."""
    env = SwarmRows(2, autoreset_mode=mode, make_env=wrapped)
    slices = [slice(0, 6), slice(6, 12)]
    rngs = [np.random.default_rng(world) for world in range(2)]
    observations, _ = env.reset(seed=0)
    parts: list[list[Any]] = [[observations[rows]] for rows in slices]
    waiting: set[int] = set()
    for _ in range(steps):
        actions = np.zeros((12, 4))
        for world in {0, 1} - waiting:
            actions[slices[world]] = rngs[world].uniform(-1, 1, (6, 4))
        observations, rewards, terminations, truncations, infos = env.step(actions)
        ended = terminations | truncations
        if mode is AutoresetMode.DISABLED and ended.any():
            first, _ = env.reset(options={"reset_mask": ended})
        else:
            first = observations
        for world, rows in enumerate(slices):
            last = observations[rows]
            if ended.any() and mode is AutoresetMode.SAME_STEP:
                pairs = zip(infos["final_obs"][rows], last)
                last = np.stack([row if final is None else final for final, row in pairs])
            if world in waiting:
                assert not ended[rows].any()
                assert not rewards[rows].any()
                parts[world].append(observations[rows])
                waiting.remove(world)
                continue
            parts[world].append((last, rewards[rows], terminations[rows], truncations[rows]))
            if ended[rows].all() and mode is AutoresetMode.NEXT_STEP:
                waiting.add(world)
            elif ended[rows].all():
                parts[world].append(first[rows])
    return parts


def test_all_modes_play_the_same_episodes() -> None:
    next_step = trace(AutoresetMode.NEXT_STEP, 3 * N_STEPS + 3)
    for mode in (AutoresetMode.SAME_STEP, AutoresetMode.DISABLED):
        for world, parts in enumerate(trace(mode, 3 * N_STEPS)):
            assert len(parts) == 1 + 3 * N_STEPS + 3
            np.testing.assert_equal(parts, next_step[world])


def test_rewards_and_ends_are_those_of_the_rows_of_stable_baselines3() -> None:
    sb3 = pytest.importorskip("swarm_logistics_env.adapters.sb3")
    env = SwarmRows(2, autoreset_mode="same_step", make_env=wrapped, threads=2)
    other = sb3.SwarmVecEnv(n_worlds=2, make_env=wrapped, seed=0)
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(env.reset(seed=0)[0], other.reset())
    for _ in range(2 * N_STEPS + 5):
        actions = rng.uniform(-1, 1, (12, 4))
        observations, rewards, terminations, truncations, infos = env.step(actions)
        sb3_rows, their_rewards, dones, their_infos = other.step(actions)
        np.testing.assert_array_equal(observations, sb3_rows)
        np.testing.assert_array_equal(rewards, their_rewards)
        np.testing.assert_array_equal(terminations | truncations, dones)
        np.testing.assert_array_equal(
            truncations, [info["TimeLimit.truncated"] for info in their_infos]
        )
        np.testing.assert_array_equal(env.present, other.present)
        if not dones.any():
            assert infos["padding"].tolist() == [info["padding"] for info in their_infos]


def test_a_robot_that_is_removed_ends_once_and_is_padding_until_its_world_ends() -> None:
    env = rows(1, faults=[Fault("removed", (1,), onset=0.5)])
    env.reset(seed=0)
    ends = []
    for step in range(N_STEPS):
        observations, _, terminations, truncations, infos = env.step(np.zeros((3, 4)))
        ends += [(step, row) for row in np.flatnonzero(terminations).tolist()]
        if infos["padding"][1]:
            assert not observations[1].any()
    assert ends == [(4, 1), (N_STEPS - 1, 1)]
    assert truncations.tolist() == [True, False, True]


def test_nothing_begins_by_itself_where_nobody_asks() -> None:
    env = rows(autoreset_mode="disabled")
    with pytest.raises(SetupError, match="step before reset"):
        env.step(np.zeros((6, 4)))
    env.reset(seed=0)
    going_on = np.array([True] + [False] * 5)
    with pytest.raises(SetupError, match="has robots of world 0, whose episode goes on"):
        env.reset(options={"reset_mask": going_on})
    for mask, message in ((going_on[1:], r"of shape \(5,\)"), ([True] * 6, "a boolean array")):
        with pytest.raises(SetupError, match=message):
            env.reset(options={"reset_mask": mask})
    for _ in range(N_STEPS):
        env.step(np.zeros((6, 4)))
    with pytest.raises(SetupError, match="the episode of world 0 is over: should begin anew by"):
        env.step(np.zeros((6, 4)))
    env.reset(options={"reset_mask": going_on})
    assert [bool(world.agents) for world in env.worlds] == [True, False]


def test_what_cannot_be_is_refused() -> None:
    with pytest.raises(SetupError, match="autoreset_mode = 'often': should be one of NEXT_STEP"):
        rows(autoreset_mode="often")
    with pytest.raises(SetupError, match="make_env and conditions: should be one or the other"):
        rows(make_env=lambda world: brief())
    env = rows()
    with pytest.raises(SetupError, match="seed = -1"):
        env.reset(seed=-1)
    env.reset(seed=0)
    with pytest.raises(CommandError, match="should be finite"):
        env.step(np.full((6, 4), np.nan))


def test_gymnasiums_wrappers_go_around_it() -> None:
    def make_env(world: int) -> DiscreteActions:
        return DiscreteActions(MotionFrame(brief(n_robots=2 + world)))

    env = RecordEpisodeStatistics(NormalizeObservation(SwarmRows(2, make_env=make_env)))
    observations, infos = env.reset(seed=0)
    assert infos["action_mask"].shape == (5, 11)
    for _ in range(N_STEPS):
        env.action_space.seed(0)
        observations, _, _, truncations, infos = env.step(env.action_space.sample())
    assert observations.shape == (5, 95)
    assert truncations.all()
    assert infos["episode"]["l"].tolist() == [N_STEPS] * 5


def test_each_row_has_the_picture_of_its_world(tmp_path: Path) -> None:
    pytest.importorskip("pygame")
    env = rows(render_mode="rgb_array")
    recorder = RecordVideo(env, str(tmp_path / "films"), episode_trigger=lambda episode: True)
    recorder.reset(seed=0)  # it takes its first pictures
    recorder.recorded_frames.clear()  # or it would write them as a film
    pictures = env.render()
    assert len(pictures) == env.num_envs == 6
    for row, world in enumerate((0, 0, 0, 1, 1, 1)):
        np.testing.assert_array_equal(pictures[row], env.worlds[world].render())
    env.close()


def test_the_example_of_its_docstring_runs() -> None:
    assert doctest.testmod(vector_env).failed == 0
