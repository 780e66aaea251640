"""What a page is sent of worlds of all kinds, as recorded."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from swarm_logistics_env import Scenario
from swarm_logistics_env.views.watch import Session
from swarm_logistics_env.views.watch.messages import Recording, frame_message, obey
from tests.conftest import Check

SIZE: dict[str, Any] = {"n_robots": 6, "n_items": 8}
KINDS: Any = "porter:4 max_speed=0.5, runner:2 max_speed=1.5 robot_radius=0.1"
SESSIONS: dict[str, dict[str, Any]] = {
    "obstacles": {
        "scenario": Scenario(warehouse_width=5, warehouse_height=4, n_obstacles=2, **SIZE),
        "faults": ["FM1:2@3", "dead@6+2"],
        "policy": "swarm-dt-follow",
    },
    "day": {"scenario": Scenario.preset("day").replace(**SIZE), "policy": "homing"},
    "orders": {
        "scenario": Scenario.preset("orders").replace(**SIZE),
        "policy": "homing",
        "against": "homing-stock",
    },
    "docks and kinds": {
        "scenario": Scenario(
            floor="two_docks",
            request_docks="random",
            robot_kinds=KINDS,
            **SIZE,
        ),
        "policy": "homing",
        "seed": 4,
    },
}
ORDERS: tuple[dict[str, Any], ...] = (
    {"do": "select", "robot": 2},
    {"do": "choose", "mode": "motor_slow"},
    {"do": "break"},
    {"do": "toggle", "robot": 4},
    {"do": "resize", "n_robots": 7},
    {"do": "widen", "width": 1.0},
    {"do": "select", "robot": 2},
)


def lines_of(session: Session) -> Iterator[str]:
    """Yield each entry of the page's first frame, and of frames after what it may ask for."""
    recording = Recording(session)
    before: dict[str, Any] = {}
    for order in (None, *ORDERS):
        if order is not None:
            try:
                obey(session, json.dumps(order))
            except ValueError as error:
                yield f"{order['do']}: {error}"
        for _ in range(30):
            session.advance()
            recording.note()
        frame = json.loads(json.dumps(frame_message(session)))
        for name, value in frame.items():
            if value != before.get(name, ...):
                yield f"{order and order['do']}, {name}: {json.dumps(value)[:900]}"
        before = frame
    yield f"recording: {recording.text()[:2000]}"


def test_messages_are_as_recorded(check_recorded: Check) -> None:
    lines = [
        f"{name}: {line}"
        for name, arguments in SESSIONS.items()
        for line in lines_of(Session(**arguments))
    ]
    check_recorded("messages.txt", lines)
