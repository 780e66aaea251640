"""What learners see of an environment: its spaces, the whole warehouse as one vector, and dicts.

Spaces are wide enough for every scenario that it may play; the dicts are PettingZoo's, over the
array methods.
"""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, NoReturn

import numpy as np
from gymnasium.spaces import Box, Space
from numpy.typing import ArrayLike, NDArray
from pettingzoo import ParallelEnv

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.world.observations import bounds
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Warehouse
from swarm_logistics_env.world.warehouse.state import CARRIED, NOBODY, STORED

from .requests import gather_commands


class Feature(NamedTuple):
    """A column of the rows of the state that are about robots, or of those about items.

    Attributes:
        values: returns a number for each robot (N,), or for each item (M,).
        most: field of the scenario that is the largest value; None: that is 1.
        is_signed: whether the lowest value is the largest with a minus; else it is 0.
    """

    values: Callable[[Warehouse], NDArray[Any]]
    most: str | None = None
    is_signed: bool = False


def _robot_place(world: Warehouse, axis: int, most: float) -> NDArray[np.float64]:
    return np.clip(world.state.robot_position[:, axis], 0.0, most)


def _robot_velocity(world: Warehouse, axis: int) -> NDArray[np.float64]:
    limit = world.scenario.highest_speed
    return np.clip(world.state.robot_velocity[:, axis], -limit, limit)


def _item_place(world: Warehouse, axis: int, most: float) -> NDArray[np.float64]:
    is_there = np.isin(world.state.item_status, (STORED, CARRIED))
    return np.clip(world.state.item_position[:, axis] * is_there, 0.0, most)


def _carries_requested(world: Warehouse) -> NDArray[np.bool_]:
    carries = world.state.robot_item != NOBODY
    return np.asarray(carries & world.state.carries_requested)


def _timer(world: Warehouse) -> NDArray[np.float64]:
    return np.nan_to_num(world.state.robot_timer, nan=world.scenario.timer_limit)


def _way_to_delivery(world: Warehouse) -> NDArray[np.float64]:
    floor = world.floor
    return np.maximum(floor.edge - floor.along(world.state.robot_position), 0.0)


ROBOT_FEATURES = {
    "present": Feature(lambda world: world.state.robot_present),
    "x": Feature(
        lambda world: _robot_place(world, 0, world.scenario.warehouse_width), "warehouse_width"
    ),
    "y": Feature(
        lambda world: _robot_place(world, 1, world.scenario.warehouse_height), "warehouse_height"
    ),
    "cos_heading": Feature(lambda world: np.cos(world.state.robot_heading), is_signed=True),
    "sin_heading": Feature(lambda world: np.sin(world.state.robot_heading), is_signed=True),
    "velocity_x": Feature(lambda world: _robot_velocity(world, 0), "highest_speed", is_signed=True),
    "velocity_y": Feature(lambda world: _robot_velocity(world, 1), "highest_speed", is_signed=True),
    "carrying": Feature(lambda world: world.state.robot_item != NOBODY),
    "carrying_requested": Feature(_carries_requested),
    "timer": Feature(_timer, "timer_limit"),
    "to_delivery": Feature(_way_to_delivery, "longest_way"),
}
ITEM_COLUMNS = {
    "stored": Feature(lambda world: world.state.item_status == STORED),
    "carried": Feature(lambda world: world.state.item_status == CARRIED),
    "x": Feature(
        lambda world: _item_place(world, 0, world.scenario.warehouse_width), "warehouse_width"
    ),
    "y": Feature(
        lambda world: _item_place(world, 1, world.scenario.warehouse_height), "warehouse_height"
    ),
    "requested": Feature(lambda world: world.state.item_requested),
}


def global_state(world: Warehouse, n_robots: int, n_items: int) -> NDArray[np.float32]:
    """Return the state of `world` as one float32 vector.

    First `ROBOT_FEATURES` for each of `n_robots` rows, then `ITEM_COLUMNS` for each of `n_items`
    rows, then the time. Positions [m] and velocities [m/s] in the warehouse's frame, timers [s]
    (the limit when silent), the way to the nearest dock [m], 0 inside, and time [s]; rows of what
    is absent or delivered are zeros.
    """
    robots = _rows(ROBOT_FEATURES, world, n_robots)
    robots[np.flatnonzero(~world.state.robot_present)] = 0.0
    items = _rows(ITEM_COLUMNS, world, n_items)
    return np.concatenate([robots.ravel(), items.ravel(), [np.float32(world.state.time)]])


def _rows(features: Mapping[str, Feature], world: Warehouse, n_rows: int) -> NDArray[np.float32]:
    """Return a row for each robot or item, and rows of zeros behind them (n_rows, features)."""
    rows = np.zeros((n_rows, len(features)), np.float32)
    for column, feature in enumerate(features.values()):
        values = feature.values(world)
        rows[: len(values), column] = values
    return rows


# These fields bound the state: an episode may have at most the largest value declared.
_BOUND_THE_STATE = (
    "n_items", "warehouse_width", "warehouse_height", "highest_speed", "timer_limit", "duration",
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
        robot_low, robot_high = self._bounds(ROBOT_FEATURES)
        item_low, item_high = self._bounds(ITEM_COLUMNS)
        n_items = self.most["n_items"]
        low = [*(robot_low * n_robots), *(item_low * n_items), 0]
        high = [*(robot_high * n_robots), *(item_high * n_items), self.most["duration"] + 1.0]
        return Box(np.array(low, np.float32), np.array(high, np.float32))

    def _bounds(self, features: Mapping[str, Feature]) -> tuple[list[float], list[float]]:
        """Return the lowest and the highest values of a row with these features."""
        low = []
        high = []
        for feature in features.values():
            most = 1.0 if feature.most is None else self.most[feature.most]
            low.append(-most if feature.is_signed else 0.0)
            high.append(most)
        return low, high

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
            f"{name} = {getattr(scenario, name)}"
            for name in type(scenario).model_fields
            if getattr(scenario, name) != getattr(self._own, name)
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
        every step: "failed" is 1 while any failure mode holds for the robot, else 0; "away" is 1
        until a robot that left the arena is back, else 0; "delivered" is the number of items that
        the whole swarm has delivered; wrappers add `episode_info`, and arrays of `robot_info`.
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
        state = self.warehouse.state
        sound = {"failed": 0, "away": 0, **self.episode_info}
        infos = {agent: sound.copy() for agent in agents}
        for name, is_so in (("failed", state.failed), ("away", state.robot_away)):
            for agent in agent_names(np.flatnonzero(is_so).tolist()):
                if agent in infos:
                    infos[agent][name] = 1
        for name, rows in self.robot_info.items():
            for agent in agents:
                infos[agent][name] = rows[_row(agent)]
        return infos


def agent_names(rows: Sequence[int]) -> list[str]:
    """Return the names of the robots in these rows."""
    return [f"robot_{row}" for row in rows]


def _row(agent: str) -> int:
    return int(agent[6:])
