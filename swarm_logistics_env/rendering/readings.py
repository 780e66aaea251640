"""What a picture tells of a world: places, who follows whom, events."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, WarehouseState

from .palette import MARKS

_MARGIN = 0.025  # a part of the picture's size, on each side


@dataclass(frozen=True)
class Projection:
    """The warehouse's place on a picture, x to the right and y up, as on paper.

    Attributes:
        scale: [px/m].
        left, top: the warehouse's upper left corner [px].
        right, bottom: its lower right corner [px].
        margin: between warehouse, caption and the picture's edges [px].
    """

    scale: float
    left: int
    top: int
    right: int
    bottom: int
    margin: int

    @classmethod
    def fitting(cls, scenario: Scenario, size: int, least_width: int) -> Projection:
        """Return the projection whose longer side is `size` [px], margins included.

        A warehouse narrower than `least_width` [px], margins included, stands in the middle of it.
        """
        margin = max(6, round(_MARGIN * size))
        width, height = scenario.warehouse_width, scenario.warehouse_height
        scale = (size - 2 * margin) / max(width, height)
        across, down = round(scale * width), round(scale * height)
        left = max(margin, (least_width - across) // 2)
        return cls(scale, left, margin, left + across, margin + down, margin)

    @property
    def width(self) -> int:
        """Width of the picture [px]; even, which films want."""
        width = self.right + self.left
        return width + width % 2

    def length(self, metres: float) -> float:
        """Return a length in pixels."""
        return metres * self.scale

    def points(self, positions: NDArray[np.float64]) -> list[tuple[float, float]]:
        """Return positions (K, 2) [m] as K pixels, not rounded."""
        pixels = positions * (self.scale, -self.scale) + (self.left, self.bottom)
        return [(x, y) for x, y in pixels.tolist()]


def activity(state: WarehouseState, robot: int) -> str:
    """Return what a robot does, a key of `palette.ACTIVITIES`."""
    item = int(state.robot_item[robot])
    if item == NOBODY:
        return "searching"
    return "delivering" if item == state.requested else "shuffling"


def followed(state: WarehouseState, scenario: Scenario, robot: int) -> int:
    """Return the neighbour whose timer is the lowest that `robot` hears, or NOBODY.

    If several tell the same, it is the nearest of them.
    """
    if not (state.robot_present[robot] and state.hears[robot]):
        return NOBODY
    offset = state.robot_position - state.robot_position[robot]
    square = (offset * offset).sum(axis=1)
    heard = state.robot_present & state.sends & (square <= scenario.radio_range**2)
    heard &= ~np.isnan(state.robot_told)
    heard[robot] = False
    candidates = np.flatnonzero(heard)
    if not candidates.size:
        return NOBODY
    order = np.lexsort((square[candidates], state.robot_told[candidates]))
    return int(candidates[order[0]])


@dataclass(frozen=True)
class Event:
    """A robot that failed, or was repaired: a mark on the time axis."""

    time: float  # [s]
    robot: int
    mode: str | None  # None if it was repaired

    @property
    def label(self) -> str:
        """The text of the mark."""
        return "ok" if self.mode is None else MARKS.get(self.mode, self.mode)
