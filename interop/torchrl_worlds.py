"""Several worlds as one batched environment of TorchRL, for its collectors and for BenchMARL."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Binary, Bounded, Composite, Unbounded
from torchrl.envs import EnvBase

from swarm_logistics_env.adapters.worlds import TrainingWorld, Worlds

GROUP = "robots"
ENDS = ("done", "terminated", "truncated")


class TorchRLWorlds(EnvBase):  # type: ignore[misc]  # TorchRL is not in the gate
    """Worlds of N robots each, as a batch (W,) of one group, "robots".

    `("robots", "observation")` is (W, N, D), `("robots", "action")` (W, N, A), `("robots",
    "reward")` (W, N, 1); "done", "terminated" and "truncated" are (W, 1). A robot that is removed
    observes zeros and earns nothing until its world ends. `seeds` are those of each first episode.
    """

    def __init__(self, make: Callable[[], TrainingWorld], seeds: Sequence[int]) -> None:
        self.worlds = Worlds(lambda _: make(), len(seeds), threads=1)
        self.group_map = {GROUP: list(self.worlds.envs[0].possible_agents)}
        self._seeds: list[int | None] = list(seeds)
        self._rows = self.worlds.blank()
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

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        which = np.ones(len(self._seeds), np.bool_)
        if tensordict is not None and "_reset" in tensordict:
            which = tensordict["_reset"].flatten().numpy()
        self._rows = self._rows.copy()  # the caller may still hold those of the step before
        for world in np.flatnonzero(which).tolist():
            self.worlds.begin(world, self._rows, self._seeds[world])
            self._seeds[world] = None
        return self._told()

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        self.worlds.give(tensordict[GROUP, "action"].flatten(0, 1).numpy())
        step = self.worlds.step()
        self._rows = step.observations
        result = self._told()
        result[GROUP, "reward"] = self._shaped(step.rewards).unsqueeze(-1)
        result["done"] = torch.tensor(self.worlds.is_over).unsqueeze(-1)
        result["truncated"] = result["done"] & self._shaped(step.truncated).any(1, keepdim=True)
        result["terminated"] = result["done"] & ~result["truncated"]
        return result

    def _set_seed(self, seed: int | None) -> None:
        """The seeds are given when it is made."""

    def _told(self) -> TensorDict:
        result = TensorDict({}, self.batch_size)
        robots = self._shaped(self._rows)
        result[GROUP] = TensorDict({"observation": robots}, robots.shape[:2])
        return result

    def _shaped(self, rows: np.ndarray[Any, Any]) -> torch.Tensor:
        each = (len(self._seeds), len(self.group_map[GROUP]))
        return torch.from_numpy(rows).view(*each, *rows.shape[1:])
