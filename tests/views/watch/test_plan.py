from __future__ import annotations

import base64
import json
import re
import zlib

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.views.watch import Session
from swarm_logistics_env.views.watch.messages import fixed_data, frame_message, obey, recorded_page

ROWS = "A.::#B\nA.:=:B\n..:=:."
PLANNED = Scenario(floor=ROWS, n_robots=1, n_items=2, request_docks="random", duration=5.0)


def test_the_plan_is_told_once_in_millimetres() -> None:
    session = Session(PLANNED)
    plan = fixed_data(session)["plan"]
    assert plan["walls"] == [[2000, 1000, 2500, 1500]]
    assert plan["racks"] == [[1500, 0, 2000, 1000]]
    assert plan["start"] == []
    assert [(dock["letter"], dock["boxes"]) for dock in plan["docks"]] == [
        ("A", [[0, 500, 500, 1500]]),
        ("B", [[2500, 500, 3000, 1500]]),
    ]
    assert len({dock["hue"] for dock in plan["docks"]}) == 2
    for colours in fixed_data(session)["colours"].values():
        assert {"WALL", "RACK", *(dock["hue"] for dock in plan["docks"])} <= set(colours)
    assert "plan" not in frame_message(session)
    assert fixed_data(Session(Scenario(n_robots=1, n_items=1)))["plan"] is None
    (packed,) = re.findall(r'id="recording">([^<]+)<', recorded_page(session, 1.0))
    first, *_ = json.loads(zlib.decompress(base64.b64decode(packed)))["past"]
    assert first["fixed"]["plan"] == plan


def test_requests_tell_the_dock_that_they_name() -> None:
    session = Session(PLANNED)
    hues = {dock["letter"]: dock["hue"] for dock in fixed_data(session)["plan"]["docks"]}
    for dock, letter in enumerate("AB"):
        session.state.requested_docks[:] = dock
        ((_, _, _, *label),) = frame_message(session)["requested0"]
        assert label == [letter, hues[letter]]
    free = Session(PLANNED.replace(request_docks="any"))
    assert [len(request) for request in frame_message(free)["requested0"]] == [3]


def test_the_delivery_width_that_a_plan_makes_is_refused() -> None:
    session = Session(PLANNED)
    session.play(1.0)
    with pytest.raises(
        SetupError, match=r"delivery_width = 2: .* plan of 6 x 3 cells has the docks"
    ):
        obey(session, '{"do": "widen", "width": 2.0}')
    assert session.scenario == session.beside.world.scenario == PLANNED
    session.resize(2)  # what the plan leaves open
    assert session.scenario.floor == PLANNED.floor
