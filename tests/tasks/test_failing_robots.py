"""Robots of any parallel environment that fail."""

from __future__ import annotations

import importlib
import warnings
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, Tuple

from swarm_logistics_env.errors import FaultError, SetupError
from swarm_logistics_env.tasks import FailingRobots, RobotFault
from swarm_logistics_env.tasks.failing_robots import failing_rows
from tests.tasks.lane import FAILURES, STAY, WALK, Lane


class Spy(Lane):
    """Remembers the actions that reach it."""

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        self.seen = getattr(self, "seen", [])
        self.seen.append(list(actions.values()))
        return super().step(actions)


def played(mode: str, seed: int = 3, **fields: Any) -> tuple[list[list[int]], list[Any], int]:
    """Play ten steps of distinct actions; return what was executed and observed, and who failed."""
    env = FailingRobots(Spy(3), [RobotFault(mode=mode, robots=1, **fields)], FAILURES)
    seen = [env.reset(seed=seed)[0]]
    seen += [env.step(dict.fromkeys(env.agents, step % 2))[0] for step in range(10)]
    (row,) = failing_rows(seed, 3, 1)
    return env.unwrapped.seen, seen, row


def test_faults_of_one_seed_are_nested_and_differ_between_seeds() -> None:
    sets = [set(failing_rows(5, 10, m)) for m in range(11)]
    assert all(a < b for a, b in pairwise(sets))
    assert len({failing_rows(seed, 10, 1) for seed in range(30)}) > 5


LATE: dict[str, Any] = {"onset": 2.0, "duration": 3.0}


@pytest.mark.parametrize(
    ("mode", "fields", "mine"),
    [
        ("silent", LATE, [0, 1, STAY, STAY, STAY, 1, 0, 1, 0, 1]),
        ("frozen", LATE, [0, WALK, WALK, WALK, WALK, 1, 0, 1, 0, 1]),
        ("frozen", {}, [0] * 10),
    ],
)
def test_silent_and_frozen_robots(mode: str, fields: dict[str, Any], mine: list[int]) -> None:
    executed, _, row = played(mode, **fields)
    assert [actions[row] for actions in executed] == mine
    assert [actions[row - 1] for actions in executed] == [step % 2 for step in range(10)]


def test_blind_and_noisy_robots() -> None:
    _, seen, row = played("blind", **LATE)
    me, other = f"robot_{row}", f"robot_{(row + 1) % 3}"
    assert [not seen[t][me].any() for t in range(11)] == [False] * 2 + [True] * 3 + [False] * 6
    (_, noisy, _), (_, again, _) = played("noisy"), played("noisy")
    for t in range(11):
        assert (noisy[t][other] == seen[t][other]).all()
        assert (noisy[t][me] == again[t][me]).all()
    assert noisy[0][me].dtype == np.float32
    assert 0.2 < np.std([noisy[t][me][1] for t in range(11)]) < 1.0
    env = FailingRobots(Lane(3), [RobotFault(mode="noisy", robots=3)], FAILURES)
    errors = {value[1] - 6 for value in env.reset(seed=3)[0].values()}
    assert len(errors) == 3, "each robot errs on its own"


class Nested(Lane):
    """Observes a structure."""

    def observation_space(self, agent: str) -> Any:
        return Tuple([Dict({"a": Box(0, 9, (2,))}), Discrete(9, start=1)])

    def _observations(self) -> dict[str, Any]:
        return {agent: ({"a": np.ones(2)}, 4) for agent in self.agents}


def test_structures_are_blinded_and_whole_numbers_bear_no_noise() -> None:
    blind, noisy = (
        FailingRobots(Nested(1), [RobotFault(mode=mode, robots=1)], FAILURES)
        for mode in ("blind", "noisy")
    )
    ((arrays, number),) = blind.reset(seed=0)[0].values()
    assert (arrays["a"].any(), number) == (False, 0)
    with pytest.raises(SetupError, match="observes int64: should be floats"):
        noisy.reset(seed=0)


def test_it_is_a_parallel_environment_and_seeds_are_counted() -> None:
    faults = [RobotFault(mode="silent", robots=2)]
    with warnings.catch_warnings():
        # PettingZoo's tests load environments of PettingZoo's in a way that it deprecates.
        warnings.simplefilter("ignore", DeprecationWarning)
        conformance = importlib.import_module("pettingzoo.test")
    conformance.parallel_api_test(FailingRobots(Lane(3), faults, FAILURES), num_cycles=20)
    one, two = (FailingRobots(Lane(3), faults, FAILURES) for _ in range(2))
    one.reset(seed=0)
    two.reset(seed=1)
    one.reset()
    assert one._failing == two._failing


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"mode": "removed"}, "should be one of blind, frozen, noisy, silent"),
        ({"mode": "lost"}, "fault mode 'lost'"),
        ({"mode": "blind", "robots": 4}, "4 robots fail of 3"),
        ({"mode": "blind", "robots": 0}, "RobotFault.robots = 0"),
        ({"mode": "blind", "onset": -1.0}, "RobotFault.onset = -1.0"),
    ],
)
def test_faults_that_cannot_be(fault: dict[str, Any], words: str) -> None:
    with pytest.raises(FaultError, match=words):
        FailingRobots(Lane(3), [RobotFault(**{"robots": 1, **fault})], FAILURES)
