"""The paths of the robots over the last seconds."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.warehouse.state import WarehouseState

TRAIL_SECONDS = 2.5


class Trails:
    """Remembers the robots' positions over the last `TRAIL_SECONDS` of one episode."""

    def __init__(self) -> None:
        self._past: deque[tuple[float, NDArray[np.float64]]] = deque()

    def note(self, state: WarehouseState) -> None:
        """Remember where robots are; a time or a swarm that doesn't continue starts afresh."""
        past = self._past
        if past and (state.time < past[-1][0] or state.n_robots != len(past[-1][1])):
            past.clear()
        if not past or state.time > past[-1][0]:
            present = state.robot_present[:, np.newaxis]
            past.append((state.time, np.where(present, state.robot_position, np.nan)))
        while past[0][0] < state.time - TRAIL_SECONDS - 1e-9:
            past.popleft()

    def positions(self) -> NDArray[np.float64]:
        """Return what is remembered, oldest first: (T, N, 2) [m], NaN where a robot was absent."""
        return np.array([positions for _, positions in self._past])
