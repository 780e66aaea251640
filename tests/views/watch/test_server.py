"""The server: what it serves, to whom, and what it refuses."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import os
import random
import signal
import socket
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import aiohttp
import pytest
from aiohttp.http_exceptions import BadHttpMessage

from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.views.watch import Session, server
from swarm_logistics_env.views.watch.server import WatchServer, serve
from tests.views.watch.conftest import LONG, SMALL, Served, ask, messages, wait_until


@pytest.fixture(scope="module")
def shared() -> Iterator[Served]:
    """One server for all tests that change nothing of its session."""
    running_server = Served()
    yield running_server
    running_server.stop()


def test_page_and_scripts_come_with_a_content_policy(shared: Served) -> None:
    for name in ("", "page.css", "draw.js", "panel.js", "page.js"):
        status, body, headers = ask(shared, name)
        assert status == 200
        assert body
        policy = headers["Content-Security-Policy"]
        assert "default-src 'none'; script-src 'self'" in policy
        assert "frame-ancestors 'none'" in policy
        assert headers.items() >= {
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("X-Content-Type-Options", "nosniff"),
        }


def test_what_was_played_is_saved_as_a_page_of_its_own(shared: Served) -> None:
    status, body, headers = ask(shared, "recording.html")
    assert status == 200
    assert headers["Content-Type"].startswith("text/html")
    assert headers["Content-Disposition"] == 'attachment; filename="run.html"'
    assert b'id="recording"' in body


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "swarm.example"},
        {"Host": "192.168.0.7:8765"},
        {"Host": "127.0.0.1.swarm.example:8765"},
        {"Host": "127.0.0.1:8765.swarm.example"},
        {"Host": ""},
        {"Origin": "http://swarm.example"},
        {"Origin": "null"},
        {"Origin": "https://127.0.0.1"},
    ],
)
def test_other_hosts_and_origins_are_refused(shared: Served, headers: dict[str, str]) -> None:
    for name in ("", "live", "recording.html"):
        assert ask(shared, name, **headers)[0] == 403


def test_without_the_token_nothing_is_served(shared: Served) -> None:
    token = shared.server.token
    wrong = token[:-1] + ("a" if token[-1] != "a" else "b")
    for path in ("/", "/page.js", f"/{wrong}/", f"/{wrong}/live", "//", "/%ff/"):
        status, body, _ = ask(shared, path)
        assert status == 403, path
        assert token.encode() not in body


@pytest.mark.parametrize(
    "name", ["server.py", "../server.py", "..%2fserver.py", "%2e%2e/session.py", "/etc/passwd"]
)
def test_serves_no_other_file(shared: Served, name: str) -> None:
    status, body, _ = ask(shared, f"/{shared.server.token}/{name}")
    assert status in (403, 404)
    assert b"import" not in body


def test_listens_on_loopback_only(shared: Served) -> None:
    listening = shared.server._listening
    assert listening is not None
    assert listening.getsockname()[0] == "127.0.0.1"


def test_the_page_is_shown_once_it_is_served() -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    pages = []

    def show(address: str) -> None:
        try:
            with urllib.request.urlopen(address, timeout=LONG) as answer:
                pages.append(answer.read())
        finally:
            os.kill(os.getpid(), signal.SIGINT)

    try:
        serve(Session(SMALL), 0, lambda sentence: None, show=show)
    finally:
        signal.signal(signal.SIGINT, before)
    assert b"R, robustness: " in pages[0]


def test_frames_hold_what_changed_and_orders_are_obeyed(served: Served) -> None:
    assert served.server.session.run.world.state.step == 0  # no page was open
    past, first, second = messages(served, [], 3)
    assert [frame["time"] for frame in past["past"]] == [0.0]
    assert "swarm-dt" in first["fixed"]["choices"]
    assert len(first["poses0"]) == len(first["poses1"]) == 18
    assert second["time"] > first["time"]
    assert not {"scenario", "fixed"} & set(second)
    orders = [
        {"do": "choose", "mode": "FM1"},
        {"do": "toggle", "robot": 3},
        {"do": "pause"},
        {"do": "no such order"},  # its refusal tells that the others are done
    ]
    assert "problem" in messages(served, [json.dumps(order) for order in orders], 99)[-1]
    session = served.server.session
    assert session.run.world.state.failure_modes[3] == ("FM1",)
    assert not session.beside.world.state.failed.any()
    assert session.paused
    frames = messages(served, [], 1)[0]["past"]  # whoever comes later is told what was played
    assert frames[0]["time"] == 0.0
    assert frames[-1]["time"] > 0.0


@pytest.mark.parametrize(
    ("order", "words"),
    [
        ('{"do":"toggle","robot":99}', "robot = 99"),
        ('{"do":"select","robot":"3"}', "valid integer"),
        ('{"do":"compare","policy":"os:abort"}', "no policy 'os:abort'"),
        ('{"do":"widen","width":NaN}', "order"),
        ("[]", "order"),
        ("[" * 3000, "order"),
    ],
)
def test_order_that_cannot_be_is_refused_in_a_sentence(
    shared: Served, order: str, words: str
) -> None:
    assert words in messages(shared, [order], 10)[-1]["problem"]


def test_a_message_that_is_too_long_ends_its_page_alone(served: Served) -> None:
    async def talk() -> int | None:
        live = f"{served.server.address}live"
        async with aiohttp.ClientSession() as client, client.ws_connect(live) as page:
            await page.send_str('{"do":"select","robot":' + " " * 5000 + "3}")
            while (await page.receive(LONG)).type is aiohttp.WSMsgType.TEXT:
                pass  # frames that are under way
            return page.close_code

    assert asyncio.run(talk()) == aiohttp.WSCloseCode.MESSAGE_TOO_BIG
    assert served.server.session.selected is None
    assert messages(served, [], 1)


def test_more_pages_than_there_may_be_are_refused(served: Served) -> None:
    async def open_pages() -> int:
        live = f"{served.server.address}live"
        async with aiohttp.ClientSession() as client, contextlib.AsyncExitStack() as pages:
            for _ in range(16):
                await pages.enter_async_context(client.ws_connect(live))
            with pytest.raises(aiohttp.WSServerHandshakeError) as refused:
                await client.ws_connect(live)
            async with client.get(live) as answer:
                assert "16 pages are open" in await answer.text()
                assert int(answer.headers["Retry-After"]) > 0
        return refused.value.status

    assert asyncio.run(open_pages()) == 503


def test_malformed_requests_neither_stop_it_nor_leak_a_path(
    served: Served, capfd: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    rng = random.Random(7)
    token = served.server.token.encode()
    answered = 0
    for _ in range(200):
        line = rng.choice(
            [b"GET / HTTP/1.1", b"GET /" + token + b"/../../x HTTP/1.1", b"POST /" + token,
             b"\0", rng.randbytes(20), b"GET /" + b"a" * 70000 + b" HTTP/1.1"]
        )  # fmt: skip
        header = rng.choice([b"Host: evil", b"no colon", b"Content-Length: x", rng.randbytes(30)])
        answer = b""
        address = ("127.0.0.1", served.server.port)
        with contextlib.suppress(OSError), socket.create_connection(address, timeout=LONG) as peer:
            peer.sendall(line + b"\r\n" + header + b"\r\nConnection: close\r\n\r\n")
            while part := peer.recv(1 << 16):  # it is closed on a request that was too long
                answer += part
        answered += bool(answer)
        assert not any(secret in answer for secret in (b"/usr/", b".py", b"Traceback"))
    assert answered > 50
    assert ask(served, "")[0] == 200
    assert "Traceback" not in capfd.readouterr().err
    assert caplog.messages == []


def test_where_it_cannot_listen_is_told_in_a_sentence(shared: Served) -> None:
    with pytest.raises(SetupError, match="in use; --port 0 takes any that is free"):
        asyncio.run(WatchServer(Session(SMALL), shared.server.port).start())


RAISING = """
import numpy as np

