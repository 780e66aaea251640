"""The data of a session that the page draws, as JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.observations import columns
from swarm_logistics_env.rendering import palette
from swarm_logistics_env.rendering.beams import ranges
from swarm_logistics_env.rendering.links import followed
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse import FAILURE_MODES
from swarm_logistics_env.warehouse.state import NOBODY, WarehouseState
from swarm_logistics_env.watch.session import WIDTH_STEP, Session
from swarm_logistics_env.watch.web.keys import HELP, KEYS, LINKS, MOUSE, TRAILS

_SHAPE = (
    "n_robots", "n_items", "warehouse_width", "warehouse_height", "delivery_width", "duration",
    "restock", "robot_radius", "item_radius", "obstacle_radius", "control_period",
)  # fmt: skip
# Several things stand in each of these blocks; those that are absent come last and are left out.
_BLOCKS = ("item", "neighbour", "lowest_timer")


def fixed_view(title: str) -> dict[str, Any]:
    """Return what does not change: colours, failure modes, keys."""
    return {
        "title": title,
        "colours": {name: _css(colour) for name, colour in palette.COLOURS.items()},
        "curves": [[_css(colour), thickness] for colour, thickness in palette.RUNS],
        "modes": [
            {"name": name, "mark": palette.MARKS.get(name, ""), "meaning": mode.description}
            for name, mode in FAILURE_MODES.items()
        ],
        "keys": [{"name": key.name, "label": key.label, "meaning": key.meaning} for key in KEYS],
        "mouse": MOUSE,
        "view_keys": {"trails": TRAILS, "links": LINKS, "help": HELP},
        "width_step": WIDTH_STEP,
    }


def moving_view(session: Session, *, trails: bool = False) -> dict[str, Any]:
    """Return what is true now. Lengths in m, times in s, angles in rad; x right, y up.

    A robot is [x, y, heading, activity, age of its timer in timer limits or None, mark,
    robot it follows], or None where it is absent; an item [x, y, status]. A trail is
    where a robot was in every step of late, oldest first, [x, y] or None.
    """
    world = session.run.world
    state, scenario = world.state, world.scenario
    return {
        "seed": session.seed,
        "speed": session.speed,
        "paused": session.paused,
        "over": session.is_over,
        "mode": session.mode,
        "note": session.note,
        "time": _short(state.time),
        "scenario": {name: getattr(scenario, name) for name in _SHAPE},
        "robots": [_robot(session, robot) for robot in range(state.n_robots)],
        "items": [
            [_short(x), _short(y), status]
            for (x, y), status in zip(state.item_position.tolist(), state.item_status.tolist())
        ],
        "obstacles": [[_short(x), _short(y)] for x, y in state.obstacle_position.tolist()],
        "requested": state.requested,
        "carrier": NOBODY
        if state.requested == NOBODY
        else int(state.item_carrier[state.requested]),
        "curves": [
            {
                "name": curve.name,
                "times": [_short(time) for time in curve.times],
                "until": _short(curve.until),
                "style": curve.style,
            }
            for curve in session.curves
        ],
        "events": [[_short(event.time), event.robot, event.label] for event in session.events],
        "selected": _selected(session),
        "trails": _trails(session) if trails else [],
    }


def observation_words(row: NDArray[np.float32], scenario: Scenario) -> list[tuple[str, str]]:
    """Return name and values of every named part of an observation row (D,).

    Items and neighbours are listed only if present, the nearest first. The name has the unit.
    """
    words = []
    parts = {column.name: row[column.columns] for column in columns(scenario)}
    for column in columns(scenario):
        values = parts[column.name]
        block = next((block for block in _BLOCKS if column.name.startswith(block)), None)
        if block is not None and column.name != f"{block}_present":
            n_present = int((parts[f"{block}_present"] > 0.5).sum())
            values = values[: n_present * (len(values) // len(parts[f"{block}_present"]))]
        if column.unit == "flag":
            text = " ".join("yes" if value > 0.5 else "no" for value in values)
            if column.name.endswith("_present") and len(values) > 1:
                text = f"{int((values > 0.5).sum())} of {len(values)}"
        else:
            # Adding 0.0 turns a negative zero into zero.
            text = " ".join(f"{round(float(value), 2) + 0.0:.2f}" for value in values)
        unit = "" if column.unit in ("flag", "1") else f" [{column.unit}]"
        words.append((column.name + unit, text or "–"))
    return words


def activity(state: WarehouseState, robot: int) -> str:
    """Return what a robot does now, in the words of the legend."""
    item = int(state.robot_item[robot])
    if item == NOBODY:
        return "searching"
    return "delivering" if item == state.requested else "shuffling"


def _trails(session: Session) -> list[list[list[float] | None]]:
    past = np.round(session.trails.positions(), 3).swapaxes(0, 1).tolist()
    return [[None if math.isnan(place[0]) else place for place in trail] for trail in past]


def _robot(session: Session, robot: int) -> list[Any] | None:
    state, scenario = session.run.world.state, session.scenario
    if not state.robot_present[robot]:
        return None
    x, y = state.robot_position[robot].tolist()
    age = float(state.robot_timer[robot]) / scenario.timer_limit
    return [
        _short(x),
        _short(y),
        _short(float(state.robot_heading[robot])),
        activity(state, robot),
        _short(age) if age < 1.0 else None,
        palette.mark(state.failure_modes[robot]),
        followed(state, scenario, robot),
    ]


def _selected(session: Session) -> dict[str, Any] | None:
    robot = session.selected
    if robot is None:
        return None
    state, scenario = session.run.world.state, session.scenario
    return {
        "robot": robot,
        "activity": activity(state, robot),
        "modes": list(state.failure_modes[robot]),
        "beams": [_short(reach) for reach in _beams(state, session, robot)],
        "reach": _short(float(state.ranger_range[robot])),
        "view": _short(float(state.view_range[robot])),
        "row": observation_words(session.run.sensed(robot), scenario),
    }


def _beams(state: WarehouseState, session: Session, robot: int) -> list[float]:
    nearest: list[float] = np.min(ranges(state, session.scenario, robot), axis=0).tolist()
    return nearest


def _short(number: float) -> float:
    return round(number, 3)


def _css(colour: palette.RGB) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)
