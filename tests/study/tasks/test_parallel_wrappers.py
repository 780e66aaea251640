"""Agents of any parallel environment that stay, change in number, or fail."""

from __future__ import annotations

import doctest
import importlib
import warnings
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, Tuple
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env.core.errors import FaultError, SetupError
from swarm_logistics_env.study.tasks import (
    ChangingAgents,
    FailingRobots,
    PaddedAgents,
    RobotFault,
    parallel_wrappers,
)
from swarm_logistics_env.study.tasks.parallel_wrappers import failing_rows
from tests.study.tasks.lane import FAILURES, STAY, WALK, Lane


class Spy(Lane):
    """Remembers the actions that reach it."""

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        self.actions = getattr(self, "actions", [])
        self.actions.append(list(actions.values()))
        return super().step(actions)


def play_ten_steps(
    mode: str, seed: int = 3, **fields: Any
) -> tuple[list[list[int]], list[Any], int]:
    """Play ten steps of distinct actions; return what was executed and observed, and who failed."""
    env = FailingRobots(Spy(3), [RobotFault(mode=mode, robots=1, **fields)], FAILURES)
    observations = [env.reset(seed=seed)[0]]
    observations += [env.step(dict.fromkeys(env.agents, step % 2))[0] for step in range(10)]
    (row,) = failing_rows(seed, 3, 1)
    return env.unwrapped.actions, observations, row


def test_faults_of_one_seed_are_nested_and_differ_between_seeds() -> None:
    sets = [set(failing_rows(5, 10, m)) for m in range(11)]
    assert list(failing_rows(5, 10, 7)) == sorted(sets[7])
    assert all(a < b for a, b in pairwise(sets))
    assert len({failing_rows(seed, 10, 1) for seed in range(30)}) > 5


LATE: dict[str, Any] = {"onset": 2.0, "duration": 3.0}


@pytest.mark.parametrize(
    ("mode", "fields", "expected"),
    [
        ("silent", LATE, [0, 1, STAY, STAY, STAY, 1, 0, 1, 0, 1]),
        ("frozen", LATE, [0, WALK, WALK, WALK, WALK, 1, 0, 1, 0, 1]),
        ("frozen", {}, [0] * 10),
    ],
)
def test_silent_and_frozen_robots(mode: str, fields: dict[str, Any], expected: list[int]) -> None:
    steps, _, row = play_ten_steps(mode, **fields)
    assert [actions[row] for actions in steps] == expected
    assert [actions[row - 1] for actions in steps] == [step % 2 for step in range(10)]


def test_blind_and_noisy_robots() -> None:
    _, blind, row = play_ten_steps("blind", **LATE)
    faulty, sound = f"robot_{row}", f"robot_{(row + 1) % 3}"
    assert [not rows[faulty].any() for rows in blind] == [False] * 2 + [True] * 3 + [False] * 6
    (_, noisy, _), (_, noisy_again, _) = play_ten_steps("noisy"), play_ten_steps("noisy")
    for t in range(11):
        assert (noisy[t][sound] == blind[t][sound]).all()
        assert (noisy[t][faulty] == noisy_again[t][faulty]).all()
    assert noisy[0][faulty].dtype == np.float32
    lengths = [noisy[t][faulty][1] for t in range(11)]
    assert np.mean(lengths) == pytest.approx(6.0, abs=0.6)
    assert 0.2 < np.std(lengths) < 1.0
    env = FailingRobots(Lane(3), [RobotFault(mode="noisy", robots=3)], FAILURES)
    errors = {value[1] - 6 for value in env.reset(seed=3)[0].values()}
    assert len(errors) == 3, "each robot errs on its own"


def test_without_a_seed_an_episode_has_the_next_one_the_first_seed_0() -> None:
    lane = Lane(9)
    lane.reset(seed=0)
    env = FailingRobots(lane, [RobotFault(mode="blind", robots=1)], FAILURES)
    for seed, expected in ((None, 0), (None, 1), (7, 7), (None, 8)):
        observations = env.reset(seed=seed)[0].values()
        blind = [row for row, observation in enumerate(observations) if not observation.any()]
        assert blind == [*failing_rows(expected, 9, 1)]


class Remembers(Lane):
    """Keeps the arguments of its last reset."""

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        self.arguments = seed, options
        return super().reset(seed, options)


