from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env.world.rendering import palette
from swarm_logistics_env.world.rendering.renderer import load_pygame
from tests.world.rendering.test_renderer import count

load_pygame()

from swarm_logistics_env.world.rendering import sprites  # noqa: E402 - wants pygame


@pytest.mark.parametrize(
    ("charge", "colour", "n_filled"),
    [(1.0, "TIMER", 18), (0.3, "TIMER", 5), (0.29, "REQUESTED", 5), (0.01, "REQUESTED", 0)],
)
def test_a_bar_is_as_full_as_the_battery_and_of_another_colour_below_three_tenths(
    charge: float, colour: str, n_filled: int
) -> None:
    canvas = sprites.new_canvas(40, 40)
    canvas.fill(palette.SURROUNDINGS)
    sprites.charge_bar(canvas, (20, 10), 10.0, charge)
    picture = sprites.to_array(canvas)
    assert count(picture, palette.INK) == 20 * 4 - 18 * 2
    assert count(picture, getattr(palette, colour)) == 2 * n_filled
    assert count(picture, palette.FLOOR) == 2 * (18 - n_filled)
    rows, columns = np.nonzero((picture == palette.INK).all(axis=2))
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (22, 25, 10, 29)


def test_outlines_tell_four_kinds_of_robots_apart_and_begin_anew() -> None:
    import pygame

    outlines = [pygame.image.tobytes(sprites.outline(10.0, kind), "RGBA") for kind in range(8)]
    assert outlines[4:] == outlines[:4]
    assert len(set(outlines)) == 4


def test_an_arrow_points_to_the_edge_of_a_robot_and_needs_room_for_its_head() -> None:
    canvas = sprites.new_canvas(100, 40)
    canvas.fill(palette.SURROUNDINGS)
    sprites.arrow(canvas, (10, 20), (90, 20), 14.0)
    rows, columns = np.nonzero((sprites.to_array(canvas) == palette.LINK).all(axis=2))
    assert (columns.min(), columns.max()) == (10, 74)  # 2 px before the robot
    assert rows.min() + rows.max() == 40
    for gap, has_room in ((43.9, False), (44.1, True)):  # two radii, 2 px and the head
        canvas.fill(palette.SURROUNDINGS)
        sprites.arrow(canvas, (10, 20), (10 + gap, 20), 14.0)  # type: ignore[arg-type]
        assert (count(sprites.to_array(canvas), palette.LINK) > 0) == has_room
