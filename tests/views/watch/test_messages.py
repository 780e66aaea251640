"""Recordings: what a page replays of a session."""

from __future__ import annotations

import base64
import itertools
import json
import re
import zlib
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.views.watch import Session, messages
from swarm_logistics_env.views.watch.messages import Recording, frame_message

SMALL = Scenario(n_robots=8, n_items=10, duration=20.0, warehouse_width=5, warehouse_height=5)


def test_a_recording_begins_anew_with_each_episode() -> None:
    session = Session(SMALL)
    recording = Recording(session)
    for _ in range(2):
        recording.note()
        for _ in range(23):
            session.advance()
            recording.note()
        times = [frame["time"] for frame in frames_of(recording)]
        assert times == [0.0, 0.5, 1.0, 1.5, 2.0]
        session.next_seed()
    recording.note()
    (packed,) = re.findall(r'id="recording">([^<]+)<', recording.page())
    first, *later_frames = json.loads(zlib.decompress(base64.b64decode(packed)))["past"]
    assert (first["seed"], first["time"], later_frames) == (2, 0.0, [])


def test_a_battery_that_wears_is_offered_where_robots_have_one() -> None:
    for scenario, is_offered in ((SMALL, False), (SMALL.replace(battery=5_000.0), True)):
        modes = [mode["name"] for mode in messages.fixed_data(Session(scenario))["modes"]]
        assert ("cell_fades" in modes) is is_offered
        assert "FM1" in modes


def frames_of(recording: Recording) -> list[dict[str, Any]]:
    """Return the frames that a page makes of a recording."""
    frames: list[dict[str, Any]] = [{}]
    frames += itertools.accumulate(json.loads(recording.text())["past"], dict.__or__)
    return frames[1:]


def test_a_long_recording_is_bounded_and_its_frames_stay_right(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    session = Session(SMALL.replace(duration=60.0, restock=True), "homing", faults=["FM4:2@7"])
    recording = Recording(session)
    shown = {}
    monkeypatch.setattr(messages, "MOST_POSES", 8 * 40)
    while not session.is_over:
        frame = json.loads(json.dumps(frame_message(session)))
        shown[frame["time"]] = {**frame, "note": "", "paused": False}  # which nobody replays
        recording.note()
        session.advance()
    recording.note()
    frames = frames_of(recording)
    times = [frame["time"] for frame in frames]
    assert len(frames) <= 40
    assert (times[0], times[-1]) == (0.0, session.state.time)
    assert np.diff(times) == pytest.approx(2.0)  # every second went, twice
    assert frames[:-1] == [shown[time] for time in times[:-1]]
    failed = [sum(robot[2] == "4" for robot in frame["robots0"]) for frame in frames]
    assert failed == [2 if time >= 7.0 else 0 for time in times]


def test_the_age_of_a_timer_is_told_until_it_has_run_out() -> None:
    session = Session(SMALL)
    session.state.robot_timer[:2] = 0.5 * SMALL.timer_limit, SMALL.timer_limit
    ages = [robot[1] for robot in frame_message(session)["robots0"]]
    assert ages[:2] == [4, None]
