"""A script whose robots are told where the requested item lies: a bound, as no robot senses it.

The place stands in a robot's row as an item in view, whatever the distance and with whatever walls
between. It is the true one, which no radio could tell as well: how much more a swarm delivers with
it is what information is worth to that script, and what central control has beyond it is skill.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveInt

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.homing_stock import HomingStock, HomingStockParameters
from swarm_logistics_env.policies.policy import Scripted
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.state import NOBODY, STORED, WarehouseState

Booleans = NDArray[np.bool_]


class ToldParameters(HomingStockParameters):
    """Those of `homing-stock`, and who is told.

    Args:
        hears: of the robots that carry nothing, "all", the "nearest", or those within some radio
            "hops" of a robot that has the item in view.
        count: how many are the nearest, or how many hops.
    """

    hears: Literal["all", "nearest", "hops"] = "all"
    count: PositiveInt = 3


class Told(Scripted):
    """Homing with a stock, told where the requested item lies; needs the state.

    Its keyword arguments are the fields of `ToldParameters`.

    Raises:
        PolicyError: a parameter is unknown or out of range.

    Example:
        >>> from swarm_logistics_env import run_episode
        >>> run_episode(Scenario(n_robots=5, duration=20.0), Told(), seed=0).delivered > 0
        True
    """

    needs_state = True
    parameters_type = ToldParameters
    parameters: ToldParameters

    def configure(self, scenario: Scenario) -> None:
        """Take what the script's maker knows, and how far radio and cameras reach."""
        of_script = self.parameters.model_dump(exclude={"hears", "count"})
        self._script = HomingStock(**of_script)
        self._script.configure(scenario)
        self._radio_range = scenario.radio_range

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode as the script does."""
        self._script.reset(n_robots, seed)

    def act(
        self, observations: NDArray[np.float32], state: WarehouseState | None = None
    ) -> NDArray[np.float64]:
        """Return the script's commands (N, 4) for rows in which the item stands.

        Raises:
            PolicyError: there is no state.
        """
        if state is None:
            raise PolicyError("state = None: should be the WarehouseState, as needs_state says")
        item = state.requested
        if item == NOBODY or state.item_status[item] != STORED:
            return self._script.act(observations)
        rows = observations.copy()
        first = row.ITEMS + np.arange(row.N_ITEMS_IN_VIEW) * row.ITEM_WIDTH
        requested = rows[:, first + row.ITEM.requested]
        is_in_view = np.asarray((requested > 0.5).any(axis=1))
        hears = self._hears(state, item, is_in_view) & ~is_in_view
        for robot in np.flatnonzero(hears):
            n_present = int((rows[robot, first + row.ITEM.present] > 0.5).sum())
            start = first[min(n_present, row.N_ITEMS_IN_VIEW - 1)]
            x, y = state.item_position[item] - state.robot_position[robot]
            cos = np.cos(state.robot_heading[robot])
            sin = np.sin(state.robot_heading[robot])
            rows[robot, start : start + row.ITEM_WIDTH] = 0.0
            rows[robot, start + row.ITEM.present] = 1.0
            rows[robot, start + row.ITEM.x] = cos * x + sin * y
            rows[robot, start + row.ITEM.y] = cos * y - sin * x
            rows[robot, start + row.ITEM.requested] = 1.0
        return self._script.act(rows)

    def _hears(self, state: WarehouseState, item: int, is_in_view: Booleans) -> Booleans:
        """Return which robots are told."""
        is_free = state.robot_present & (state.robot_item == NOBODY)
        if self.parameters.hears == "all":
            return np.asarray(is_free)
        position = state.robot_position
        if self.parameters.hears == "nearest":
            distance = np.linalg.norm(position - state.item_position[item], axis=1)
            order = np.argsort(np.where(is_free, distance, np.inf), kind="stable")
            is_near = np.zeros(len(position), np.bool_)
            is_near[order[: self.parameters.count]] = True
            return np.asarray(is_near & is_free)
        gaps = np.linalg.norm(position[:, None] - position[None], axis=-1)
        is_linked = (gaps <= self._radio_range) & state.robot_present
        hears = is_in_view & state.robot_present
        for _ in range(self.parameters.count):
            hears = hears | (is_linked & hears).any(axis=1)
        return np.asarray(hears & is_free)
