"""A recording holds what the present episode showed."""

from __future__ import annotations

import base64
import json
import re
import zlib
from typing import Any

from swarm_logistics_env.watch import Session
from swarm_logistics_env.watch.messages import Recording
from tests.watch.conftest import SMALL


def frames_of(page: str) -> list[dict[str, Any]]:
    (packed,) = re.findall(r'id="recording">([^<]+)<', page)
    frames: list[dict[str, Any]] = json.loads(zlib.decompress(base64.b64decode(packed)))["frames"]
    return frames


def test_a_recording_begins_anew_with_each_episode() -> None:
    session = Session(SMALL)
    recording = Recording(session)
    for _ in range(2):
        recording.note()
        for _ in range(20):
            session.advance()
            recording.note()
        session.next_seed()
    recording.note()
    first, *others = frames_of(recording.page())
    assert (first["seed"], first["time"]) == (2, 0.0)
    assert others == []
