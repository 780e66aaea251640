from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.world.rendering import Renderer, palette
from swarm_logistics_env.world.rendering.plan_shapes import plan_shapes
from swarm_logistics_env.world.warehouse.structs import NOBODY

if TYPE_CHECKING:
    from pygame import Surface

Frame = NDArray[np.uint8]
CELL = 40  # [px]
SIZE = 410  # of which 2 * 5 px are margins: 10 cells of 40 px

HALL = """
A.::::::.B
A.::==::.B
A.::==::.B
A.::::::.B
..::::::..
..::##::..
++::##::..
++::::::.A
..::::::.A
..::::::..
"""


def world_of(**fields: object) -> Warehouse:
    world = Warehouse(
        Scenario.model_validate({"floor": HALL, "n_robots": 1, "n_items": 1} | fields)
    )
    world.reset(0)
    world.state.robot_position[:] = [2.25, 0.25]
    world.state.item_position[:] = [1.75, 2.75]
    return world


def floor_of(world: Warehouse) -> Frame:
    """The part of a picture that shows the warehouse, 400 x 400 px."""
    from swarm_logistics_env.world.rendering.picture import Picture  # loads pygame

    floor = Picture(world.scenario, SIZE).floor
    assert floor.size == (10 * CELL, 10 * CELL)
    frame = Renderer(world.scenario, "rgb_array", SIZE).frame(world.state, world.scenario)
    return frame[floor.top : floor.bottom, floor.left : floor.right]


def cell(picture: Frame, line: int, column: int) -> Frame:
    """The pixels of a cell of the plan; lines from the top."""
    return picture[CELL * line :, CELL * column :][:CELL, :CELL]


def share(pixels: Frame, colour: palette.RGB) -> float:
    return float((pixels == colour).all(axis=2).mean())


def test_walls_racks_storage_and_start_each_look_their_own() -> None:
    picture, colours = floor_of(world_of()), palette.PLAN_COLOURS
    looks = {"RACK": (1, 4), "WALL": (5, 4), "STORAGE": (9, 5), "START": (6, 0)}
    for name, at in looks.items():
        shown = {other: share(cell(picture, *at), colours[other]) for other in looks}
        assert shown.pop(name) > 0.5
        assert max(shown.values()) == 0.0
    rack = cell(picture, 1, 4)
    assert min(share(rack, colours[name]) for name in ("RACK_EDGE", "RACK_SLAT")) > 0.02
    assert share(cell(picture, 4, 1), palette.FLOOR) > 0.9
    assert share(cell(picture, 3, 5), colours["SHADOW"]) > 0.05  # of the rack above it
    assert share(picture, palette.DELIVERY_AREA) == 0.0


def test_each_part_of_a_dock_has_the_docks_tint_and_its_letter() -> None:
    picture = floor_of(world_of())
    green, purple = (palette.dock_colours(hue) for hue in palette.DOCK_HUES[:2])
    strips = (  # first line, last line, column
        (0, 3, 0, green, purple),
        (7, 8, 9, green, purple),
        (0, 3, 9, purple, green),
    )
    for first, last, column, colours, other_colours in strips:
        strip = picture[CELL * first : CELL * (last + 1), CELL * column :][:, :CELL]
        tint, _, letter = colours
        assert share(strip, tint) > 0.4
        assert (strip == letter).all(axis=2).sum() > 60
        assert not any(share(strip, other_colour) for other_colour in other_colours)


def test_robots_and_items_are_above_the_plan_and_the_background_is_drawn_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from swarm_logistics_env.world.rendering.plan_picture import PlanPicture  # loads pygame

    world, drawn = world_of(), []
    draw = PlanPicture.draw_docks_and_solids

    def count(self: PlanPicture, picture: Surface) -> None:
        drawn.append(self)
        draw(self, picture)

    monkeypatch.setattr(PlanPicture, "draw_docks_and_solids", count)
    world.state.robot_position[:] = [0.25, 4.0]  # in dock A
    renderer = Renderer(world.scenario, "rgb_array", SIZE)
    for _ in range(3):
        frame = renderer.frame(world.state, world.scenario)
    assert len(drawn) == 1
    assert share(frame[:300, :100], palette.SEARCHING) > 0.001


def test_a_request_shows_the_letter_of_its_dock() -> None:
    world = world_of(request_docks="random")
    pictures = []
    for dock in (0, 1):
        world.state.requested_docks[:] = dock
        pictures.append(floor_of(world)[CELL * 3 : CELL * 7, CELL * 2 : CELL * 6])
    for dock, picture in enumerate(pictures):
        colour, colour_of_other = (
            palette.dock_colours(palette.DOCK_HUES[n])[2] for n in (dock, 1 - dock)
        )
        assert (picture == colour).all(axis=2).sum() > 15
        assert share(picture, colour_of_other) == 0.0
    pictures = [floor_of(world_of())]
    world.state.requested_docks[:] = NOBODY
    pictures.append(floor_of(world))
    for picture in pictures:
        any_dock = picture[CELL * 3 : CELL * 7, CELL * 2 : CELL * 6]
        assert not any(share(any_dock, palette.dock_colours(hue)[2]) for hue in palette.DOCK_HUES)


def test_shapes_cover_each_cell_of_their_kind_once() -> None:
    plan = world_of().scenario.plan
    assert plan is not None
    shapes = plan_shapes(plan)
    for boxes, n_cells in (
        (shapes.walls, 4), (shapes.racks, 4), (shapes.start, 4),
        (np.concatenate([part.boxes for part in shapes.docks]), 10),
    ):  # fmt: skip
        areas = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
        assert areas.sum() == pytest.approx(n_cells * 0.25)
    assert [part.letter for part in shapes.docks] == ["A", "A", "B"]
    assert shapes.racks.tolist() == [[2.0, 3.5, 3.0, 4.5]]


def test_films_have_further_colours_only_with_a_plan() -> None:
    plain, planned = palette.film_colours(has_plan=False), palette.film_colours(has_plan=True)
    assert planned[: len(plain)] == plain
    assert set(palette.PLAN_COLOURS.values()) <= set(planned) - set(plain)
    assert len(planned) < 128
    assert set(palette.PLAN_COLOURS) <= set(palette.DARK_COLOURS)
