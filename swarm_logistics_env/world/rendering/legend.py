"""The legend below a picture: each mark of the warehouse above, small."""

from __future__ import annotations

from pygame import SRCALPHA, Surface

from swarm_logistics_env.world.scenario import Scenario

from . import sprites
from .palette import ACTIVITIES, ITEM_EDGE, MARKS, PLAN_COLOURS, RGB, dock_colours
from .plan_shapes import plan_shapes

OBSTACLE = "obstacle"  # the last mark
LATE = "!"


def legend(scenario: Scenario, height: int) -> dict[str, Surface]:
    """Return the marks of a warehouse by name, each about `height` high [px]."""
    radius = 0.42 * height
    robots = {name: sprites.robot(radius, name, 0, False) for name in ACTIVITIES}
    small_robot = sprites.robot(0.6 * radius, "searching", 0, False)
    link = Surface((round(1.4 * height), height), SRCALPHA, 32)
    sprites.arrow(link, (0, height - 2), (link.get_width(), 1), 0.0)
    return {
        **robots,
        **_kind_marks(scenario, height),
        "timer": _above(sprites.halo(0.7 * radius, 0), small_robot),
        "lowest timer heard": link,
        "failed": sprites.badge(MARKS["FM4"], round(0.9 * height)),
        "item": sprites.item(0.7 * radius, False),
        "requested item": _above(sprites.target(0.8 * radius), sprites.item(0.4 * radius, True)),
        **_late_mark(scenario, height),
        **_battery_marks(scenario, height),
        **_plan_marks(scenario, height),
        OBSTACLE: sprites.obstacle(1.1 * radius),
    }


def _kind_marks(scenario: Scenario, height: int) -> dict[str, Surface]:
    small_robot = sprites.robot(0.2 * height, "searching", 0, False)
    return {
        f"kind {kind.name}": _above(sprites.outline(0.2 * height, number), small_robot)
        for number, kind in enumerate(scenario.robot_kinds)
    }


def _late_mark(scenario: Scenario, height: int) -> dict[str, Surface]:
    if not scenario.has_due_times:
        return {}
    return {"late": sprites.badge(LATE, round(0.9 * height))}


def _battery_marks(scenario: Scenario, height: int) -> dict[str, Surface]:
    if scenario.battery is None:
        return {}
    radius = 0.5 * height
    bar = Surface((height, height), SRCALPHA, 32)
    sprites.charge_bar(bar, (height // 2, round(-0.4 * height)), radius, 0.6)
    marks = {"charge": bar}
    if len(scenario.stations):
        marks["station"] = sprites.station(radius, works=True)
    return marks


def _above(lower: Surface, upper: Surface) -> Surface:
    """Return one picture on the middle of another."""
    picture = lower.copy()
    picture.blit(upper, upper.get_rect(center=picture.get_rect().center))
    return picture


def _plan_marks(scenario: Scenario, height: int) -> dict[str, Surface]:
    if scenario.plan is None:
        return {}
    shapes = plan_shapes(scenario.plan)
    tint, _, word = dock_colours(shapes.docks[0].hue)
    letter = sprites.words(shapes.docks[0].letter, height, word)
    marks = {"dock": _above(_box(tint, ITEM_EDGE, height), letter)}
    if len(shapes.racks):
        marks["rack"] = _box(PLAN_COLOURS["RACK"], PLAN_COLOURS["RACK_EDGE"], height)
    areas = {"wall": shapes.walls, "storage": shapes.storage, "start": shapes.start}
    for name, boxes in areas.items():
        if len(boxes):
            marks[name] = _box(PLAN_COLOURS[name.upper()], ITEM_EDGE, height)
    return marks


def _box(colour: RGB, edge: RGB, height: int) -> Surface:
    box = sprites.new_canvas(height, height)
    box.fill(edge)
    box.fill(colour, box.get_rect().inflate(-2, -2))
    return box
