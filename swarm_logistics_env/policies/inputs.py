"""What a network reads: columns of the observation row, and what its robot remembers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import PolicyError, suggest
from swarm_logistics_env.observations import columns
from swarm_logistics_env.policies.card import Network
from swarm_logistics_env.policies.wandering import wander
from swarm_logistics_env.scenario import Scenario


class Inputs:
    """Makes input rows (N, width) from observation rows (N, D), for a policy and for its training.

    Each row has a memory of its own, begun anew by `begin`.

    Args:
        network: what is read.
        scenario: whose observation rows, and whose control period.

    Raises:
        PolicyError: such rows have no column of that name.
    """

    def __init__(self, network: Network, scenario: Scenario) -> None:
        known = {column.name: column for column in columns(scenario)}
        for name in network.columns:
            if name not in known:
                raise PolicyError(f"no observation column {name!r}{suggest(name, known)}")
        places = np.arange(max(column.columns.stop for column in known.values()))
        self._places = np.concatenate([places[known[name].columns] for name in network.columns])
        # So that each input is about as large as 1: flags as they are, lengths and times by range.
        self.natural_scale = np.concatenate(
            [
                np.full(len(places[known[name].columns]), 1.0 / known[name].high, np.float32)
                for name in network.columns
            ]
        )
        self._n_outputs = len(network.outputs)
        self._n_remembered = self._n_outputs if network.remembers_command else 0
        self._n_noise = network.noise
        self._forgets = math.exp(-scenario.control_period / network.noise_time)
        self.width = len(self._places) + self._n_remembered + self._n_noise
        self.begin(np.empty(0, np.uint64))

    def begin(self, keys: NDArray[np.uint64], rows: slice = slice(None)) -> None:
        """Begin an episode in these rows, each with the key of its stream.

        All rows: as many as there are keys from here on.
        """
        if rows == slice(None):
            self._keys = keys.copy()
            self._count = np.zeros(len(keys), np.int64)
            self._last = np.zeros((len(keys), self._n_outputs), np.float32)
            self._noise = np.zeros((len(keys), self._n_noise))
        self._keys[rows] = keys
        self._count[rows] = 0
        self._last[rows] = 0.0

    def read(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the inputs of the next decision, (N, width), not scaled; time goes on."""
        if self._n_noise:
            wander(self._keys, self._count, self._forgets, self._noise)
        self._count += 1
        return self.peek(observations, slice(None))

    def peek(self, observations: NDArray[np.float32], rows: slice) -> NDArray[np.float32]:
        """Return the inputs that these rows of observations would make, without going on."""
        seen = observations[:, self._places]
        parts = [seen]
        if self._n_remembered:
            parts.append(self._last[rows])
        if self._n_noise:
            parts.append(self._noise[rows].astype(np.float32))
        return np.concatenate(parts, axis=1) if len(parts) > 1 else seen

    def note(self, outputs: NDArray[np.float32]) -> None:
        """Remember what was decided (N, outputs)."""
        np.clip(outputs, -1.0, 1.0, out=self._last)
