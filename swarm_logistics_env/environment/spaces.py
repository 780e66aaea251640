"""What learners see of an environment: its spaces, wide enough for every scenario that it may
play, the whole warehouse as one vector, and PettingZoo's dicts over the array methods.
"""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
from gymnasium.spaces import Box, Space
from numpy.typing import ArrayLike, NDArray
from pettingzoo import ParallelEnv

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.observations import bounds
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import Warehouse
from swarm_logistics_env.warehouse.state import CARRIED, NOBODY, STORED

from .requests import gather_commands

ROBOT_FEATURES = (
    "present", "x", "y", "cos_heading", "sin_heading", "velocity_x", "velocity_y",
    "carrying", "carrying_requested", "timer", "to_delivery",
)  # fmt: skip
ITEM_COLUMNS = ("stored", "carried", "x", "y", "requested")


def global_state(world: Warehouse, n_robots: int, n_items: int) -> NDArray[np.float32]:
    """Return the state of `world` as one float32 vector.

    First `ROBOT_FEATURES` for each of `n_robots` rows, then `ITEM_COLUMNS` for each of `n_items`
    rows, then the time. Positions [m] and velocities [m/s] in the warehouse's frame, timers [s]
    (the limit when silent), the way to the nearest dock [m], 0 inside, and time [s]; rows of what
    is absent or delivered are zeros.
    """
    state = world.state
    robots = np.zeros((n_robots, len(ROBOT_FEATURES)), np.float32)
    robot_rows = robots[: state.n_robots]
    robot_rows[:, 0] = 1.0
    robot_rows[:, 1:3] = state.robot_position
    robot_rows[:, 3] = np.cos(state.robot_heading)
    robot_rows[:, 4] = np.sin(state.robot_heading)
    limit = world.scenario.max_speed
    robot_rows[:, 5:7] = np.clip(state.robot_velocity, -limit, limit)
    robot_rows[:, 7] = state.robot_item != NOBODY
    robot_rows[:, 8] = robot_rows[:, 7] * state.carries_requested
    robot_rows[:, 9] = np.nan_to_num(state.robot_timer, nan=world.scenario.timer_limit)
    floor = world.floor
    robot_rows[:, 10] = np.maximum(floor.edge - floor.along(state.robot_position), 0.0)
    robot_rows[~state.robot_present] = 0.0
    items = np.zeros((n_items, len(ITEM_COLUMNS)), np.float32)
    item_rows = items[: len(state.item_status)]
    item_rows[:, 0] = state.item_status == STORED
    item_rows[:, 1] = state.item_status == CARRIED
    item_rows[:, 2:4] = state.item_position * (item_rows[:, :1] + item_rows[:, 1:2])
    item_rows[:, 4] = state.item_requested
    width, height = world.scenario.warehouse_width, world.scenario.warehouse_height
    for positions in (robot_rows[:, 1:3], item_rows[:, 2:4]):
        np.clip(positions, 0.0, (width, height), out=positions)
    return np.concatenate([robots.ravel(), items.ravel(), [np.float32(state.time)]])


# These fields bound the state: an episode may have at most the largest value declared.
_BOUND_THE_STATE = (
    "n_items", "warehouse_width", "warehouse_height", "max_speed", "timer_limit", "duration",
    "longest_way",
)  # fmt: skip


class Spaces:
    """The spaces of observations, commands and states in all declared scenarios.

    Args:
        scenario: the environment's own scenario.

    Attributes:
        observation: the space of an observation row (D,).
        action: the space of a command (4 + message_size,).
        declared: the scenarios that episodes may be played in.
        most: the largest value in a declared scenario of each field that bounds the state.
    """

    def __init__(self, scenario: Scenario) -> None:
        low, high = bounds(scenario)
        self.observation = Box(low, high, dtype=np.float32)
        self.action = Box(-1.0, 1.0, (4 + scenario.message_size,), dtype=np.float32)
        self._own = scenario
        self.declared = {scenario}
        self.most = {name: getattr(scenario, name) for name in _BOUND_THE_STATE}

    def widen(self, scenario: Scenario) -> None:
        """Widen the spaces for `scenario`.

        Raises:
            SetupError: its rows or commands have another length than the environment's own.
        """
        low, high = bounds(scenario)
        if low.shape != self.observation.shape:
            raise SetupError(
                f"message_size = {scenario.message_size}: should be the environment's own, "
                f"{self._own.message_size}, which its spaces are made for"
            )
        low = np.minimum(low, self.observation.low)
        high = np.maximum(high, self.observation.high)
        self.observation = Box(low, high, dtype=np.float32)
        for name, most in self.most.items():
            self.most[name] = max(most, getattr(scenario, name))
        self.declared.add(scenario)

    def state(self, n_robots: int) -> Box:
        """Return the space of the state with rows for `n_robots` and the most items."""
        n_items, width, height, speed, limit, duration, way = self.most.values()
        robot_low = [0, 0, 0, -1, -1, -speed, -speed, 0, 0, 0, 0]
        robot_high = [1, width, height, 1, 1, speed, speed, 1, 1, limit, way]
        low = [*(robot_low * n_robots), *([0] * len(ITEM_COLUMNS) * n_items), 0]
        high = [*(robot_high * n_robots), *([1, 1, width, height, 1] * n_items), duration + 1.0]
        return Box(np.array(low, np.float32), np.array(high, np.float32))

    def check(self, scenario: Scenario, n_possible: int) -> None:
        """Check that an episode in `scenario` stays within the spaces.

        Args:
            scenario: that of the episode.
            n_possible: how many possible agents there are.

        Raises:
            SetupError: it has more robots than that, or observations or states could leave their
                spaces.
        """
        if scenario.n_robots > n_possible:
            raise SetupError(
                f"n_robots = {scenario.n_robots}: should be at most {n_possible}, as spaces and "
                f"possible_agents never change; make the environment with "
                f"max_robots={scenario.n_robots} or wrap it in SwarmSize"
            )
        if scenario in self.declared:
            return
        is_seen_within = all(map(self.observation.contains, bounds(scenario)))
        is_state_within = all(getattr(scenario, name) <= most for name, most in self.most.items())
        if is_seen_within and is_state_within:
            return
        changed = [
            f"{name} = {value}"
            for name, value in scenario.model_dump().items()
            if value != getattr(self._own, name)
        ]
        raise SetupError(
            f"{', '.join(changed)}: observations or states could leave their spaces; should be "
            "within what the environment was built for, or declared by env.declare_spaces(scenario)"
        )


