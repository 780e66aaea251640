"""What the network reads and says, as the spaces of a VecEnv."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper

from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.motion.frame import INPUTS, OUTPUTS, MotionFrame
from swarm_logistics_env.policies.learned import STREAM
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import key, row_keys
from swarm_logistics_env.train.critic import KNOWN, read_known


class NetworkView(VecEnvWrapper):  # type: ignore[misc]  # not in the environment of the type check
    """Turns observation rows into a network's inputs, and its outputs into commands.

    By the code that plays the policy afterwards, so that both see the same. What the critic alone
    reads stands behind these inputs (see `critic`).

    Args:
        worlds: every robot is a row.
        scenario: of the worlds.
        listens: whether the network reads the lowest timer heard.

    Attributes:
        frame: of each robot's motion, with its memory.
        observations: the latest rows (num_envs, D).
    """

    def __init__(self, worlds: SwarmVecEnv, scenario: Scenario, listens: bool = True) -> None:
        self.frame = MotionFrame(scenario, listens)
        self.observations = np.zeros((worlds.num_envs, 0), np.float32)
        self._known = np.zeros((worlds.num_envs, len(KNOWN)), np.float32)
        self._begun, self._seed = 0, 0
        super().__init__(
            worlds,
            Box(-np.inf, np.inf, (len(INPUTS) + len(KNOWN),), np.float32),
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
            # What the critic knows is of one step before: the next episode has begun already.
            ends = np.hstack([self.frame.peek(last, over), self._known[over]])
            for row, read in zip(over.tolist(), ends):
                infos[row]["terminal_observation"] = read
            self.frame.begin_rows(over, self._keys()[over])
        return self._read(), rewards, dones, infos

    def _read(self) -> NDArray[np.float32]:
        inputs = self.frame.read(self.observations)
        for world, rows in zip(self.venv.worlds, self.venv.rows_of_worlds):
            read_known(world.warehouse, self.frame.turned[rows], self._known[rows])
        return np.hstack([inputs, self._known])

    def _keys(self) -> NDArray[np.uint64]:
        # Every episode of every row gets a stream of its own.
        self._begun += 1
        return row_keys(key(self._seed, "training episode", self._begun), STREAM, self.num_envs)
