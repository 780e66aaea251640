from __future__ import annotations

import contextlib
import http.client
import json
import random
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import FAILURE_MODES, Fault, Scenario, policies
from swarm_logistics_env.errors import SetupError, SwarmLogisticsError
from swarm_logistics_env.watch import Session
from swarm_logistics_env.watch.web import WatchServer
from swarm_logistics_env.watch.web.orders import obey
from swarm_logistics_env.watch.web.view import fixed_view, moving_view

ROOT = Path(__file__).parents[2]
SMALL = Scenario(n_robots=6, n_items=8, n_obstacles=1, warehouse_width=5, warehouse_height=5)


def new_session(**scenario: Any) -> Session:
    return Session(SMALL.replace(**scenario), lambda: policies.load("swarm-dt"))


@pytest.fixture
def server() -> Iterator[WatchServer]:
    with WatchServer(new_session(), "swarm-dt", 0) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def connect(server: WatchServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.server_address[1]), timeout=10)


def ask(
    server: WatchServer,
    path: str,
    order: object = None,
    method: str | None = None,
    **headers: str,
) -> tuple[int, bytes, dict[str, str]]:
    """Ask for a path below the token, or for any that begins with a slash."""
    connection = http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=10)
    body = None if order is None else json.dumps(order)
    if order is not None:
        headers = {"Content-Type": "application/json", **headers}
    target = path if path.startswith("/") else f"/{server.token}/{path}"
    connection.request(method or ("GET" if order is None else "POST"), target, body, headers)
    answer = connection.getresponse()
    got = answer.status, answer.read(), dict(answer.getheaders())
    connection.close()
    return got


def test_listens_on_loopback_only(server: WatchServer) -> None:
    assert server.socket.getsockname()[0] == "127.0.0.1"
    assert server.address.startswith("http://127.0.0.1:")


@pytest.mark.parametrize(
    ("name", "kind", "words"),
    [("", "text/html", b"<!doctype"), ("page.js", "text/javascript", b"use strict"),
     ("page.css", "text/css", b"body")],
)  # fmt: skip
def test_page_and_nothing_from_elsewhere(
    server: WatchServer, name: str, kind: str, words: bytes
) -> None:
    status, body, headers = ask(server, name)
    assert status == 200
    assert headers["Content-Type"].startswith(kind)
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["Cache-Control"] == "no-store"
    assert "Python" not in headers["Server"]
    assert words in body
    assert b"//" not in body.replace(b"// ", b"")  # no address of anything


def test_what_the_page_draws_is_the_session(server: WatchServer) -> None:
    fixed = json.loads(ask(server, "fixed")[1])
    assert fixed["title"] == "swarm-dt"
    assert [mode["name"] for mode in fixed["modes"]] == list(FAILURE_MODES)
    moving = json.loads(ask(server, "moving?after=0")[1])
    state = server.session.run.world.state
    assert [robot[:2] for robot in moving["robots"]] == [
        [pytest.approx(x, abs=1e-3), pytest.approx(y, abs=1e-3)] for x, y in state.robot_position
    ]
    assert len(moving["items"]) == 8
    assert len(moving["obstacles"]) == 1
    assert moving["trails"] == []
    server.session.play(1.0)
    trails = json.loads(ask(server, "moving?after=0&trails=1")[1])["trails"]
    past = server.session.trails.positions()
    assert np.allclose(np.array(trails).swapaxes(0, 1), past, atol=1e-3)


def test_orders(server: WatchServer) -> None:
    session = server.session
    for order in (
        {"do": "select", "robot": 2},
        {"do": "choose", "mode": "FM1"},
        {"do": "press", "key": "b"},
        {"do": "toggle", "robot": 3},
        {"do": "widen", "width": 2},
    ):
        assert ask(server, "order", order)[0] == 200
    assert session.run.world.state.failure_modes == ((), (), ("FM1",), ("FM1",), (), ())
    assert session.scenario.delivery_width == 2.0
    moving = json.loads(ask(server, "moving?after=0")[1])
    assert moving["robots"][3][5] == "1"
    assert [event[1:] for event in moving["events"]] == [[2, "1"], [3, "1"]]
    assert moving["selected"]["robot"] == 3
    assert dict(moving["selected"]["row"])["carrying"] == "no"
    assert ask(server, "order", {"do": "resize", "n_robots": 4})[0] == 200
    assert session.scenario.n_robots == 4


