"""What a policy of a parallel environment is given and gives, and what its performance P is."""

from __future__ import annotations

import copy
import inspect
import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_logistics_env.core import streams
from swarm_logistics_env.core.errors import PolicyError, StudyError

from .parallel_wrappers import ByAgent, Env, Value


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


def agents_by_row(env: Env, n_robots: int, absent: Collection[int]) -> list[str | None]:
    """Return the name of the agent that each row is, None where the robot is absent.

    Raises:
        StudyError: the environment has another number of agents.
    """
    present = n_robots - len(absent)
    agents = env.possible_agents
    if len(agents) != present:
        raise StudyError(
            f"the environment of {present} robots has {len(agents)} agents: should have as "
            "many, see the task's `size`"
        )
    names = iter(agents)
    return [None if row in absent else next(names) for row in range(n_robots)]


def observation_rows(
    env: Env, agents: Sequence[str | None], observations: ByAgent
) -> NDArray[np.float32]:
    """Return observations as rows (N, D), flattened; those of absent robots are zero.

    D is the longest of them, shorter ones end in zeros.
    """
    flat = {
        agent: np.asarray(spaces.flatten(env.observation_space(agent), value), dtype=np.float32)
        for agent, value in observations.items()
    }
    width = max(map(len, flat.values()), default=0)
    rows = np.zeros((len(agents), width), dtype=np.float32)
    for row, agent in enumerate(agents):
        if agent in flat:
            rows[row, : len(flat[agent])] = flat[agent]
    return rows


def agent_actions(env: Env, agents: Sequence[str | None], actions: Sequence[Value]) -> ByAgent:
    """Return the rows of actions by agent, each of its action space's type.

    Raises:
        PolicyError: an action is missing or lies outside its space.
    """
    if len(actions) != len(agents):
        raise PolicyError(f"{len(actions)} actions for {len(agents)} robots")
    by_agent: ByAgent = {}
    for row, (agent, action) in enumerate(zip(agents, actions)):
        if agent is None or agent not in env.agents:
            continue
        space = env.action_space(agent)
        if isinstance(space, spaces.Discrete):
            action = int(action)
        elif isinstance(space, spaces.Box | spaces.MultiDiscrete | spaces.MultiBinary):
            action = np.asarray(action, dtype=space.dtype)
        if not space.contains(action):
            raise PolicyError(f"action {action!r} of robot {row}: should be in {space}")
        by_agent[agent] = action
    return by_agent


# What one step adds to P: of the environment after the step, its rewards and its infos.
Gain = Callable[[Env, ByAgent, ByAgent], float]

REMEDY = (
    "the indicators are ratios, so P needs a true zero: give another measure (performance=a "
    "function of env, rewards and infos, e.g. a count of what was done), or normalise the scores "
    "by two declared references (references=(score that counts as 0, score that counts as 1))"
)


@dataclass(frozen=True)
class SumOfRewards:
    """The sum of all rewards.

    Args:
        shared: whether each agent is given the reward of the whole team, so that it counts once.
    """

    shared: bool = False

    def __call__(self, env: Env, rewards: ByAgent, infos: ByAgent) -> float:
        """Return what one step adds."""
        return _total(rewards.values(), self.shared)


@dataclass(frozen=True)
class SumOfInfos:
    """The sum of one key of the agents' infos; an agent without it adds nothing.

    Args:
        key: e.g. "deliveries", of what an agent did in this step.
        shared: whether each agent is told the number of the whole team, so that it counts once.
    """

    key: str
    shared: bool = False

    def __call__(self, env: Env, rewards: ByAgent, infos: ByAgent) -> float:
        """Return what one step adds."""
        return _total((info[self.key] for info in infos.values() if self.key in info), self.shared)


def in_words(gain: Gain, references: tuple[float, float] | None) -> str:
    """Return what P is, for a report."""
    if isinstance(gain, SumOfRewards):
        words = "the sum of the rewards"
    elif isinstance(gain, SumOfInfos):
        words = f"the sum of {gain.key!r} in the infos"
    else:
        document = inspect.getdoc(gain) or f"the sum of {name_of(gain)} over the steps"
        words = document.splitlines()[0].rstrip(".")
    if references is not None:
        words += f", as a score between {references[0]:g} (0) and {references[1]:g} (1)"
    return words


def name_of(function: Callable[..., Value]) -> str:
    """Return the import path of a function, or how it writes itself."""
    if hasattr(function, "__qualname__"):
        return f"{function.__module__}:{function.__qualname__}"
    return repr(function)


def performance_of(gains: list[float], references: tuple[float, float] | None) -> float:
    """Return P of a run from what its steps gave.

    Raises:
        StudyError: P is no number of 0 or more, or without references a step takes from it.
    """
    for step, gain in enumerate(gains, start=1):
        if not math.isfinite(gain) or (gain < 0 and references is None):
            raise StudyError(f"P: step {step} adds {gain:g}: should be 0 or more; {REMEDY}")
    total = math.fsum(gains)
    if references is None:
        return total
    low, high = references
    score = (total - low) / (high - low)
    if score < 0:
        raise StudyError(
            f"P: the score {total:g} is below the reference {low:g} that counts as 0: should be "
            "a reference that no run falls below"
        )
    return score


def _total(values: Iterable[Value], shared: bool) -> float:
    numbers = [float(value) for value in values]
    total = math.fsum(numbers)
    return total / max(len(numbers), 1) if shared else total
