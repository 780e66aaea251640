"""Wrappers for any PettingZoo parallel environment: agents that stay, swarms that change, faults.

They know nothing of this package's world. Of the package they use `errors` (ValueErrors), `streams`
(numpy generators by key) and `records` (a frozen record): whoever copies this file replaces these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from gymnasium import Space
from gymnasium.spaces import Box
from gymnasium.wrappers.utils import create_zero_array
from pettingzoo import ParallelEnv
from pettingzoo.utils.wrappers import BaseParallelWrapper
from pydantic import NonNegativeFloat, PositiveFloat, PositiveInt

from swarm_logistics_env.core import streams
from swarm_logistics_env.core.errors import FaultError, SetupError
from swarm_logistics_env.core.records import Record

# An observation, an action or an info: PettingZoo leaves their types to each environment.
Value: TypeAlias = Any
ByAgent: TypeAlias = dict[str, Value]
Env: TypeAlias = ParallelEnv[str, Value, Value]


class PaddedAgents(BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo's is untyped
    """Keeps all possible agents until the end of every episode, as many trainers require.

    An agent that is not in this episode, or has left it, stays: it observes zeros (or what its
    space has nearest to them), its reward is 0, its action is ignored, and its infos say "active"
    0 instead of 1. In the last step those are active who took it, so that what they observe at the
    end is kept. All agents end together, when the environment has none left: truncated if any of
    the last ones was, else terminated.

    Args:
        env: any parallel environment.

    Example:
        >>> from pettingzoo.sisl import pursuit_v5
        >>> env = PaddedAgents(pursuit_v5.parallel_env())
        >>> observations, infos = env.reset(seed=0)
        >>> list(observations) == list(infos) == env.possible_agents
        True
    """

    def reset(
        self, seed: int | None = None, options: ByAgent | None = None
    ) -> tuple[ByAgent, ByAgent]:
        """Begin an episode; observations and infos of all possible agents."""
        observations, infos = self.env.reset(seed=seed, options=options)
        self.agents = list(self.possible_agents)
        return self._pad(self.env.agents, observations, infos)

    def step(self, actions: ByAgent) -> tuple[ByAgent, ...]:
        """Step with the actions of the agents that are there; all possible agents are answered."""
        present = list(self.env.agents)
        observations, rewards, _, truncations, infos = self.env.step(
            {agent: action for agent, action in actions.items() if agent in present}
        )
        is_over = not self.env.agents
        is_cut = is_over and any(truncations.values())
        active = present if is_over else self.env.agents
        observations, infos = self._pad(active, observations, infos)
        if is_over:
            self.agents = []
        return (
            observations,
            {agent: rewards.get(agent, 0.0) for agent in observations},
            dict.fromkeys(observations, is_over and not is_cut),
            dict.fromkeys(observations, is_cut),
            infos,
        )

    def _pad(
        self, active: Sequence[str], observations: ByAgent, infos: ByAgent
    ) -> tuple[ByAgent, ByAgent]:
        padded: ByAgent = {}
        padded_infos: ByAgent = {}
        for agent in self.possible_agents:
            is_active = agent in active
            padded_infos[agent] = {**infos.get(agent, {}), "active": int(is_active)}
            space = self.observation_space(agent)
            padded[agent] = observations[agent] if is_active else create_zero_array(space)
        return padded, padded_infos


class ChangingAgents(BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo's is untyped
    """Plays each episode with a number of agents that is drawn for it.

    `possible_agents` and the spaces are those of the largest environment. An episode without a seed
    follows from the one before.

    Args:
        make_env: number of agents -> parallel environment; called once for each number.
        sizes: the numbers of agents, all as likely; one that stands there twice is twice as likely.

    Raises:
        SetupError: there are no sizes, or an environment has an agent that the largest one lacks
            or whose spaces differ there.

    Example:
        >>> from pettingzoo.sisl import pursuit_v5
        >>> env = ChangingAgents(lambda n: pursuit_v5.parallel_env(n_pursuers=n), [2, 4])
        >>> observations, infos = env.reset(seed=0)
        >>> len(observations) in (2, 4), len(env.possible_agents)
        (True, 4)
    """

    def __init__(self, make_env: Callable[[int], Env], sizes: Sequence[int]) -> None:
        if not sizes:
            raise SetupError("sizes: should be one number of agents or more")
        self._sizes = list(sizes)
        self._envs = {size: make_env(size) for size in sorted(set(sizes))}
        largest = self._envs[max(sizes)]
        super().__init__(largest)
        # In episodes of every size; what else the wrapper has is that of the episode's environment.
        self.possible_agents = list(largest.possible_agents)
        self.observation_space = largest.observation_space
        self.action_space = largest.action_space
        self._next = int(np.random.default_rng().integers(2**31))
        spaces = _spaces(largest)
        for size, env in self._envs.items():
            for agent, pair in _spaces(env).items():
                if spaces.get(agent) != pair:
                    raise SetupError(
                        f"make_env({size}) has {agent}: should be, with the same spaces, among "
                        f"the agents of make_env({max(sizes)})"
                    )

    def reset(
        self, seed: int | None = None, options: ByAgent | None = None
    ) -> tuple[ByAgent, ByAgent]:
        """Begin an episode; the seed also decides how many agents it has."""
        seed = self._next if seed is None else seed
        self._next = seed + 1
        index = streams.generator(seed, "number of agents").integers(len(self._sizes))
        self.env = self._envs[self._sizes[int(index)]]
        observations, infos = self.env.reset(seed=seed, options=options)
        return observations, infos

    def close(self) -> None:
        """Close the environments of all sizes."""
        for env in self._envs.values():
            env.close()


def _spaces(env: Env) -> dict[str, tuple[Space[Value], Space[Value]]]:
    """Return what each agent observes and does, by its name."""
    return {a: (env.observation_space(a), env.action_space(a)) for a in env.possible_agents}


TIME_GRACE = 5e-7  # [s]; times are products of steps and periods, which need not be round numbers
REMOVED_MODE = "removed"
PARALLEL_FAILURE_MODES = {
    "silent": "its actions are replaced by the task's no-op",
    "frozen": "repeats the last action from before its failure, or its first one",
    "blind": "observes zeros",
    "noisy": "observes with Gaussian noise added, of the task's standard deviation",
    REMOVED_MODE: "is not there, from the start",
}


class RobotFault(Record):
    """Some robots that fail in one way.

    Args:
        mode: a key of `FAILURE_MODES`.
        robots: how many; which ones follows from the seed. The sets of one seed are nested.
        onset: when they fail [s].
        duration: for how long [s]; None: for good.
    """

    error_type = FaultError

    mode: str
    robots: PositiveInt
    onset: NonNegativeFloat = 0.0
    duration: PositiveFloat | None = None

    def active(self, time: float) -> bool:
        """Return whether the robots fail at a time [s]."""
        return self.onset - TIME_GRACE <= time < self.onset + (self.duration or np.inf) - TIME_GRACE


def failing_rows(seed: int, n_robots: int, n_failing: int) -> tuple[int, ...]:
    """Return which of `n_robots` robots fail; those of fewer failures are among them."""
    order = streams.generator(seed, "failing robots").permutation(n_robots)
    return tuple(sorted(int(row) for row in order[:n_failing]))


class FailingRobots(BaseParallelWrapper):  # type: ignore[misc]  # PettingZoo's is untyped
    """Lets robots fail: replaces their actions, or changes what they observe.

    Args:
        env: any parallel environment.
        faults: of any mode but "removed": an environment can only start without a robot.
        failures: for each mode what it needs: the no-op action of "silent", the standard deviation
            of "noisy" in the observations' own units, None for the others.
        period: length of a step [s].

    Attributes:
        true_observations: those of the environment itself, before any failure changed them.

    Raises:
        FaultError: a fault's mode is not among `failures`, or more robots fail than there are.
        SetupError: "noisy" meets observations that are no array of floats.

    Example:
        >>> from pettingzoo.sisl import pursuit_v5
        >>> faults = [RobotFault(mode="blind", robots=1)]
        >>> env = FailingRobots(pursuit_v5.parallel_env(), faults, {"blind": None})
        >>> observations, infos = env.reset(seed=0)
    """

    def __init__(
        self,
        env: Env,
        faults: Iterable[RobotFault],
        failures: Mapping[str, Value],
        period: float = 1.0,
    ) -> None:
        super().__init__(env)
        self._faults = tuple(faults)
        self._failures = failures
        self._period = period
        self._rows = {agent: row for row, agent in enumerate(env.possible_agents)}
        self._seed = -1
        for fault in self._faults:
            if fault.mode == REMOVED_MODE or fault.mode not in failures:
                modes = ", ".join(sorted(set(failures) - {REMOVED_MODE}))
                raise FaultError(f"fault mode {fault.mode!r}: should be one of {modes}")
            if fault.robots > len(self._rows):
                raise FaultError(f"{fault.robots} robots fail of {len(self._rows)}")

    def reset(
        self, seed: int | None = None, options: ByAgent | None = None
    ) -> tuple[ByAgent, ByAgent]:
        """Begin an episode; the seed also decides which robots fail. None: the next seed."""
        self._seed = self._seed + 1 if seed is None else seed
        self._steps = 0
        self._last: ByAgent = {}
        self._noise = {
            agent: streams.generator(self._seed, "noisy robot", row)
            for agent, row in self._rows.items()
        }
        self._failing = [
            (fault, failing_rows(self._seed, len(self._rows), fault.robots))
            for fault in self._faults
        ]
        observations, infos = self.env.reset(seed=seed, options=options)
        return self._faulty_observations(observations), infos

    def step(self, actions: ByAgent) -> tuple[ByAgent, ...]:
        """Step with the actions that failing robots execute; observations as they sense them."""
        executed = {agent: self._faulty_action(agent, action) for agent, action in actions.items()}
        observations, rewards, terminations, truncations, infos = self.env.step(executed)
        self._steps += 1
        return self._faulty_observations(observations), rewards, terminations, truncations, infos

    def _modes(self, agent: str) -> set[str]:
        time = self._steps * self._period
        row = self._rows[agent]
        return {fault.mode for fault, rows in self._failing if row in rows and fault.active(time)}

    def _faulty_action(self, agent: str, action: Value) -> Value:
        modes = self._modes(agent)
        if "silent" in modes:
            action = self._failures["silent"]
        elif "frozen" in modes:
            action = self._last.get(agent, action)
        self._last[agent] = action
        return action

    def _faulty_observations(self, observations: ByAgent) -> ByAgent:
        self.true_observations = observations
        return {
            agent: self._faulty_observation(agent, value) for agent, value in observations.items()
        }

    def _faulty_observation(self, agent: str, value: Value) -> Value:
        modes = self._modes(agent)
        if "blind" in modes:
            return create_zero_array(self.observation_space(agent))
        if "noisy" not in modes:
            return value
        space = self.observation_space(agent)
        if not (isinstance(space, Box) and np.issubdtype(space.dtype, np.floating)):
            raise SetupError(
                f"noisy: {agent} observes {space}: should be an array of floats; leave 'noisy' out "
                "of the task's failures"
            )
        noise = self._noise[agent].normal(0.0, self._failures["noisy"], space.shape)
        return (value + noise).astype(space.dtype)
