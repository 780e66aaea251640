"""Gymnasium environments of many agents, whose spaces are tuples, as PettingZoo environments."""

from __future__ import annotations

from typing import ClassVar

import gymnasium

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.study.tasks.parallel_wrappers import Env, Value


class TupleEnv(Env):  # type: ignore[misc]  # PettingZoo's is untyped
    """The parallel form of a Gymnasium environment with a tuple entry for each agent.

    All agents are there from the first step to the last. A reward that is one number is given to
    each of them; so is an info that is not told by agent.

    Args:
        env: e.g. of RWARE, or of VMAS with `terminated_truncated=True`.

    Raises:
        SetupError: its spaces are no tuples.
    """

    metadata: ClassVar[dict[str, Value]] = {"name": "tuple_env", "is_parallelizable": True}

    def __init__(self, env: gymnasium.Env[Value, Value]) -> None:
        parts: list[tuple[Value, ...]] = []
        for space in (env.observation_space, env.action_space):
            if not isinstance(space, gymnasium.spaces.Tuple):
                raise SetupError(f"{env}: space {space} should be a Tuple, one part an agent")
            parts.append(space.spaces)
        self.env = env
        self.render_mode = env.render_mode
        self.possible_agents = [f"agent_{number}" for number in range(len(parts[0]))]
        self.observation_spaces, self.action_spaces = (
            dict(zip(self.possible_agents, part)) for part in parts
        )
        self.agents: list[str] = []

    @property
    def unwrapped(self) -> Value:
        """The environment below all wrappers."""
        return self.env.unwrapped

    def observation_space(self, agent: str) -> Value:
        """Return the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Value:
        """Return the space of an agent's actions."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Value] | None = None
    ) -> tuple[dict[str, Value], dict[str, dict[str, Value]]]:
        """Begin an episode."""
        observations, info = self.env.reset(seed=seed, options=options)
        self.agents = self.possible_agents[:]
        return dict(zip(self.agents, observations)), self._infos(info)

    def step(
        self, actions: dict[str, Value]
    ) -> tuple[
        dict[str, Value],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Value]],
    ]:
        """Step all agents."""
        agents = self.agents
        rewards: Value
        observations, rewards, terminated, truncated, info = self.env.step(
            tuple(actions[agent] for agent in agents)
        )
        rewards_by_agent = [rewards] * len(agents) if isinstance(rewards, int | float) else rewards
        infos = self._infos(info)
        if terminated or truncated:
            self.agents = []
        return (
            dict(zip(agents, observations)),
            {agent: float(reward) for agent, reward in zip(agents, rewards_by_agent)},
            {agent: bool(terminated) for agent in agents},
            {agent: bool(truncated) for agent in agents},
            infos,
        )

    def _infos(self, info: dict[str, Value]) -> dict[str, Value]:
        by_agent = set(info) == set(self.agents)
        return {agent: info[agent] if by_agent else info for agent in self.agents}

    def close(self) -> None:
        """Close it."""
        self.env.close()
