"""RWARE, the multi-robot warehouse, as a task: P is the number of shelves delivered.

Papoudakis et al., Benchmarking Multi-Agent Deep Reinforcement Learning Algorithms in Cooperative
Tasks, NeurIPS 2021. `pip install rware` brings it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Tuple
from numpy.typing import NDArray
from rware.warehouse import RewardType, Warehouse
from tuple_env import TupleEnv

from swarm_logistics_env.core import streams
from swarm_logistics_env.study.tasks import ParallelTask
from swarm_logistics_env.study.tasks.parallel_wrappers import Env

Cell = tuple[int, int]  # column, row

NOOP, FORWARD, LEFT, RIGHT, TOGGLE = range(5)
# The directions of an observation in its order, and how far each is turned clockwise from up.
STEPS = ((0, -1), (0, 1), (-1, 0), (1, 0))
QUARTERS = (0, 2, 3, 1)
# A row holds the robot's column, row, load, direction (4), highway, then 9 cells of 7 numbers.
FIRST_CELL, CELL_COLUMNS = 8, 7
ROBOT, SHELF, REQUESTED = 0, 5, 6
SIDESTEP = 0.3  # probability of a step aside where another robot is in the way


class StartsWithout(Warehouse):  # type: ignore[misc]  # RWARE is not typed
    """A warehouse that some robots leave before the first step; the others start where they were.

    Args:
        absent: numbers of the robots that leave.
        arguments: those of `rware.warehouse.Warehouse`.
    """

    n_agents: int
    agents: list[Any]
    observation_space: Any
    action_space: Any

    def __init__(self, absent: Sequence[int], **arguments: Any) -> None:
        super().__init__(**arguments)
        self._absent = set(absent)
        self._n_robots = self.n_agents
        self._spaces = self.observation_space
        n_present = self._n_robots - len(self._absent)
        self.observation_space = Tuple(self._spaces.spaces[:n_present])
        self.action_space = Tuple(self.action_space.spaces[:n_present])

    def reset(self, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        space_of_present = self.observation_space
        self.observation_space = self._spaces
        self.n_agents = self._n_robots
        super().reset(seed=seed, options=options)
        self.observation_space = space_of_present
        self.agents = [agent for row, agent in enumerate(self.agents) if row not in self._absent]
        self.n_agents = len(self.agents)
        for number, agent in enumerate(self.agents, start=1):
            agent.id = number
        self._recalc_grid()
        return tuple(self._make_obs(agent) for agent in self.agents), {}


def make_env(
    n_robots: int,
    shelf_rows: int,
    shelf_columns: int,
    column_height: int,
    requests: int,
    absent: Sequence[int] = (),
) -> TupleEnv:
    """Return the environment; `requests` shelves are asked for at any time."""
    return TupleEnv(
        StartsWithout(
            absent,
            shelf_columns=shelf_columns,
            column_height=column_height,
            shelf_rows=shelf_rows,
            n_agents=n_robots,
            msg_bits=0,
            sensor_range=1,
            request_queue_size=requests,
            max_inactivity_steps=None,
            max_steps=None,
            reward_type=RewardType.INDIVIDUAL,
        )
    )


class Fetch:
    """Looks for requested shelves, and brings each to the goal and back.

    A robot decides from its own observation, a map of the aisles, and what it remembers: it walks
    under the shelves to random places until it sees a requested shelf in the cells around it.
    Loaded, it takes the shortest way through the aisles. Where another robot stands in its way it
    waits, or now and then steps aside.
    """

    def configure(self, env: Env, agents: Sequence[str | None]) -> None:
        """Learn the map."""
        warehouse = env.unwrapped
        self._highways = warehouse.highways.astype(bool)
        self._goals = [(int(x), int(y)) for x, y in warehouse.goals]
        self._distances: dict[tuple[Cell, Cell], dict[Cell, int]] = {}

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode."""
        self._random = [streams.generator(seed, "fetch", row) for row in range(n_robots)]
        self._home: list[Cell | None] = [None] * n_robots
        self._delivered = [False] * n_robots
        self._target: list[Cell | None] = [None] * n_robots

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return an action for each row."""
        return np.array([self._action(robot, row) for robot, row in enumerate(observations)])

    def _action(self, robot: int, row: NDArray[np.float32]) -> int:
        if not row[3:7].any():  # absent, or blind
            return NOOP
        position = int(row[0]), int(row[1])
        cells = row[FIRST_CELL:].reshape(3, 3, CELL_COLUMNS)  # row, column
        if not row[2]:
            self._home[robot], self._delivered[robot] = None, False
            return self._search(robot, position, row, cells)
        home = self._home[robot]
        if home is None:
            home = self._home[robot] = position
        if position in self._goals:
            self._delivered[robot] = True
        if self._delivered[robot] and position == home:
            return TOGGLE
        goal = home
        if not self._delivered[robot]:
            goal = min(self._goals, key=lambda cell: abs(cell[0] - position[0]))
        distances = self._distances_to(goal, home)
        if position not in distances:  # set down by a failure
            return NOOP
        # The first neighbour that is nearer to the goal; at the goal there is none.
        nearer = (
            cell
            for cell in _around(position)
            if distances.get(cell, len(distances)) < distances[position]
        )
        target = next(nearer, position)
        return self._walk(robot, position, target, row, cells, set(distances))

    def _search(
        self, robot: int, position: Cell, row: NDArray[np.float32], cells: NDArray[np.float32]
    ) -> int:
        if cells[1, 1, REQUESTED]:
            return TOGGLE
        requested = np.argwhere(cells[:, :, REQUESTED] > 0)
        free = [(y, x) for y, x in requested if not cells[y, x, ROBOT]]
        if free:
            y, x = free[0]
            self._target[robot] = position[0] + int(x) - 1, position[1] + int(y) - 1
        target = self._target[robot]
        if target is None or target == position:
            height, width = self._highways.shape
            index = int(self._random[robot].integers(height * width))
            target = self._target[robot] = index % width, index // width
        across = target[0] - position[0]
        down = target[1] - position[1]
        step = (int(np.sign(across)), 0) if across else (0, int(np.sign(down)))
        neighbour = position[0] + step[0], position[1] + step[1]
        return self._walk(robot, position, neighbour, row, cells, None)

    def _walk(
        self,
        robot: int,
        position: Cell,
        target: Cell,
        row: NDArray[np.float32],
        cells: NDArray[np.float32],
        allowed: set[Cell] | None,
    ) -> int:
        """Return the action of a step to a neighbouring cell, aside where a robot stands there."""
        if target == position:
            return NOOP
        if cells[target[1] - position[1] + 1, target[0] - position[0] + 1, ROBOT]:
            if self._random[robot].random() >= SIDESTEP:
                return NOOP
            height, width = self._highways.shape
            free = [
                cell
                for cell in _around(position)
                if (allowed is None or cell in allowed)
                and 0 <= cell[0] < width
                and 0 <= cell[1] < height
                and not cells[cell[1] - position[1] + 1, cell[0] - position[0] + 1, ROBOT]
            ]
            if not free:
                return NOOP
            target = free[int(self._random[robot].integers(len(free)))]
        heading = int(np.argmax(row[3:7]))
        direction = STEPS.index((target[0] - position[0], target[1] - position[1]))
        turn = (QUARTERS[direction] - QUARTERS[heading]) % 4
        return (FORWARD, RIGHT, RIGHT, LEFT)[turn]

    def _distances_to(self, goal: Cell, home: Cell) -> dict[Cell, int]:
        """Return the steps from each cell of the aisles, and from `home`, to `goal`."""
        if (goal, home) not in self._distances:
            height, width = self._highways.shape
            steps, waiting = {goal: 0}, deque([goal])
            while waiting:
                cell = waiting.popleft()
                for x, y in _around(cell):
                    inside = 0 <= x < width and 0 <= y < height
                    if inside and (x, y) not in steps and (self._highways[y, x] or (x, y) == home):
                        steps[x, y] = steps[cell] + 1
                        waiting.append((x, y))
            self._distances[goal, home] = steps
        return self._distances[goal, home]


def _around(cell: Cell) -> list[Cell]:
    return [(cell[0] + across, cell[1] + down) for across, down in STEPS]


def deliveries(env: Any, rewards: Any, infos: Any) -> float:
    """The number of requested shelves brought to a goal."""
    return float(sum(rewards.values()))


RWARE = ParallelTask(
    make_env,
    name="rware",
    n_robots=4,
    steps=500,
    parameters={"shelf_rows": 2, "shelf_columns": 3, "column_height": 8, "requests": 8},
    performance=deliveries,
    failures={"silent": NOOP, "frozen": None, "blind": None, "removed": "absent"},
    policies={"fetch": Fetch},
)
