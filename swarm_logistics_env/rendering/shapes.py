"""Anti-aliased shapes from signed distances: crisp at any size, without a drawing library.

A distance is an array of the distance [px] from each pixel's centre to a shape's edge, negative
inside it. Angles are the screen's: clockwise from the right [rad].
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.rendering.palette import RGB

Distance = NDArray[np.float64]  # (H, W) [px]
Layer = tuple[Distance, RGB, float]  # a shape, its colour, its opacity in [0, 1]


def pixels(reach: float) -> tuple[Distance, Distance]:
    """Return x (1, W) and y (H, 1) [px] of a square that reaches so far around its middle pixel."""
    half = math.ceil(reach) + 1
    axis = np.arange(-half, half + 1, dtype=np.float64)
    return axis[np.newaxis, :], axis[:, np.newaxis]


def disc(x: Distance, y: Distance, radius: float) -> Distance:
    """Return the distance to a disc about the origin."""
    return np.hypot(x, y) - radius


def ring(x: Distance, y: Distance, radius: float, width: float) -> Distance:
    """Return the distance to a ring about the origin, `radius` to the middle of its width."""
    return np.abs(np.hypot(x, y) - radius) - width / 2


def box(x: Distance, y: Distance, half_width: float, half_height: float) -> Distance:
    """Return the distance to an upright box about the origin."""
    return np.maximum(np.abs(x) - half_width, np.abs(y) - half_height)


def pill(x: Distance, y: Distance, half_width: float, radius: float) -> Distance:
    """Return the distance to a box with round ends, `half_width` and `radius` from the origin."""
    return np.hypot(np.maximum(np.abs(x) - (half_width - radius), 0.0), y) - radius


def wedge(
    x: Distance, y: Distance, angle: float, tip: float, base: float, half_width: float
) -> Distance:
    """Return the distance to a triangle that points along `angle`.

    Its tip and its base, of twice the half width, lie `tip` and `base` from the origin.
    """
    along = x * math.cos(angle) + y * math.sin(angle)
    across = np.abs(y * math.cos(angle) - x * math.sin(angle))
    length = tip - base
    slope = math.hypot(length, half_width)
    sides: Distance = ((along - tip) * half_width + across * length) / slope
    return np.maximum(sides, base - along)


def painted(*layers: Layer) -> NDArray[np.uint8]:
    """Return the layers, the first lowest, as straight RGBA (H, W, 4)."""
    shape = np.broadcast_shapes(*(distance.shape for distance, _, _ in layers))
    colour, alpha = np.zeros((*shape, 3)), np.zeros((*shape, 1))
    for distance, rgb, opacity in layers:
        cover = (np.clip(0.5 - distance, 0.0, 1.0) * opacity)[..., np.newaxis]
        colour = np.array(rgb) * cover + colour * (1.0 - cover)
        alpha = cover + alpha * (1.0 - cover)
    straight = np.divide(colour, alpha, out=np.zeros_like(colour), where=alpha > 0.0)
    rgba: NDArray[np.uint8] = np.rint(np.dstack([straight, 255.0 * alpha])).astype(np.uint8)
    return rgba