@pytest.mark.parametrize(
    "make",
    [
        lambda: PaddedAgents(Remembers(2)),
        lambda: FailingRobots(Remembers(2), [], FAILURES),
        lambda: ChangingAgents(Remembers, [2]),
    ],
)
def test_seed_and_options_reach_the_environment(make: Callable[[], Any]) -> None:
    env = make()
    observations, infos = env.reset(seed=3, options={"goal": 1})
    assert env.unwrapped.arguments == (3, {"goal": 1})
    assert [*observations] == [*infos] == ["robot_0", "robot_1"]


class Nested(Lane):
    """Observes a structure."""

    def observation_space(self, agent: str) -> Any:
        return Tuple([Dict({"a": Box(0, 9, (2,))}), Discrete(9, start=1)])

    def _observations(self) -> dict[str, Any]:
        return {agent: ({"a": np.ones(2)}, 4) for agent in self.agents}


def test_structures_are_blinded_and_bear_no_noise() -> None:
    blind, noisy = (
        FailingRobots(Nested(1), [RobotFault(mode=mode, robots=1)], FAILURES)
        for mode in ("blind", "noisy")
    )
    ((arrays, number),) = blind.reset(seed=0)[0].values()
    assert (arrays["a"].any(), number) == (False, 1)  # a number from 1 to 9
    with pytest.raises(SetupError, match="should be an array of floats"):
        noisy.reset(seed=0)


def test_faults_that_cannot_be() -> None:
    with pytest.raises(FaultError, match=r"RobotFault\.onset = -1\.0"):
        RobotFault(mode="blind", robots=1, onset=-1.0)
    with pytest.raises(FaultError, match="should be one of blind, frozen, noisy, silent"):
        FailingRobots(Lane(3), [RobotFault(mode="removed", robots=1)], FAILURES)
    with pytest.raises(FaultError, match="4 robots fail of 3"):
        FailingRobots(Lane(3), [RobotFault(mode="blind", robots=4)], FAILURES)


# Environments that are not ours: continuous actions, numbers as actions, agents that die.
THEIRS: dict[str, tuple[str, dict[str, Any]]] = {
    "butterfly.pistonball_v6": ("n_pistons", {"max_cycles": 15}),
    "sisl.pursuit_v5": ("n_pursuers", {"max_cycles": 15}),
    "butterfly.knights_archers_zombies_v11": (
        # Vectors would grow with the number of knights.
        "num_knights", {"obs_method": "image", "spawn_delay": 1, "max_cycles": 20}
    ),
}  # fmt: skip


@pytest.fixture(params=THEIRS)
def make_theirs(request: pytest.FixtureRequest) -> Iterator[Any]:
    size, fields = THEIRS[request.param]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # theirs, and those of PettingZoo's test
        module: Any = pytest.importorskip(f"pettingzoo.{request.param}")
        yield lambda n: module.parallel_env(**fields, **{size: n})


@pytest.mark.daily
def test_each_passes_pettingzoos_test_on_environments_that_are_not_ours(make_theirs: Any) -> None:
    test = importlib.import_module("pettingzoo.test").parallel_api_test
    idle = make_theirs(3).action_space(make_theirs(3).possible_agents[0]).sample()
    faults = [RobotFault(mode=mode, robots=1, onset=3.0) for mode in ("silent", "blind")]
    failures = {"silent": idle, "blind": None}
    for env in (make_theirs(3), ChangingAgents(make_theirs, [2, 3])):
        test(PaddedAgents(FailingRobots(env, faults, failures)), num_cycles=100)
    test(FailingRobots(make_theirs(3), faults, failures), num_cycles=100)


class Leaving(Lane):
    """Its first robot leaves at the second step, the others' time is up at the fourth."""

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        self.steps = 0
        return super().reset(seed, options)

    def step(self, actions: dict[str, Any]) -> Any:
        acting, self.steps = list(self.agents), self.steps + 1
        assert list(actions) == acting
        rows, *_ = super().step({"robot_0": STAY, **actions})
        leaves = {agent: self.steps == 2 and agent == "robot_0" for agent in acting}
        time_is_up = dict.fromkeys(acting, self.steps == 4)
        self.agents = [agent for agent in acting if not (leaves[agent] or time_is_up[agent])]
        infos = {agent: {"steps": self.steps} for agent in acting}
        rewards = dict.fromkeys(acting, 1.0)
        return {a: rows[a] for a in acting}, rewards, leaves, time_is_up, infos


