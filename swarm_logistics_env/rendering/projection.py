"""The projection of the warehouse onto the picture, from metres to pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.scenario import Scenario

LEAST_SIZE, LARGEST_SIZE = 100, 8000  # of a picture's longer side [px]
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
