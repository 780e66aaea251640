"""What server and page tell each other, and a recording of it that needs no server."""

from __future__ import annotations

import base64
import contextlib
import hashlib
import json
import re
import zlib
from collections.abc import Callable
from functools import lru_cache
from importlib import resources
from itertools import zip_longest
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, ValidationError, validate_call

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.world.observations import unflatten
from swarm_logistics_env.world.rendering import palette
from swarm_logistics_env.world.rendering.plan_shapes import dock_hue, plan_shapes
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import FAILURE_MODES
from swarm_logistics_env.world.warehouse.state import NOBODY, STORED

from .session import SPEEDS, Session

Message: TypeAlias = dict[str, Any]

_SESSION_FIELDS = (
    "episode", "seed", "speed", "paused", "mode", "note", "failure", "policy", "against",
)  # fmt: skip
_SCENARIO_FIELDS = (
    "n_robots", "n_items", "warehouse_width", "warehouse_height", "delivery_width", "duration",
    "restock", "robot_radius", "item_radius", "obstacle_radius", "has_orders", "has_due_times",
)  # fmt: skip
_TIMER_STEPS = 8  # shades of the timer's halo


def fixed_data(session: Session) -> Message:
    """Return what holds for a world: colours, modes, speeds, policies, plan, kinds and radii."""
    light = palette.ROBOT_COLOURS | palette.PLAN_COLOURS
    return {
        "colours": {
            theme: {name: f"#{bytes(colour).hex()}" for name, colour in colours.items()}
            for theme, colours in (("light", light), ("dark", palette.DARK_COLOURS))
        },
        "curves": palette.RUN_NAMES,
        "modes": [
            {"name": name, "mark": palette.MARKS.get(name, ""), "meaning": mode.description}
            for name, mode in FAILURE_MODES.items()
            if mode.battery == 1.0 or session.scenario.battery is not None
        ],
        "speeds": SPEEDS,
        "choices": session.choices,
        "plan": _plan_message(session.scenario),
        "kinds": [kind.name for kind in session.scenario.robot_kinds],
        "radii": session.scenario.of_kinds("robot_radius"),
    }


@lru_cache(maxsize=4)
def _plan_message(scenario: Scenario) -> Message | None:
    """Return boxes [mm] of each kind of cell and of each dock's connected parts, if any."""
    if scenario.plan is None:
        return None
    shapes = plan_shapes(scenario.plan)
    kinds = ("walls", "racks", "storage", "start")
    return {
        **{kind: _millimetres(getattr(shapes, kind)) for kind in kinds},
        "cell": round(1000 * scenario.cell_size),
        "docks": [
            {
                "letter": part.letter,
                "hue": part.hue,
                "boxes": _millimetres(part.boxes),
                "letter_box": np.rint(1000 * part.letter_box).astype(int).tolist(),
            }
            for part in shapes.docks
        ],
    }


def frame_message(session: Session) -> Message:
    """Return what is true now. Lengths in mm, times in s, angles in mrad; x right, y up.

    `events` are [time, label of the mark, sentence] of what was done to the run.
    For each of the two runs, with its number 0 or 1 behind the name: `poses` (3 N numbers: x, y,
    heading of each robot, or None where it is absent), `robots` ([activity, age of its timer in 1/8
    of the limit or None, mark, robot it follows] of each), `kinds` (the number of each robot's
    kind; empty where there are none), `items` (x, y of each that is stored),
    `requested` ([x, y, carrier] of each that is asked for; where it names its dock, also the dock's
    letter and the name of its colour), `late` (indices of those that are overdue), `waiting` (how
    many orders wait), `deliveries` (their times), `charge` (of each robot's battery in percent, if
    there are any) and `stations` ([x, y, whether it works]).
    """
    message: Message = {
        "fixed": fixed_data(session),
        **{name: getattr(session, name) for name in _SESSION_FIELDS},
        "time": round(session.state.time, 3),
        "over": session.is_over,
        "scenario": {name: getattr(session.scenario, name) for name in _SCENARIO_FIELDS},
        "obstacles": _millimetres(session.state.obstacle_position),
        "events": [[round(e.time, 1), e.label, e.words] for e in session.events],
        "selected": _selected(session),
    }
    for number, play in enumerate((session.run, session.beside)):
        message |= {f"{name}{number}": value for name, value in _arena(play).items()}
    return message