def test_agents_are_padded_and_masked_until_all_end_together() -> None:
    env = PaddedAgents(Leaving(3))
    agents = env.possible_agents
    _, infos = env.reset(seed=0)
    assert [infos[agent]["active"] for agent in agents] == [1, 1, 1]
    masks, reward_rows, ends = [], [], []
    while env.agents:
        rows, rewards, *ends_of_agents, infos = env.step(dict.fromkeys(agents, WALK))
        masks.append([infos[agent].pop("active") for agent in agents])
        assert [bool(rows[agent].any()) for agent in agents] == [bool(m) for m in masks[-1]]
        assert [(row.shape, row.dtype) for row in rows.values()] == [((2,), np.float32)] * 3
        reward_rows.append(list(rewards.values()))
        ends.append([set(by_agent.values()) for by_agent in ends_of_agents])
    assert masks == [[1, 1, 1], [0, 1, 1], [0, 1, 1], [0, 1, 1]]
    assert reward_rows == [[1, 1, 1], [1, 1, 1], [0, 1, 1], [0, 1, 1]]
    assert ends == [[{False}, {False}]] * 3 + [[{False}, {True}]]
    assert list(infos.values()) == [{}, {"steps": 4}, {"steps": 4}]


def test_the_number_of_agents_is_drawn_for_each_episode() -> None:
    env, same_env = (ChangingAgents(Lane, [2, 2, 5]) for _ in range(2))
    assert env.possible_agents == [f"robot_{row}" for row in range(5)]
    sizes = [len(env.reset(seed=seed)[0]) for seed in range(60)]
    assert set(sizes) == {2, 5}
    assert 30 < sizes.count(2) < 50
    same_env.reset(seed=59)
    for rows, same_rows in [(env.reset()[0], same_env.reset()[0]) for _ in range(5)]:
        assert {a: v.tolist() for a, v in rows.items()} == {
            a: v.tolist() for a, v in same_rows.items()
        }
    unseeded = [ChangingAgents(Remembers, [2]) for _ in range(9)]
    for changing in unseeded:
        changing.reset()
    assert len({changing.unwrapped.arguments[0] for changing in unseeded}) > 4
    last = unseeded[-1]
    for seed, expected in ((3, 3), (None, 4), (None, 5), (0, 0), (None, 1)):
        last.reset(seed=seed)
        assert last.unwrapped.arguments == (expected, None)
    with pytest.raises(SetupError, match="should be one number of agents or more"):
        ChangingAgents(Lane, [])
    with pytest.raises(SetupError, match=r"make_env\(1\) has robot_0: should be"):
        ChangingAgents(lambda n: Nested(n) if n == 1 else Lane(n), [1, 2])


def test_environments_of_all_numbers_of_agents_are_closed() -> None:
    closed_sizes = []

    class Closing(Lane):
        def close(self) -> None:
            closed_sizes.append(self.n_robots)

    ChangingAgents(Closing, [2, 5, 2]).close()
    assert closed_sizes == [2, 5]


def test_examples_run() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # theirs
        pytest.importorskip("pettingzoo.sisl.pursuit_v5")
        assert doctest.testmod(parallel_wrappers).failed == 0


@given(
    period=st.sampled_from([1.0, 0.1, 0.02, 1 / 30, 0.3]) | st.floats(0.005, 2.0),
    first=st.integers(0, 2000),
    steps=st.integers(1, 2000),
    is_rounded=st.booleans(),
)
def test_a_fault_holds_in_the_steps_that_its_times_are_of(
    period: float, first: int, steps: int, is_rounded: bool
) -> None:
    onset, duration = first * period, steps * period
    if is_rounded:  # as people type them
        onset, duration = round(onset, 9), round(duration, 9)
    fault = RobotFault(mode="silent", robots=1, onset=onset, duration=duration)
    around = {max(first - 1, 0), first, first + steps - 1, first + steps}
    assert {step for step in around if fault.active(step * period)} == {
        step for step in around if first <= step < first + steps
    }
    last = RobotFault(mode="silent", robots=1, onset=onset)
    assert [last.active(step * period) for step in sorted(around)] == [
        step >= first for step in sorted(around)
    ]
