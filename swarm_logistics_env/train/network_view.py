"""What the networks read and say, as the spaces of a VecEnv.

The value network reads more than a robot can sense, such as where the requested item is: it judges
while the policy learns and is not shipped (an asymmetric critic, Pinto et al. 2018). The network
that decides never sees this.
"""

from __future__ import annotations

import inspect
import math
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper

from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.motion.frame import OUTPUTS, MotionFrame
from swarm_logistics_env.policies.card import Network
from swarm_logistics_env.policies.learned import STREAM
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import key, row_keys
from swarm_logistics_env.warehouse import Warehouse
from swarm_logistics_env.warehouse.state import NOBODY

# Lengths are in units of 10 m; directions are in the frame of the robot's motion.
KNOWN = (
    "to_delivery", "y", "frame_cos", "frame_sin", "drift", "swarm_size",
    "lifts", "delivers",
    "requested_along", "requested_aside", "requested_distance", "requested_nearness",
    "is_carried", "carrier_to_delivery", "carrier_delivers",
)  # fmt: skip


def read_known(world: Warehouse, turned: NDArray[np.float64], known: NDArray[np.float32]) -> None:
    """Fill `known` (rows, len(KNOWN)); rows without a robot stay as they are.

    Args:
        turned: how far each row's frame is turned from its robot's body (rows,) [rad].
    """
    state = world.state
    requested = state.requested
    place = np.zeros(2) if requested == NOBODY else state.item_position[requested]
    carrier = NOBODY if requested == NOBODY else int(state.item_carrier[requested])
    fill_known(
        state.robot_position,
        state.robot_heading,
        state.robot_heading_drift,
        state.lifts,
        state.delivers,
        place,
        requested != NOBODY,
        carrier,
        world.scenario.storage_width,
        world.scenario.warehouse_height,
        turned,
        known,
    )


@kernel
def fill_known(
    positions: NDArray[np.float64],
    headings: NDArray[np.float64],
    drifts: NDArray[np.float64],
    lifts: NDArray[np.bool_],
    delivers: NDArray[np.bool_],
    place: NDArray[np.float64],
    is_requested: bool,
    carrier: int,
    edge: float,
    height: float,
    turned: NDArray[np.float64],
    known: NDArray[np.float32],
) -> None:
    """Fill the columns of robots from positions [m], headings [rad] and their rates [rad/s]."""
    for robot in range(positions.shape[0]):
        row = known[robot]
        x, y = positions[robot, 0], positions[robot, 1]
        frame = headings[robot] + turned[robot]
        cos, sin = math.cos(frame), math.sin(frame)
        row[0], row[1] = (edge - x) / 10.0, (y - 0.5 * height) / 10.0
        row[2], row[3] = cos, sin
        row[4] = 10.0 * drifts[robot]
        row[5] = math.log(positions.shape[0]) / 5.0
        row[6] = 1.0 if lifts[robot] else 0.0
        row[7] = 1.0 if delivers[robot] else 0.0
        row[8:] = 0.0
        if is_requested:
            to_x, to_y = place[0] - x, place[1] - y
            away = max(math.sqrt(to_x * to_x + to_y * to_y), 1e-9)
            row[8] = (cos * to_x + sin * to_y) / away
            row[9] = (cos * to_y - sin * to_x) / away
            row[10] = away / 10.0
            row[11] = max(0.0, 1.0 - away / 2.0)
        if carrier >= 0:
            row[12] = 1.0
            row[13] = (edge - positions[carrier, 0]) / 10.0
            row[14] = 1.0 if delivers[carrier] else 0.0


class NetworkView(VecEnvWrapper):  # type: ignore[misc]  # not in the environment of the type check
    """Turns observation rows into a network's inputs, and its outputs into commands.

    By the code that plays the policy afterwards, so that both see the same. What the value network
    alone reads, `KNOWN`, stands behind these inputs.

    Args:
        worlds: every robot is a row.
        scenario: of the worlds.
        network: what it reads.

    Attributes:
        frame: of each robot's motion, with its memory.
        observations: the latest rows (num_envs, D).
    """

    def __init__(self, worlds: SwarmVecEnv, scenario: Scenario, network: Network) -> None:
        self.frame = MotionFrame(scenario, network.listens)
        self._n_inputs = len(network.inputs)
        self.observations = np.zeros((worlds.num_envs, 0), np.float32)
        self._known = np.zeros((worlds.num_envs, len(KNOWN)), np.float32)
        self._begun, self._seed = 0, 0
        super().__init__(
            worlds,
            Box(-np.inf, np.inf, (self._n_inputs + len(KNOWN),), np.float32),
            Box(-1.0, 1.0, (len(OUTPUTS),), np.float32),
        )

    def __getstate__(self) -> dict[str, Any]:
        # The base class stores members of the class, which cannot be pickled.
        return {name: value for name, value in vars(self).items() if name != "class_attributes"}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        # This comes first, because the base class looks up missing attributes in `venv`: endlessly
        # if that is missing too.
        self.__dict__.update(saved)
        self.class_attributes = dict(inspect.getmembers(type(self)))

    def seed(self, seed: int | None = None) -> list[int]:
        """Fix all episodes from the next `reset` on."""
        self._begun, self._seed = 0, seed or 0
        seeds: list[int] = self.venv.seed(seed)
        return seeds

    def reset(self) -> NDArray[np.float32]:
        """Begin an episode in every world."""
        self.observations = self.venv.reset()
        self.frame.begin(self._keys())
        return self._read()

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take the outputs (num_envs, 3) of the step that `step_wait` makes."""
        self.venv.step_async(self.frame.command(actions))

    def step_wait(self) -> Any:
        """Step every world."""
        self.observations, rewards, dones, infos = self.venv.step_wait()
        over = np.flatnonzero(dones)
        if over.size:
            last = np.stack([infos[row]["terminal_observation"] for row in over.tolist()])
            # The value network knows of one step before: the next episode has begun already.
            ends = np.hstack([self.frame.peek(last, over)[:, : self._n_inputs], self._known[over]])
            for row, read in zip(over.tolist(), ends):
                infos[row]["terminal_observation"] = read
            self.frame.begin_rows(over, self._keys()[over])
        return self._read(), rewards, dones, infos

    def _read(self) -> NDArray[np.float32]:
        inputs = self.frame.read(self.observations)[:, : self._n_inputs]
        for world, rows in zip(self.venv.worlds, self.venv.rows_of_worlds):
            read_known(world.warehouse, self.frame.turned[rows], self._known[rows])
        return np.hstack([inputs, self._known])

    def _keys(self) -> NDArray[np.uint64]:
        # Every episode of every row gets a stream of its own.
        self._begun += 1
        return row_keys(key(self._seed, "training episode", self._begun), STREAM, self.num_envs)