@pytest.mark.parametrize(
    ("order", "words"),
    [
        ({"do": "toggle", "robot": 99}, "robot = 99"),
        ({"do": "choose", "mode": "FM9"}, "FM9"),
        ({"do": "fly"}, "order"),
        ({"do": "select", "robot": "3"}, "valid integer"),
        ({"do": "select", "robot": 3, "also": 4}, "Unexpected keyword"),
        ([], "order"),
    ],
)
def test_order_that_cannot_be_is_refused_in_a_sentence(
    server: WatchServer, order: object, words: str
) -> None:
    status, body, _ = ask(server, "order", order)
    assert status == 400
    assert words in json.loads(body)["problem"]
    assert server.session.run.world.state.n_robots == 6


def test_bytes_that_are_no_order_change_nothing() -> None:
    session = new_session()
    rng = random.Random(0)
    for length in range(200):
        with pytest.raises(SwarmLogisticsError):
            obey(session, rng.randbytes(length))
    for text in (
        b'{"do":"widen","width":NaN}',
        b'{"do":"resize","n_robots":1e3}',
        b"null",
    ):
        with pytest.raises(SetupError):
            obey(session, text)
    assert session.events == []


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "swarm.example"},
        {"Host": "127.0.0.1.swarm.example:8765"},
        {"Host": "127.0.0.1:8765@swarm.example"},
        {"Host": ""},
        {"Origin": "http://swarm.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "https://127.0.0.1"},
    ],
)
@pytest.mark.parametrize("path", ["", "moving", "order"])
def test_other_hosts_and_origins_are_refused(
    server: WatchServer, headers: dict[str, str], path: str
) -> None:
    order = {"do": "toggle", "robot": 1} if path == "order" else None
    status, body, _ = ask(server, path, order, **headers)
    assert status == 403
    assert b"robot" not in body
    assert not server.session.run.world.state.failed.any()


def test_own_origin_and_names_of_this_machine_are_served(server: WatchServer) -> None:
    for host in ("localhost", "localhost:9000", "127.0.0.1:80", "[::1]:8765"):
        order = {"do": "select", "robot": 1}
        assert ask(server, "order", order, Host=host, Origin=f"http://{host}")[0] == 200


def test_without_the_token_nothing_is_served_or_done(server: WatchServer) -> None:
    wrong = server.token[:-1] + ("a" if server.token[-1] != "a" else "b")
    for path in ("/", "/page.js", f"/{wrong}/", f"/{wrong}/moving", f"/{server.token}", "//"):
        assert ask(server, path)[0] == 403, path
    assert ask(server, f"/{wrong}/order", {"do": "toggle", "robot": 1})[0] == 403
    assert not server.session.run.world.state.failed.any()
    assert server.token not in repr(ask(server, "/"))


@pytest.mark.parametrize(
    "name",
    ["server.py", "../server.py", "..%2fserver.py", "%2e%2e/session.py", "/etc/passwd",
     "page.html", "page.js/", "page.js%00", "....//x", "moving/../page.js", "\\etc\\passwd"],
)  # fmt: skip
def test_serves_no_other_file(server: WatchServer, name: str) -> None:
    status, body, _ = ask(server, f"/{server.token}/{name}")
    assert status == 404
    assert body == b"Not Found\n"


def test_orders_come_as_json_of_a_known_length(server: WatchServer) -> None:
    order = {"do": "toggle", "robot": 1}
    assert ask(server, "order", order, **{"Content-Type": "text/plain"})[0] == 415
    assert ask(server, "order", order, **{"Content-Length": "-1"})[0] == 411
    assert ask(server, "order", order, **{"Content-Length": "99999"})[0] == 413
    assert ask(server, "order")[0] == 404
    assert ask(server, "moving", order)[0] == 404
    assert ask(server, "order", method="DELETE")[0] == 501
    assert not server.session.run.world.state.failed.any()


