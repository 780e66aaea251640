"""What a policy of a parallel environment is given and gives, and the policies for any of them."""

from __future__ import annotations

import copy
from collections.abc import Container, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from swarm_logistics_env import streams
from swarm_logistics_env.errors import PolicyError, StudyError

# An observation, an action or an info: PettingZoo leaves their types to each environment.
Value: TypeAlias = Any
Env: TypeAlias = ParallelEnv[str, Value, Value]


class RandomActions:
    """Draws each robot's action from its action space; robots do not share a stream."""

    def configure(self, env: Env, agents: Sequence[str | None]) -> None:
        """Learn the action spaces; `agents` has a name for each row, None where none is there."""
        self._spaces = [
            None if agent is None else copy.deepcopy(env.action_space(agent)) for agent in agents
        ]

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode of `n_robots` rows."""
        for row, space in enumerate(self._spaces):
            if space is not None:
                space.seed(streams.key(seed, "random action", row) & 0x7FFFFFFF)

    def act(self, observations: NDArray[np.float32]) -> list[Value]:
        """Return an action for each row."""
        return [None if space is None else space.sample() for space in self._spaces]


def agents_by_row(env: Env, n_robots: int, absent: Container[int]) -> list[str | None]:
    """Return the name of the agent that each row is, None where the robot is absent.

    Raises:
        StudyError: the environment has another number of agents.
    """
    present = [row for row in range(n_robots) if row not in absent]
    names = list(env.possible_agents)
    if len(names) != len(present):
        raise StudyError(
            f"the environment of {len(present)} robots has {len(names)} agents: should have as "
            "many, see the task's `size`"
        )
    agents: list[str | None] = [None] * n_robots
    for row, name in zip(present, names):
        agents[row] = name
    return agents


def observation_rows(
    env: Env, agents: Sequence[str | None], observations: Mapping[str, Value]
) -> NDArray[np.float32]:
    """Return observations as rows (N, D), flattened; those of absent robots are zero.

    D is the longest of them, shorter ones end in zeros.
    """
    flat = {
        agent: np.asarray(spaces.flatten(env.observation_space(agent), value), dtype=np.float32)
        for agent, value in observations.items()
    }
    width = max((len(row) for row in flat.values()), default=0)
    rows = np.zeros((len(agents), width), dtype=np.float32)
    for row, agent in enumerate(agents):
        if agent is not None and agent in flat:
            rows[row, : len(flat[agent])] = flat[agent]
    return rows


def agent_actions(
    env: Env, agents: Sequence[str | None], actions: Sequence[Value]
) -> dict[str, Value]:
    """Return the rows of actions by agent, each of its action space's type.

    Raises:
        PolicyError: an action is missing or lies outside its space.
    """
    if len(actions) != len(agents):
        raise PolicyError(f"{len(actions)} actions for {len(agents)} robots")
    present = set(env.agents)
    found: dict[str, Value] = {}
    for row, agent in enumerate(agents):
        if agent is None or agent not in present:
            continue
        space, action = env.action_space(agent), actions[row]
        if isinstance(space, spaces.Discrete):
            action = int(action)
        elif isinstance(space, spaces.Box | spaces.MultiDiscrete | spaces.MultiBinary):
            action = np.asarray(action, dtype=space.dtype)
        if not space.contains(action):
            raise PolicyError(f"action {action!r} of robot {row}: should be in {space}")
        found[agent] = action
    return found