def changes_since(before: Message, after: Message) -> Message:
    """Return the entries of `after` that are not the same in `before`."""
    return {name: value for name, value in after.items() if before.get(name, ...) != value}


def encode(message: Message) -> str:
    """Return a message as JSON."""
    return json.dumps(message, separators=(",", ":"), allow_nan=False)


_check_types = validate_call(
    config=ConfigDict(strict=True, arbitrary_types_allowed=True, allow_inf_nan=False)
)
# Orders by name; the rest of an order is the arguments, which have to be of the right types.
_ORDERS: dict[str, Callable[..., object]] = {
    "pause": Session.pause,
    "step": Session.step,
    "speed": Session.set_speed,
    "next": Session.next_seed,
    "again": Session.restart,
    "compare": Session.compare,
    "select": Session.select,
    "choose": Session.choose_mode,
    "break": Session.break_robot,
    "repair": Session.repair_robot,
    "toggle": Session.toggle_robot,
    "resize": Session.resize,
    "show": Session.show_fault,
    "widen": Session.set_delivery_width,
}


def obey(session: Session, text: str) -> None:
    """Do what an order, a JSON object such as {"do": "toggle", "robot": 3}, says.

    Raises:
        SwarmLogisticsError: it says nothing that can be done.
    """
    try:
        arguments = json.loads(text)
        act = _ORDERS[arguments.pop("do")]
    except (ValueError, RecursionError, LookupError, TypeError, AttributeError):
        raise SetupError(
            f'order: should be a JSON object whose "do" is one of {", ".join(_ORDERS)}'
        ) from None
    try:
        _check_types(act)(session, **arguments)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        argument = ".".join(str(part) for part in first["loc"])
        raise SetupError(f"order {argument}: {first['msg']}") from None


def rehearse(session: Session) -> None:
    """Do with a copy of a session what a page may ask for, so that all of it is compiled."""
    # A policy that fails tells the page so, once it plays.
    with contextlib.suppress(Exception, SystemExit):
        copy = Session(
            session.scenario, session.policy, session.against, session.seed, load=session.load
        )
        for mode in ("FM4", "away", "removed"):
            copy.choose_mode(mode)
            copy.select(0)
            copy.break_robot()
            copy.step()
            frame_message(copy)
            copy.run.world.set_faults(())  # who is away comes back
        copy.show_fault()
        copy.step()


def _arena(play: Play) -> Message:
    state = play.world.state
    scenario = play.world.scenario
    poses: list[int | None] = []
    robots: list[list[Any] | None] = []
    positions = _millimetres(state.robot_position)
    ages = state.robot_timer / scenario.timer_limit
    for robot in range(state.n_robots):
        if not state.robot_present[robot]:
            poses += [None, None, None]
            robots.append(None)
            continue
        poses += [*positions[robot], round(1000 * float(state.robot_heading[robot]))]
        age = int(_TIMER_STEPS * ages[robot]) if ages[robot] < 1.0 else None
        mark = palette.mark(state.failure_modes[robot])
        robots.append(
            [palette.activity(state, robot), age, mark, palette.leader_of(state, scenario, robot)]
        )
    requested = state.item_requested
    stored = state.item_status == STORED
    requested_positions = _millimetres(state.item_position[requested])
    carriers = state.item_carrier[requested].tolist()
    labels = _dock_labels(scenario, state.item_docks[requested].tolist())
    return {
        "poses": poses,
        "robots": robots,
        "kinds": state.robot_kind.tolist() if scenario.robot_kinds else [],
        "items": _millimetres(state.item_position[stored & ~requested]),
        "requested": [
            [*position, carrier, *label]
            for position, carrier, label in zip(requested_positions, carriers, labels, strict=True)
        ],
        "late": np.flatnonzero(state.item_late[requested]).tolist(),
        "waiting": state.n_waiting,
        "deliveries": [round(time, 1) for time in state.delivery_times],
        "charge": _percent(state.robot_charge) if scenario.battery is not None else [],
        "stations": [
            [*position, bool(works)]
            for position, works in zip(
                _millimetres(state.batteries.station_position), state.stations_working, strict=True
            )
        ],
    }


def _dock_labels(scenario: Scenario, docks: list[int]) -> list[tuple[str, ...]]:
    """Return letter and colour of each dock; nothing where requests name none."""
    if scenario.plan is None or not scenario.names_docks:
        return [()] * len(docks)
    names = scenario.plan.dock_names
    return [(names[dock], dock_hue(dock)) if dock != NOBODY else () for dock in docks]


