"""A recording of a session as one page that needs no server."""

from __future__ import annotations

import base64
import hashlib
import zlib
from importlib import resources
from typing import Any

from swarm_logistics_env.watch.session import Session

from .messages import changes, encode, fixed_data, frame

_SPACING = 0.5  # [s] between frames; the page draws what lies between


class Recording:
    """What a session has shown of its present episode.

    Args:
        session: the session; call `note` after each of its steps.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._play: object = None
        self._last: dict[str, Any] = {}
        self._messages: list[str] = []

    def note(self) -> None:
        """Keep the session as it is now, if it has gone on far enough."""
        session = self._session
        if session.run is not self._play:  # another episode
            self._play, self._last, self._messages = session.run, {}, []
        time = session.run.world.state.time
        if self._last and time < self._last["time"] + _SPACING - 1e-9 and not session.is_over:
            return
        now = {**frame(session), "selected": None, "note": "", "paused": False}
        message = changes(self._last, now)
        if message:
            self._messages.append(encode(message))
        self._last = now

    def page(self) -> str:
        """Return the recording as an HTML page that loads nothing."""
        self.note()
        frames = ",".join(self._messages)
        text = f'{{"fixed":{encode(fixed_data(self._session))},"frames":[{frames}]}}'
        return _page_around(text)


def recorded_page(session: Session, until: float) -> str:
    """Play a session up to a time [s], or to its end; return the page that replays it."""
    recording = Recording(session)
    recording.note()
    while not session.is_over and session.run.world.state.time < until - 1e-9:
        session.advance()
        recording.note()
    return recording.page()


def _page_around(text: str) -> str:
    packed = base64.b64encode(zlib.compress(text.encode(), 9)).decode()
    page, css, *scripts = (
        resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
        for name in ("page.html", "page.css", "draw.js", "panel.js", "page.js")
    )
    script = "\n".join(scripts)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    head, tail = page.split("<!-- files -->")[0], page.split("<!-- /files -->")[1]
    body, end = tail.split("<!-- scripts -->")[0], tail.split("<!-- /scripts -->")[1]
    return (
        f'{head}<meta http-equiv="Content-Security-Policy" content="{policy}">'
        f"<style>{css}</style>{body}"
        f'<script type="application/octet-stream" id="recording">{packed}</script>'
        f"<script>{script}</script>{end}"
    )
