"""What a policy of a parallel environment is given and gives, and what P is called."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box, MultiDiscrete

from swarm_logistics_env.core.errors import PolicyError, StudyError
from swarm_logistics_env.study.tasks import SumOfInfos, SumOfRewards
from swarm_logistics_env.study.tasks.parallel_policies import (
    RandomActions,
    agent_actions,
    agents_by_row,
    in_words,
    observation_rows,
    performance_of,
)
from tests.study.tasks.lane import Lane


class Unlike(Lane):
    """Its robots observe and do unlike things."""

    def observation_space(self, agent: str) -> Any:
        return Box(0.0, 9.0, (2, 2) if agent == "robot_0" else (1,))

    def action_space(self, agent: str) -> Any:
        return MultiDiscrete([3, 3]) if agent == "robot_0" else super().action_space(agent)


def test_a_row_stands_for_an_agent_or_for_a_robot_that_is_not_there() -> None:
    env = Unlike(2)
    assert agents_by_row(env, 2, ()) == ["robot_0", "robot_1"]
    agents = agents_by_row(env, 4, (0, 2))
    assert agents == [None, "robot_0", None, "robot_1"]
    square = np.array([[1, 2], [3, 4]], np.float32)
    rows = observation_rows(env, agents, {"robot_0": square, "robot_1": np.array([5.0])})
    assert rows.dtype == np.float32
    assert rows.tolist() == [[0, 0, 0, 0], [1, 2, 3, 4], [0, 0, 0, 0], [5, 0, 0, 0]]
    assert observation_rows(env, agents, {}).shape == (4, 0)
    with pytest.raises(StudyError, match="the environment of 3 robots has 2 agents: should have a"):
        agents_by_row(env, 4, (2,))


def test_an_action_goes_to_the_agent_of_its_row_if_it_is_still_there() -> None:
    env = Unlike(2)
    env.agents = ["robot_0", "robot_1"]
    agents = [None, "robot_0", None, "robot_1"]
    actions = agent_actions(env, agents, [None, [1.0, 2.0], 9, np.float32(2.0)])
    assert actions["robot_0"].tolist() == [1, 2]
    assert actions["robot_0"].dtype == np.int64
    assert actions["robot_1"] == 2
    assert isinstance(actions["robot_1"], int)
    env.agents = ["robot_1"]
    assert agent_actions(env, agents, [None, "gone", 9, 0]) == {"robot_1": 0}
    with pytest.raises(PolicyError, match=r"^action 7 of robot 3: should be in Discrete\(3\)$"):
        agent_actions(env, agents, [0, 0, 0, 7])
    with pytest.raises(PolicyError, match=r"^5 actions for 4 robots$"):
        agent_actions(env, agents, [0] * 5)


def test_random_actions_follow_from_the_seed_and_the_row() -> None:
    drawn = []
    for seed, agents in ((3, ["robot_1", "robot_1"]), (3, [None, "robot_1"]), (4, ["robot_1"] * 2)):
        policy = RandomActions()
        policy.configure(Lane(2), agents)
        policy.reset(2, seed)
        drawn.append([*zip(*(policy.act(np.zeros((2, 2), np.float32)) for _ in range(30)))])
    assert drawn[0][0] != drawn[0][1]
    assert drawn[1] == [(None,) * 30, drawn[0][1]]
    assert drawn[2][1] != drawn[0][1]
    assert {*drawn[0][0]} == {0, 1, 2}


def documented(env: object, rewards: object, infos: object) -> float:
    """What was carried.

    By all.
    """
    return 1.0


def bare(env: object, rewards: object, infos: object) -> float:
    return 1.0


class Bare:
    __doc__ = None

    def __call__(self, *_: object) -> float:
        return 1.0

    def __repr__(self) -> str:
        return "Bare()"


@pytest.mark.parametrize(
    ("gain", "words"),
    [
        (SumOfRewards(), "the sum of the rewards"),
        (SumOfInfos("boxes"), "the sum of 'boxes' in the infos"),
        (documented, "What was carried"),
        (bare, f"the sum of {__name__}:bare over the steps"),
        (Bare(), "the sum of Bare() over the steps"),
    ],
)
def test_p_is_named_by_what_a_step_adds(gain: Any, words: str) -> None:
    assert in_words(gain, None) == words
    assert in_words(gain, (-5.0, 2.5)) == f"{words}, as a score between -5 (0) and 2.5 (1)"


def test_p_is_the_sum_of_the_steps_or_where_it_lies_between_the_references() -> None:
    assert performance_of([0.1] * 10, None) == 1.0
    assert performance_of([], None) == 0.0
    assert performance_of([-4.0, 1.0], (-5.0, 3.0)) == 0.25
    assert performance_of([-5.0], (-5.0, 3.0)) == 0.0
    assert performance_of([-5.0], (3.0, -5.0)) == 1.0  # less of it is better
    for gains, references, words in (
        ([1.0, -0.5], None, "^P: step 2 adds -0.5: should be 0 or more; the indicators are ratios"),
        ([np.inf], (0.0, 1.0), "^P: step 1 adds inf: should be 0 or more"),
        (
            [-6.0],
            (-5.0, 3.0),
            "^P: the score -6 is below the reference -5 that counts as 0: should",
        ),
    ):
        with pytest.raises(StudyError, match=words):
            performance_of(gains, references)


def test_nobody_adds_nothing() -> None:
    assert SumOfRewards(shared=True)(Lane(1), {}, {}) == 0.0
    assert SumOfInfos("boxes", shared=True)(Lane(1), {}, {"a": {}, "b": {"boxes": 3}}) == 3.0