class Raising:
    def reset(self, n_robots, seed): self.left = 5
    def act(self, observations):
        self.left -= 1
        if not self.left: raise ValueError("boom in my controller")
        return np.zeros((len(observations), 4))
class Leaving(Raising):
    def reset(self, n_robots, seed): raise SystemExit(3)
"""


def test_a_policy_that_fails_is_told_to_the_page_and_the_server_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "raising_policy.py").write_text(RAISING)
    monkeypatch.syspath_prepend(tmp_path)
    session = Session(SMALL, "raising_policy:Raising", speed=8.0)
    session.choices = (*session.choices, "raising_policy:Leaving")
    served = Served(session)
    try:
        got = messages(served, [], lambda message: bool(message.get("failure")))
        reason = "ValueError: boom in my controller, raising_policy.py line 8"
        assert got[-1]["failure"] == reason
        order = json.dumps({"do": "compare", "policy": "raising_policy:Leaving"})
        got = messages(served, [order], 99)
        assert got[-1]["problem"] == "SystemExit: 3, raising_policy.py line 11"
        order = json.dumps({"do": "compare", "policy": "homing"})
        got = messages(served, [order], lambda message: message.get("time", 0.0) > 3.0)
        assert {"policy": "homing", "failure": ""}.items() <= {
            name: value for message in got[-20:] for name, value in message.items()
        }.items()
    finally:
        served.stop()


def test_a_note_ends_and_no_page_that_is_opened_later_shows_it(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "_NOTE_LASTS", LONG)
    order = json.dumps({"do": "toggle", "robot": 3})
    assert messages(served, [order], lambda message: bool(message.get("note")))
    assert "note" not in messages(served, [], 2)[-1]
    monkeypatch.setattr(server, "_NOTE_LASTS", 0.0)
    wait_until(lambda: not served.server.session.note)


@pytest.mark.parametrize(
    ("error", "is_own"),
    [(ValueError(), True), (ConnectionResetError(), False), (BadHttpMessage("no HTTP"), False)],
)
def test_errors_of_those_who_ask_are_not_logged(error: Exception, is_own: bool) -> None:
    record = logging.LogRecord("x", logging.ERROR, "", 0, "", (), (type(error), error, None))
    assert server._is_own_error(record) == is_own
    record.exc_info = None
    assert server._is_own_error(record)
