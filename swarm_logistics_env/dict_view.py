"""The dicts that PettingZoo asks for, as a view of an environment's array methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pettingzoo import ParallelEnv

from swarm_logistics_env.errors import CommandError, suggest

if TYPE_CHECKING:
    from swarm_logistics_env.warehouse import Warehouse

Observations = dict[str, NDArray[np.float32]]
Infos = dict[str, dict[str, Any]]
ArrayStep = tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]
_NOTHING_TO_SAY: dict[str, Any] = {}


class DictView(ParallelEnv[str, NDArray[np.float32], NDArray[np.float32]]):  # type: ignore[misc]  # PettingZoo ships no types
    """`reset` and `step` of whoever has `reset_arrays` and `step_arrays`.

    So that what a wrapper does to the arrays holds for the dicts as well.
    """

    agents: list[str]
    warehouse: Warehouse

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first observations (N, D)."""
        raise NotImplementedError

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period; leaves in `agents` who goes on."""
        raise NotImplementedError

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, Infos]:
        """Begin an episode; see `reset_arrays`. Returns observations and infos by agent."""
        observations = self.reset_arrays(seed, options)
        agents = self.agents
        return {agent: observations[_row(agent)] for agent in agents}, self._infos(agents)

    def step(
        self, actions: Mapping[str, ArrayLike]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Take one control period; see `step_arrays`.

        Args:
            actions: one command (4,) for every agent in `agents`; those of possible agents who
                are not there are ignored, as trainers of fixed size send them.

        Raises:
            CommandError: no dict; an agent's command is missing, for an unknown agent, of the
                wrong shape or not finite.
        """
        agents = self.agents
        if not agents:
            return {}, {}, {}, {}, {}
        wanted = self.action_space(agents[0]).shape
        n_robots = self.warehouse.state.n_robots
        commands = _gathered(actions, agents, self.possible_agents, wanted)
        outcome: tuple[NDArray[Any], ...]
        if len(agents) == n_robots:
            outcome = self.step_arrays(commands)
        else:
            rows = [_row(agent) for agent in agents]
            placed = np.zeros((n_robots, *wanted))
            placed[rows] = commands
            outcome = tuple(part[rows] for part in self.step_arrays(placed))
        observations, rewards, terminations, truncations = outcome
        infos = self._infos(agents)
        if not self.agents:
            # Of a wrapper that has more to say.
            more = getattr(self, "episode_info", {})
            last = {"delivered": self.warehouse.state.delivered, **more}
            infos = {agent: {**info, **last} for agent, info in infos.items()}
        return (
            dict(zip(agents, observations, strict=True)),
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict(zip(agents, terminations.tolist(), strict=True)),
            dict(zip(agents, truncations.tolist(), strict=True)),
            infos,
        )

    def _infos(self, agents: Sequence[str]) -> Infos:
        # The robots are not told who failed; whoever trains or judges them is.
        modes = self.warehouse.state.failure_modes
        if not any(modes):
            return dict.fromkeys(agents, _NOTHING_TO_SAY)
        return {
            agent: {"failure_modes": modes[_row(agent)]} if modes[_row(agent)] else _NOTHING_TO_SAY
            for agent in agents
        }


def agent_names(rows: Sequence[int]) -> list[str]:
    """Return the names of the robots in these rows."""
    return [f"robot_{row}" for row in rows]


def _row(agent: str) -> int:
    return int(agent[6:])


def _gathered(
    actions: Mapping[str, ArrayLike],
    agents: Sequence[str],
    possible_agents: Sequence[str],
    wanted: tuple[int, ...],
) -> NDArray[np.float64]:
    if not isinstance(actions, Mapping):
        raise CommandError(
            f"actions of type {type(actions).__name__}: should be a dict of one command for every "
            "agent; step_arrays takes an array"
        )
    if actions.keys() != set(agents):
        for agent in actions:
            if agent not in possible_agents:
                raise CommandError(
                    f"a command for {agent!r}, who is not there{suggest(str(agent), agents)}"
                )
        for agent in agents:
            if agent not in actions:
                raise CommandError(f"no command for {agent!r}: should be one for every agent")
    wished = [actions[agent] for agent in agents]
    if all(type(command) is np.ndarray and command.shape == wanted for command in wished):
        # As nearly always; several times as fast as an array of arrays.
        given = np.concatenate(wished).reshape(len(wished), *wanted)
    else:
        given = _array_of(wished)
    if given.shape != (len(agents), *wanted):
        agent = next(agent for agent in agents if _shape(actions[agent]) != wanted)
        raise CommandError(
            f"command of {agent!r} of shape {_shape(actions[agent])}: should be {wanted}"
        )
    if given.dtype.kind not in "fiub":
        raise CommandError(f"commands should be numbers: real ones, not {given.dtype}")
    return given.astype(np.float64)


def _array_of(commands: Sequence[ArrayLike]) -> NDArray[Any]:
    try:
        return np.array(commands)
    except (TypeError, ValueError):
        return np.array([])


def _shape(command: ArrayLike) -> tuple[int, ...] | str:
    try:
        return np.shape(command)
    except ValueError:
        return "ragged"
