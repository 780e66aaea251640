"""The server: for this machine, for the page's own files, for orders with the token alone."""

from __future__ import annotations

import contextlib
import errno
import hmac
import http.server
import json
import math
import re
import secrets
import socketserver
import sys
import threading
import time
from collections.abc import Callable
from http import HTTPStatus
from importlib import resources
from typing import Any
from urllib.parse import parse_qs, urlsplit

from swarm_logistics_env.errors import SetupError, SwarmLogisticsError
from swarm_logistics_env.watch.session import Session
from swarm_logistics_env.watch.web.orders import obey
from swarm_logistics_env.watch.web.view import fixed_view, moving_view

_LOOPBACK = "127.0.0.1"
# A foreign page may resolve its name to this machine, but it cannot forge these headers.
_OWN_HOST = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:\d{1,5})?")
_FILES = {
    "": ("page.html", "text/html; charset=utf-8"),
    "page.css": ("page.css", "text/css; charset=utf-8"),
    "page.js": ("page.js", "text/javascript; charset=utf-8"),
}
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
_LONGEST_ORDER = 4096  # bytes
_MOST_CONNECTIONS = 64
_SILENCE = 10.0  # [s] until a connection that says nothing is closed
_PATIENCE = 1.0  # [s] that a request for what comes next waits
_FRAME_PERIOD = 0.05  # [s]
_NOBODY_LOOKS_AFTER = 3.0  # [s] since the last request: time stands still


