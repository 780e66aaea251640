from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env.rendering.renderer import load_pygame

load_pygame()
from swarm_logistics_env.rendering import sprites  # noqa: E402 - it imports pygame


@pytest.mark.parametrize("radius", [2.3, 9.5, 40.2])
def test_disc_covers_its_area(radius: float) -> None:
    rgba = sprites.painted((sprites.disc(*sprites.pixels(radius), radius), (10, 20, 30), 1.0))
    assert rgba[..., 3].sum() / 255 == pytest.approx(math.pi * radius**2, rel=0.02)
    # The colour holds to the very edge: no dark fringe.
    assert (rgba[rgba[..., 3] > 0][:, :3] == (10, 20, 30)).all()


@pytest.mark.parametrize("angle", [0.0, 1.0, math.pi / 2, -2.0])
def test_wedge_points_where_it_is_told(angle: float) -> None:
    inside = sprites.wedge(*sprites.pixels(10.0), angle, 10.0, 2.0, 3.0) < 0.0
    across, down = (places.mean() - inside.shape[0] // 2 for places in np.nonzero(inside))
    assert math.atan2(across, down) == pytest.approx(angle, abs=0.1)


def test_upper_layer_covers_the_lower() -> None:
    x, y = sprites.pixels(5.0)
    low, high = (sprites.box(x, y, half, half) for half in (5.5, 2.5))
    rgba = sprites.painted((low, (200, 0, 0), 1.0), (high, (0, 0, 200), 0.5))
    middle = rgba.shape[0] // 2
    assert rgba[middle, middle].tolist() == [100, 0, 100, 255]
    assert rgba[middle, middle + 4].tolist() == [200, 0, 0, 255]
    assert rgba[0, 0, 3] == 0
