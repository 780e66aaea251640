from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env.rendering.renderer import load_pygame

load_pygame()
from swarm_logistics_env.rendering.sprites import (  # noqa: E402 - it imports pygame
    box,
    disc,
    painted,
    pixels,
    wedge,
)


@pytest.mark.parametrize("radius", [2.3, 3.0, 9.5, 40.2])
def test_disc_covers_its_area(radius: float) -> None:
    rgba = painted((disc(*pixels(radius), radius), (10, 20, 30), 1.0))
    assert rgba[..., 3].sum() / 255 == pytest.approx(math.pi * radius**2, rel=0.02)
    # The colour holds to the very edge: no dark fringe.
    assert (rgba[rgba[..., 3] > 0][:, :3] == (10, 20, 30)).all()


def test_wedge_points_where_it_is_told() -> None:
    x, y = pixels(10.0)
    for angle in (0.0, 1.0, math.pi / 2, -2.0):
        inside = wedge(x, y, angle, 10.0, 2.0, 3.0) < 0.0
        rows, columns = np.nonzero(inside)
        middle = inside.shape[0] // 2
        found = math.atan2(rows.mean() - middle, columns.mean() - middle)
        assert found == pytest.approx(angle, abs=0.1)


def test_upper_layer_covers_the_lower() -> None:
    x, y = pixels(5.0)
    rgba = painted((box(x, y, 5.5, 5.5), (200, 0, 0), 1.0), (box(x, y, 2.5, 2.5), (0, 0, 200), 0.5))
    middle = rgba.shape[0] // 2
    assert rgba[middle, middle].tolist() == [100, 0, 100, 255]
    assert rgba[middle, middle + 4].tolist() == [200, 0, 0, 255]
    assert rgba[0, 0, 3] == 0