class WatchServer(socketserver.ThreadingMixIn, socketserver.TCPServer):
    """Shows a session to those who know its address, which holds a random token.

    Args:
        session: the session to show.
        title: the name of the policy.
        port: the port; 0 takes any that is free.

    Attributes:
        address: the address to open in a browser.

    Raises:
        SetupError: the port is in use or not allowed.
    """

    allow_reuse_address = True
    daemon_threads = True
    block_on_close = False
    request_queue_size = 64

    def __init__(self, session: Session, title: str, port: int) -> None:
        self.session, self.title = session, title
        self.token = secrets.token_urlsafe(18)
        self.changed = threading.Condition()
        self.version = 1
        self._last_look = -math.inf
        self._room = threading.BoundedSemaphore(_MOST_CONNECTIONS)
        here = resources.files(__package__)
        self.files = {
            name: (here.joinpath(file).read_bytes(), kind) for name, (file, kind) in _FILES.items()
        }
        try:
            super().__init__((_LOOPBACK, port), _Handler)
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise SetupError(
                    f"port = {port}: is in use, should be another one, or 0 for any that is free"
                ) from None
            raise SetupError(f"port = {port}: {error.strerror}") from None
        self.address = f"http://{_LOOPBACK}:{self.server_address[1]}/{self.token}/"

    def play(self, is_over: Callable[[], bool] = lambda: False) -> None:
        """Let the session go on while somebody looks, until `is_over`."""
        before = time.monotonic()
        while not is_over():
            time.sleep(_FRAME_PERIOD)
            now = time.monotonic()
            elapsed, before = now - before, now
            if now - self._last_look < _NOBODY_LOOKS_AFTER:
                with self.changed:
                    if self.session.play(elapsed, budget=_FRAME_PERIOD):
                        self._tell()

    def order(self, text: bytes) -> None:
        """Do what the page asks."""
        with self.changed:
            obey(self.session, text)
            self._tell()

    def view(self, after: int, *, trails: bool = False) -> bytes:
        """Return the first view later than version `after`, or the same again if none comes."""
        self._last_look = time.monotonic()
        with self.changed:
            self.changed.wait_for(lambda: self.version != after, _PATIENCE)
            moving = {"version": self.version, **moving_view(self.session, trails=trails)}
        return json.dumps(moving, separators=(",", ":")).encode()

    def _tell(self) -> None:
        self.version += 1
        self.changed.notify_all()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Take a connection, unless there are too many."""
        if self._room.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve a connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._room.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore connections that break off; show our own bugs."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(http.server.BaseHTTPRequestHandler):
    server: WatchServer
    server_version, sys_version = "swarm-logistics", ""
    protocol_version = "HTTP/1.1"
    timeout = _SILENCE

    def do_GET(self) -> None:
        name, query = self._asked()
        if name in self.server.files:
            self._answer(*self.server.files[name])
        elif name == "fixed":
            self._answer_json(json.dumps(fixed_view(self.server.title)).encode())
        elif name == "moving":
            asked = parse_qs(query)
            after = asked.get("after", ["0"])[0]
            version = int(after) if re.fullmatch(r"[0-9]{1,15}", after) else 0
            self._answer_json(self.server.view(version, trails="trails" in asked))
        elif name is not None:
            self.send_error(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        name, _ = self._asked()
        if name is None:
            return
        length = self.headers.get("Content-Length", "")
        kind = self.headers.get("Content-Type", "").partition(";")[0].strip()
        if name != "order":
            self.send_error(HTTPStatus.NOT_FOUND)
        elif kind != "application/json":
            self.send_error(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
        elif not re.fullmatch(r"[0-9]{1,9}", length):
            self.send_error(HTTPStatus.LENGTH_REQUIRED)
        elif int(length) > _LONGEST_ORDER:
            self.send_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        else:
            try:
                self.server.order(self.rfile.read(int(length)))
            except SwarmLogisticsError as error:
                problem = json.dumps({"problem": str(error)}).encode()
                self._answer(problem, "application/json", HTTPStatus.BAD_REQUEST)
            else:
                self._answer_json(b"{}")

    def _asked(self) -> tuple[str | None, str]:
        """Return name and query of the request; None if an error response was already sent."""
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        own = len(hosts) == 1 and _OWN_HOST.fullmatch(hosts[0])
        if not own or origins not in ([], [f"http://{hosts[0]}"]):
            self.send_error(HTTPStatus.FORBIDDEN)
            return None, ""
        try:
            asked = urlsplit(self.path)
        except ValueError:
            self.send_error(HTTPStatus.BAD_REQUEST)
            return None, ""
        token, slash, name = asked.path.removeprefix("/").partition("/")
        known = hmac.compare_digest(token.encode(), self.server.token.encode())
        if not (known and slash and not asked.netloc):
            self.send_error(HTTPStatus.FORBIDDEN)
            return None, ""
        return name, asked.query

    def _answer_json(self, body: bytes) -> None:
        self._answer(body, "application/json")

    def _answer(self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Answer with the meaning of the code; repeat nothing of the request."""
        # The connection may go on with the rest of a body, so it is closed.
        self.close_connection = True
        status = HTTPStatus(code)
        text = status.phrase
        if status == HTTPStatus.FORBIDDEN:
            text = "Open the address that swarm-logistics watch printed, on its machine."
        # Data that is no request at all gets an answer, too.
        self.command = getattr(self, "command", None) or "GET"
        self.request_version = "HTTP/1.1"
        self._answer(f"{text}\n".encode(), "text/plain; charset=utf-8", status)

    def log_message(self, format: str, *args: Any) -> None:
        """Write nothing: the terminal belongs to the user."""


def serve(session: Session, title: str, port: int, announce: Callable[[str], None]) -> None:
    """Show a session in the browser until Ctrl-C.

    Args:
        announce: is called with a sentence that has the address.

    Raises:
        SetupError: the port is in use or not allowed.
        PolicyError: the policy returned commands of the wrong shape, or not finite.
    """
    with WatchServer(session, title, port) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.1,), daemon=True)
        thread.start()
        announce(
            f"Open {server.address} in a browser on this machine (from another one: "
            f"ssh -L {server.server_address[1]}:127.0.0.1:{server.server_address[1]}). "
            "Ctrl-C ends it."
        )
        try:
            with contextlib.suppress(KeyboardInterrupt):
                server.play()
        finally:
            server.shutdown()
            thread.join()