def _selected(session: Session) -> Message | None:
    robot = session.selected
    if robot is None:
        return None
    state = session.state
    kinds = session.scenario.robot_kinds
    observation = unflatten(session.run.world.observe()[robot], session.scenario)
    beams = np.min([observation[f"range_{kind}"] for kind in ("robots", "walls", "items")], axis=0)
    return {
        "robot": robot,
        "activity": palette.activity(state, robot),
        "kind": kinds[state.robot_kind[robot]].name if kinds else "",
        "modes": list(state.failure_modes[robot]),
        "beams": [round(float(reach), 3) for reach in beams],
        "reach": round(float(state.ranger_range[robot]), 3),
        "view": round(float(state.view_range[robot]), 3),
        # Adding 0.0 turns a negative zero into zero.
        "row": {
            name: [round(value, 2) + 0.0 for value in part.tolist()]
            for name, part in observation.items()
        },
    }


def _millimetres(positions: NDArray[np.float64]) -> list[list[int]]:
    rounded: list[list[int]] = np.rint(1000.0 * positions).astype(int).tolist()
    return rounded


def _percent(shares: NDArray[np.float64]) -> list[int]:
    percent: list[int] = np.rint(100.0 * shares).astype(int).tolist()
    return percent


_SPACING = 0.5  # [s] between frames; the page draws what lies between
# Frames times robots of a recording, so that its memory is bounded: some 10 MB of text.
MOST_POSES = 100_000


class Recording:
    """What a session has shown of its present episode.

    Beyond `MOST_POSES` every second frame goes, and further ones are as far apart.

    Args:
        session: the session; call `note` after each of its steps.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._play: object = None
        self._last: Message = {}
        self._messages: list[str] = []
        self._spacing = _SPACING

    def note(self) -> None:
        """Keep the session as it is now, if it has gone on far enough."""
        session = self._session
        if session.run is not self._play:  # another episode
            self._play = session.run
            self._last = {}
            self._messages = []
            self._spacing = _SPACING
        time = session.state.time
        if self._last and time < self._last["time"] + self._spacing - 1e-9 and not session.is_over:
            return
        present = {**frame_message(session), "selected": None, "note": "", "paused": False}
        message = changes_since(self._last, present)
        if message:
            self._messages.append(encode(message))
        self._last = present
        if len(self._messages) * session.state.n_robots > MOST_POSES:
            self._leave_out_every_second()

    def _leave_out_every_second(self) -> None:
        changes: list[Message] = [json.loads(message) for message in self._messages]
        pairs = zip_longest(changes[1::2], changes[2::2], fillvalue=Message())
        merged = [earlier | later for earlier, later in pairs]
        self._messages = [encode(message) for message in (changes[0], *merged)]
        self._spacing *= 2.0

    def text(self) -> str:
        """Return the message that tells a page what was played."""
        return f'{{"past":[{",".join(self._messages)}]}}'

    def page(self) -> str:
        """Return the recording as an HTML page that loads nothing."""
        self.note()
        return _page_around(self.text())


def recorded_page(session: Session, until: float) -> str:
    """Play a session up to a time [s], or to its end; return the page that replays it."""
    recording = Recording(session)
    recording.note()
    while not session.is_over and session.state.time < until - 1e-9:
        session.advance()
        recording.note()
    return recording.page()


# The files of the page and their types, in the order in which a recording has them.
FILES = {
    "page.html": "text/html",
    "page.css": "text/css",
    "plan.js": "text/javascript",
    "draw.js": "text/javascript",
    "legend.js": "text/javascript",
    "panel.js": "text/javascript",
    "senses.js": "text/javascript",
    "page.js": "text/javascript",
}


def text_of_file(name: str) -> str:
    """Return one of `FILES`."""
    return resources.files(__package__).joinpath("web", name).read_text(encoding="utf-8")


def _page_around(text: str) -> str:
    packed = base64.b64encode(zlib.compress(text.encode(), 9)).decode()
    page, css, *scripts = map(text_of_file, FILES)
    script = "\n".join(scripts)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    head, _, body, _, end = re.split("<!-- /?(?:files|scripts) -->", page)
    return (
        f'{head}<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<style>{css}</style>{body}"
        f'<script type="application/octet-stream" id="recording">{packed}</script>'
        f"<script>{script}</script>{end}"
    )
