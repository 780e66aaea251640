"""Connections to the server that are silent, slow or many: they end, and shut nobody out."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
import time
from typing import Any

import pytest

from swarm_logistics_env.views.watch import server
from swarm_logistics_env.views.watch.server import LOOPBACK
from tests.views.watch.conftest import LONG, Served, ask, messages, wait_until


def silent(served: Served, request: str) -> socket.socket:
    """Return a connection that asks once, and neither reads nor answers after that."""
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.settimeout(LONG)
    connection.connect((LOOPBACK, served.server.port))
    connection.sendall(request.format(token=served.server.token, port=served.server.port).encode())
    return connection


def n_open(served: Served) -> int:
    """Return how many connections the server has."""
    inner = served.server._runner.server
    assert inner is not None
    return len(inner.connections)


PAGE = (
    "GET /{token}/live HTTP/1.1\r\nHost: localhost:{port}\r\nUpgrade: websocket\r\n"
    "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
)
SILENT = {
    "pages": PAGE,
    "files": "GET /{token}/draw.js HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n" * 20,
    "half a request": "GET /{token}/ HTTP/1.1\r\nHost: loc",
    "nothing": "",
}


@pytest.mark.parametrize("kind", SILENT)
def test_connections_that_neither_read_nor_answer_end_and_shut_nobody_out(
    kind: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(server, "_SHORTEST_SILENCE", 0.0)
    if kind == "pages":
        monkeypatch.setattr(server, "_HEARTBEAT", 0.5)
    served = Served()
    waiting = [silent(served, SILENT[kind]) for _ in range(16 if kind == "pages" else 100)]
    try:
        if kind == "pages":
            for connection in waiting:
                with contextlib.suppress(ConnectionError):
                    while connection.recv(1 << 16):  # until it is closed
                        pass
            monkeypatch.setattr(server, "_HEARTBEAT", LONG)
        else:
            assert ask(served, "")[0] == 200
            assert len(messages(served, [], 3)) == 3
            with monkeypatch.context() as hurried:
                hurried.setattr(server, "_LONGEST_SILENCE", 0.0)
                wait_until(lambda: n_open(served) == 0)
        assert len(messages(served, [], 3)) == 3
    finally:
        served.stop()
        for connection in waiting:
            connection.close()
    assert len(capfd.readouterr().err) < 1000


def test_a_connection_that_cannot_be_accepted_shuts_no_other_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    accept = asyncio.SelectorEventLoop.sock_accept
    refusals = [OSError(errno.EMFILE, "too many open files")] * 2

    async def accept_the_third(loop: Any, listening: socket.socket) -> Any:
        if refusals:
            raise refusals.pop()
        return await accept(loop, listening)

    monkeypatch.setattr(asyncio.SelectorEventLoop, "sock_accept", accept_the_third)
    served = Served()
    try:
        assert ask(served, "")[0] == 200
    finally:
        served.stop()
    assert refusals == []


def test_of_pages_that_open_in_one_moment_all_are_answered(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server, "_SHORTEST_SILENCE", LONG)
    request = "GET /{token}/ HTTP/1.1\r\nHost: localhost:{port}\r\n\r\n"
    asking = [silent(served, "") for _ in range(200)]
    text = request.format(token=served.server.token, port=served.server.port).encode()
    for connection in asking:
        connection.sendall(text)
    answers = []
    for connection in asking:
        with connection, connection.makefile("rb") as answer:
            answers.append(answer.read().partition(b"\r\n")[0])
    assert answers == [b"HTTP/1.1 200 OK"] * 200


def test_a_page_that_reads_nothing_is_dropped_and_holds_up_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(server, "_PATIENCE", LONG)
    monkeypatch.setattr(
        server, "frame_message", lambda session: {"long": f"{time.time()}" * 20_000}
    )
    served = Served()
    slow = silent(served, PAGE)
    try:
        wait_until(lambda: len(served.server._pages) == 1)
        (page,) = served.server._pages
        wait_until(lambda: page._transport.get_write_buffer_size() > 0)
        assert len(messages(served, [], 6)) == 6
        assert page in served.server._pages
        monkeypatch.setattr(server, "_PATIENCE", 0.0)
        wait_until(lambda: not served.server._pages)
    finally:
        served.stop()
        slow.close()
