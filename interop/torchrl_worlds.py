"""A TorchRL environment over the array methods: several worlds in one batch, without dicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Binary, Bounded, Composite, Unbounded
from torchrl.envs import EnvBase

from swarm_logistics_env.adapters.worlds import World, Worlds

GROUP = "robots"


class TorchRLWorlds(EnvBase):  # type: ignore[misc]  # TorchRL is not in the gate
    """Worlds of N robots each, as a batch (W,) of one group, "robots", with rows (W, N, D).

    Every world plays its whole time, so all of them end together; give them `restock=True`.

    Args:
        make: makes one world.
        seeds: of the first episode of each world; later ones follow from them.
    """

    def __init__(self, make: Callable[[], World], seeds: Sequence[int]) -> None:
        self.worlds = Worlds(lambda _: make(), len(seeds), threads=1)
        self.group_map = {GROUP: self.worlds.envs[0].possible_agents}
        self._seeds: list[int | None] = list(seeds)
        each = (len(seeds), len(self.group_map[GROUP]))
        super().__init__(batch_size=each[:1])
        seen, command = self.worlds.observation_space.shape, self.worlds.command_space

        def grouped(**specs: Any) -> Composite:
            return Composite({GROUP: Composite(specs, shape=each)}, shape=each[:1])

        self.observation_spec = grouped(observation=Unbounded((*each, *seen)))
        low, high = (torch.from_numpy(end).expand(*each, -1) for end in (command.low, command.high))
        self.action_spec = grouped(action=Bounded(low, high, dtype=torch.float32))
        self.reward_spec = grouped(reward=Unbounded((*each, 1)))
        ends = {name: Binary(1, (*each[:1], 1), dtype=torch.bool) for name in ENDS}
        self.done_spec = Composite(ends, shape=each[:1])

    @property
    def delivered(self) -> list[int]:
        """Items delivered so far in each world's episode."""
        return [env.warehouse.state.delivered for env in self.worlds.envs]

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        observations = self.worlds.blank()
        for world, seed in enumerate(self._seeds):
            self.worlds.begin(world, observations, seed)
        self._seeds = [None] * len(self._seeds)
        return self._told(observations)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        self.worlds.give(tensordict[GROUP, "action"].flatten(0, 1).numpy())
        step = self.worlds.step()
        told = self._told(step.observations)
        told[GROUP, "reward"] = self._shaped(step.rewards).unsqueeze(-1)
        told["terminated"] = self._shaped(step.terminated).all(1, keepdim=True)
        told["truncated"] = self._shaped(step.truncated).all(1, keepdim=True)
        told["done"] = told["terminated"] | told["truncated"]
        return told

    def _set_seed(self, seed: int | None) -> None:
        """The seeds are given when it is made."""

    def _told(self, observations: np.ndarray[Any, Any]) -> TensorDict:
        told = TensorDict({}, self.batch_size)
        told[GROUP] = TensorDict({"observation": self._shaped(observations)}, self._each)
        return told

    def _shaped(self, rows: np.ndarray[Any, Any]) -> torch.Tensor:
        return torch.from_numpy(rows).view(*self._each, *rows.shape[1:])

    @property
    def _each(self) -> tuple[int, int]:
        return len(self._seeds), len(self.group_map[GROUP])


ENDS = ("done", "terminated", "truncated")