def malformed(rng: random.Random, token: str) -> bytes:
    """Something between noise and nearly a request."""
    method = rng.choice([b"GET", b"POST", b"PUT", b"get", b"", b"\0", b"G" * 300, rng.randbytes(4)])
    path = rng.choice(
        [b"/", b"/../../etc/passwd", b"http://[", b"*", f"/{token}/order".encode(), b"/%",
         f"/{token}/moving?after=%ff&after[]=".encode(), f"/{token}/moving?after=\xb2".encode(),
         f"/{token}/../../x".encode(), rng.randbytes(20), b"/" + b"a" * rng.choice([10, 70000])]
    )  # fmt: skip
    version = rng.choice([b"HTTP/1.1", b"HTTP/1.0", b"HTTP/9.9", b"HTTP/a.b", b"", b"HTTP/1.1 x"])
    headers = [
        rng.choice(
            [b"Host: 127.0.0.1", b"Host:", b"Host: evil", b"Content-Length: 10", b"no colon",
             b"Content-Length: 99999999999999999999", b"Content-Length: x", rng.randbytes(30),
             b"Transfer-Encoding: chunked", b"Content-Type: application/json", b"Origin: null",
             b"Expect: 100-continue", b"X: " + b"y" * rng.choice([10, 70000]), b" folded"]
        )
        for _ in range(rng.choice([0, 1, 2, 3, 5, 120]))
    ]  # fmt: skip
    body = rng.choice([b"", b"{", b'{"do":', b"[" * 2000, rng.randbytes(50), b'{"do":"toggle"}'])
    whole = b"\r\n".join([b" ".join([method, path, version]), *headers, b"", body])
    return rng.choice([whole, whole, whole[: rng.randrange(len(whole) + 1)], rng.randbytes(60)])


def test_malformed_requests_neither_stop_it_nor_leak_a_path(
    server: WatchServer, capfd: pytest.CaptureFixture[str]
) -> None:
    rng = random.Random(7)
    secrets = (str(ROOT).encode(), b"/usr/", b"site-packages", b".py", b"Traceback", b"root:")
    answered = 0
    for _ in range(500):
        request = malformed(rng, server.token)
        with connect(server) as connection:
            answer = b""
            try:
                connection.sendall(request)
                connection.shutdown(socket.SHUT_WR)
                while part := connection.recv(1 << 16):
                    answer += part
            except OSError:
                pass  # closed on a request that was too long
        answered += bool(answer)
        assert not any(secret in answer for secret in secrets), (request, answer)
    assert answered > 200
    assert ask(server, "moving?after=0")[0] == 200
    assert server.session.events == []
    assert capfd.readouterr() == ("", "")


def test_time_passes_only_while_somebody_looks(server: WatchServer) -> None:
    state = server.session.run.world.state
    turns = iter([False] * 3 + [True])
    server.play(lambda: next(turns))
    assert state.step == 0
    ask(server, "moving?after=0")
    server.play(lambda: state.step > 1)
    assert server.version > 1


def test_connections_beyond_the_limit_are_closed(server: WatchServer) -> None:
    waiting = [connect(server) for _ in range(64)]
    for one in waiting:
        one.sendall(b"GET")
    with connect(server) as late:
        late.settimeout(10)
        with contextlib.suppress(ConnectionResetError):
            assert late.recv(1) == b""
    for one in waiting:
        one.close()


def test_port_in_use_is_one_sentence(server: WatchServer) -> None:
    port = server.server_address[1]
    with pytest.raises(SetupError, match=f"port = {port}: is in use, should be another one"):
        WatchServer(new_session(), "swarm-dt", port)


def test_views_are_json_whatever_happened() -> None:
    session = Session(
        SMALL.replace(restock=True), lambda: policies.load("swarm-dt"), 0, [Fault("removed", 2)]
    )
    session.select(int(session.run.world.state.robot_present.argmax()))
    session.play(5.0)
    json.dumps([fixed_view("x"), moving_view(session)], allow_nan=False)
    for mode in FAILURE_MODES:
        if session.selected is not None:
            session.choose_mode(mode)
            session.break_robot()
            json.dumps(moving_view(session, trails=True), allow_nan=False)
    assert session.selected is None