Observations = dict[str, NDArray[np.float32]]
InfosByRobot = dict[str, dict[str, Any]]
ArrayStep = tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]


class DictView(ParallelEnv[str, NDArray[np.float32], NDArray[np.float32]]):  # type: ignore[misc]  # PettingZoo ships no types
    """`reset` and `step` for classes that have `reset_arrays` and `step_arrays`.

    So a wrapper that changes the arrays changes the dicts, too.
    """

    agents: list[str]
    warehouse: Warehouse
    is_begun: bool

    def _repr_html_(self) -> str:
        rows, actions = (form("robot_0") for form in (self.observation_space, self.action_space))
        spaces = f"{len(self.possible_agents)} robots; observations {rows.shape}, actions {actions}"
        return f"<b>{html.escape(repr(self))}</b><br>{html.escape(spaces)}"

    def reset_arrays(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> NDArray[np.float32]:
        """Begin an episode and return the first observations (N, D)."""
        raise NotImplementedError

    def step_arrays(self, commands: ArrayLike) -> ArrayStep:
        """Take one control period; afterwards `agents` are those that go on."""
        raise NotImplementedError

    @property
    def episode_info(self) -> dict[str, float]:
        """The entries of every agent's infos that are about the episode; keys never change."""
        raise NotImplementedError

    @property
    def robot_info(self) -> Mapping[str, NDArray[Any]]:
        """The entries of agents' infos that differ by robot: name -> (N, ...), a row for each."""
        return {}

    @property
    def n_rows(self) -> int:
        """The number of rows of the arrays in this episode: its robots, also absent ones."""
        return self.warehouse.state.n_robots

    @property
    def observation_spaces(self) -> dict[str, Box]:
        """The observation space of every possible agent."""
        return {agent: self.observation_space(agent) for agent in self.possible_agents}

    @property
    def action_spaces(self) -> dict[str, Space[Any]]:
        """The action space of every possible agent."""
        return {agent: self.action_space(agent) for agent in self.possible_agents}

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, InfosByRobot]:
        """Begin an episode; see `reset_arrays`. Returns observations and infos by agent.

        Each agent has a dict of infos of its own. It contains numbers, with the same keys at
        every step: "failed" is 1 while any failure mode holds for the robot, else 0; "delivered"
        is the number of items that the whole swarm has delivered; wrappers add `episode_info`, and
        arrays of `robot_info`.
        """
        observations = self.reset_arrays(seed, options)
        agents = self.agents
        return {agent: observations[_row(agent)] for agent in agents}, self._infos(agents)

    def step(
        self, actions: Mapping[str, ArrayLike]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], InfosByRobot]:
        """Take one control period; see `step_arrays`.

        Args:
            actions: one command (4,) for every agent in `agents`. Commands for possible agents
                that are not present are ignored, because trainers of fixed size send them.

        Returns:
            Observations, rewards, terminations, truncations and infos (see `reset`) of the agents
            that were present.

        Raises:
            CommandError: `actions` is not a dict, or a command is missing, belongs to an unknown
                agent, cannot be read, has the wrong shape or is not finite.
            SetupError: there was no reset, or the episode is over.
        """
        agents = self.agents
        if not agents:
            self.refuse_to_step()
        shape = self.action_space(agents[0]).shape
        commands = gather_commands(actions, agents, self.possible_agents, shape)
        outcome: tuple[NDArray[Any], ...]
        if len(agents) == self.n_rows:
            outcome = self.step_arrays(commands)
        else:
            rows = [_row(agent) for agent in agents]
            padded = np.zeros((self.n_rows, *shape))
            padded[rows] = commands
            outcome = tuple(part[rows] for part in self.step_arrays(padded))
        observations, rewards, terminations, truncations = outcome
        return (
            dict(zip(agents, observations, strict=True)),
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict(zip(agents, terminations.tolist(), strict=True)),
            dict(zip(agents, truncations.tolist(), strict=True)),
            self._infos(agents),
        )

    def refuse_to_step(self) -> NoReturn:
        """Raise the SetupError that says why nobody can take a step."""
        when = "after the end of the episode" if self.is_begun else "before reset"
        raise SetupError(f"step {when}: call reset(seed) first")

    def _infos(self, agents: list[str]) -> InfosByRobot:
        # Robots do not sense who failed; infos are for those who train or evaluate them.
        sound = {"failed": 0, **self.episode_info}
        infos = {agent: sound.copy() for agent in agents}
        for agent in agent_names(np.flatnonzero(self.warehouse.state.failed).tolist()):
            if agent in infos:
                infos[agent]["failed"] = 1
        for name, rows in self.robot_info.items():
            for agent in agents:
                infos[agent][name] = rows[_row(agent)]
        return infos


def agent_names(rows: Sequence[int]) -> list[str]:
    """Return the names of the robots in these rows."""
    return [f"robot_{row}" for row in rows]


def _row(agent: str) -> int:
    return int(agent[6:])
