"""The server: for this machine, for those who know the token in the address.

To import it raises a SetupError where aiohttp is not installed.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import logging
import math
import os
import re
import secrets
import socket
import threading
import time
from collections.abc import Callable
from typing import Any

from swarm_logistics_env.core.errors import SetupError, SwarmLogisticsError, how_to_install

from .messages import (
    FILES,
    Message,
    Recording,
    changes_since,
    encode,
    frame_message,
    obey,
    rehearse,
    text_of_file,
)
from .session import Session

try:
    from aiohttp import web
    from aiohttp.http_exceptions import HttpProcessingError
    from aiohttp.typedefs import Handler
except ImportError as error:
    raise SetupError(f"watch needs aiohttp ({error}): {how_to_install('watch')}") from None

LOOPBACK = "127.0.0.1"
# A foreign page may resolve its own name to this machine, but it cannot forge the name in a Host.
_OWN_HOST = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:\d{1,5})?", re.IGNORECASE)
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
    "Server": "swarm-logistics",
}
_LONGEST_ORDER = 4096  # bytes
_MOST_PAGES = 16
_FRAME_PERIOD = 0.05  # [s]
_HEARTBEAT = (
    10.0  # [s] between signs of life of a page; it is closed half as long after a missing one
)
_PATIENCE = 10.0  # [s] with a page that does not take a message
# Connections that are no page: each costs a file of this process. Further ones wait to be accepted.
_MOST_CONNECTIONS = 64
_MOST_WAITING = 1024
_LONGEST_SILENCE = 60.0  # [s] of a connection that asks for nothing, or does not take its answer
_SHORTEST_SILENCE = 5.0  # [s] the same where others wait
_NOTE_LASTS = 8.0  # [s]


class _Connection:
    """A connection, which aiohttp serves.

    Args:
        silent_since: the time since when each connection that is no page has been silent; infinite
            while it is answered.
    """

    def __init__(
        self, served: asyncio.Protocol, silent_since: dict[asyncio.Transport, float]
    ) -> None:
        self._served = served
        self._silent_since = silent_since

    def connection_made(self, transport: asyncio.Transport) -> None:
        self._silent_since[transport] = time.monotonic()
        self._served.connection_made(transport)
        self._transport = transport

    def connection_lost(self, error: Exception | None) -> None:
        self._silent_since.pop(self._transport, None)
        self._served.connection_lost(error)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._served, name)


class _Page:
    """A page that is open, and what it knows of the session.

    It is told the next thing once it has taken the last one, and dropped if it does not for long.
    """

    def __init__(
        self, socket: web.WebSocketResponse, transport: asyncio.Transport, session: Session
    ) -> None:
        self._socket = socket
        self._transport = transport
        self._sent_frame: Message = {"note": session.note}  # it was for those who were there
        self._sending: asyncio.Task[None] | None = None
        self._sent_at = 0.0

    def tell(self, current_frame: Message) -> None:
        """Send what has changed, unless the page still takes what changed before."""
        now = time.monotonic()
        if self._sending is not None and not self._sending.done():
            if now > self._sent_at + _PATIENCE:
                self._transport.abort()
            return
        message = changes_since(self._sent_frame, current_frame)
        if message:
            self._sent_frame = current_frame
            self._sent_at = now
            self._sending = asyncio.create_task(self._send(encode(message)))

    async def _send(self, text: str) -> None:
        with contextlib.suppress(ConnectionError):
            await self._socket.send_str(text)


class WatchServer:
    """Shows a session to those who know its address, which holds the token.

    Args:
        session: the session to show.
        port: the port; 0 takes any that is free.

    Attributes:
        address: the address to open in a browser, once `start` is done.
    """

    def __init__(self, session: Session, port: int) -> None:
        self.session = session
        self.port = port
        self.token = secrets.token_urlsafe(18)
        self.recording = Recording(session)
        self.address = ""
        self._pages: set[_Page] = set()
        self._noted_at = 0.0
        self._silent_since: dict[asyncio.Transport, float] = {}
        self._listening: socket.socket | None = None
        self._is_ending = False
        app = web.Application(middlewares=[self._answer_once, self._guard])
        app.router.add_get("/{token}/live", self._live)
        app.router.add_get("/{token}/recording.html", self._save)
        app.router.add_get("/{token}/{name:.*}", self._file)
        app.on_response_prepare.append(_add_headers)
        logger = logging.getLogger(__name__)
        logger.addFilter(_is_own_error)
        self._runner = web.AppRunner(app, access_log=None, logger=logger, shutdown_timeout=0.5)

    async def start(self) -> None:
        """Listen on this machine, and compile what a page may ask for.

        Raises:
            SetupError: the port is in use or not allowed.
        """
        await self._runner.setup()
        listening = socket.socket()
        try:
            if os.name == "posix":  # elsewhere it would share a port that is in use
                listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.setblocking(False)
            listening.bind((LOOPBACK, self.port))
            listening.listen(_MOST_WAITING)
        except OSError as error:
            listening.close()
            await self._runner.cleanup()
            raise SetupError(
                f"port = {self.port}: {error.strerror}; --port 0 takes any that is free"
            ) from None
        self._listening = listening
        self.port = listening.getsockname()[1]
        rehearse(self.session)
        self.address = f"http://{LOOPBACK}:{self.port}/{self.token}/"

    async def _accept(self, listening: socket.socket, new_protocol: Callable[[], Any]) -> None:
        """Accept connections while there is room; the requests of others wait to be read.

        It ends at the first connection after `_is_ending`, and is not to be cancelled: asyncio
        would lose a connection that comes in the same moment, and leave it open.
        """
        loop = asyncio.get_running_loop()

        def new_connection() -> Any:
            return _Connection(new_protocol(), self._silent_since)

        while True:
            try:
                accepted, _ = await loop.sock_accept(listening)
                if self._is_ending:
                    accepted.close()
                    return
                await loop.connect_accepted_socket(new_connection, accepted)
            except OSError:  # it has gone again, or no more files can be open
                await asyncio.sleep(_FRAME_PERIOD)
            while len(self._silent_since) >= _MOST_CONNECTIONS and not self._is_ending:
                self._drop_silent(_SHORTEST_SILENCE)
                await asyncio.sleep(_FRAME_PERIOD)

    def _drop_silent(self, longest: float) -> None:
        """Drop the connections that have been silent for longer [s]."""
        now = time.monotonic()
        for transport, since in self._silent_since.items():
            if now - since > longest:
                transport.abort()

    async def play(self) -> None:
        """Answer, and let the session go on while a page is open, until this is cancelled."""
        assert self._listening is not None
        assert self._runner.server is not None
        accepting = asyncio.create_task(self._accept(self._listening, self._runner.server))
        before = time.monotonic()
        try:
            while True:
                await asyncio.sleep(_FRAME_PERIOD)
                now = time.monotonic()
                elapsed = now - before
                before = now
                self._drop_silent(_LONGEST_SILENCE)
                if now > self._noted_at + _NOTE_LASTS:
                    self.session.note = ""
                if self._pages:
                    self.session.play(elapsed, _FRAME_PERIOD, self.recording.note)
                    current_frame = frame_message(self.session)
                    for page in self._pages:
                        page.tell(current_frame)
        finally:
            self._is_ending = True
            with contextlib.suppress(OSError), socket.create_connection((LOOPBACK, self.port), 5.0):
                await accepting
            self._listening.close()
            await self._runner.cleanup()

    async def _live(self, request: web.Request) -> web.StreamResponse:
        if len(self._pages) >= _MOST_PAGES:
            text = f"{_MOST_PAGES} pages are open, and there can be no more: close one.\n"
            raise web.HTTPServiceUnavailable(text=text, headers={"Retry-After": "5"})
        page_socket = web.WebSocketResponse(
            max_msg_size=_LONGEST_ORDER, heartbeat=_HEARTBEAT, compress=False
        )
        transport = request.transport
        await page_socket.prepare(request)
        if transport is None:
            return page_socket  # it has gone meanwhile
        self._silent_since.pop(transport, None)
        page = _Page(page_socket, transport, self.session)
        try:
            self._pages.add(page)
            self.recording.note()
            await page_socket.send_str(self.recording.text())
            async for message in page_socket:
                try:
                    obey(self.session, message.data if isinstance(message.data, str) else "")
                except SwarmLogisticsError as error:
                    await page_socket.send_str(encode({"problem": str(error)}))
                self._noted_at = time.monotonic()
                self.recording.note()
        finally:
            self._pages.discard(page)
            # What it has not taken would keep the connection open.
            asyncio.get_running_loop().call_later(_PATIENCE, transport.abort)
        return page_socket

    async def _file(self, request: web.Request) -> web.StreamResponse:
        name = request.match_info["name"] or "page.html"
        if name not in FILES:
            raise web.HTTPNotFound(text="Not Found\n")
        return web.Response(text=text_of_file(name), content_type=FILES[name], charset="utf-8")

    async def _save(self, request: web.Request) -> web.StreamResponse:
        headers = {"Content-Disposition": 'attachment; filename="run.html"'}
        page = await asyncio.to_thread(self.recording.page)
        return web.Response(text=page, content_type="text/html", headers=headers)

    @web.middleware
    async def _answer_once(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Answer one request of a connection, so that none is dropped with another on its way."""
        transport = request.transport
        if transport in self._silent_since:
            self._silent_since[transport] = math.inf
        try:
            response = await handler(request)
            response.force_close()
            return response
        except web.HTTPException as refusal:
            refusal.force_close()
            raise
        finally:
            if transport in self._silent_since:
                self._silent_since[transport] = time.monotonic()

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        hosts, origins = (request.headers.getall(name, []) for name in ("Host", "Origin"))
        is_to_this_machine = len(hosts) == 1 and _OWN_HOST.fullmatch(hosts[0]) is not None
        token = request.rel_url.raw_path.removeprefix("/").partition("/")[0]
        has_token = hmac.compare_digest(token.encode(), self.token.encode())
        if not (is_to_this_machine and has_token and origins in ([], [f"http://{hosts[0]}"])):
            text = "Open the address that swarm-logistics watch printed, on its machine.\n"
            raise web.HTTPForbidden(text=text)
        return await handler(request)


def _is_own_error(record: logging.LogRecord) -> bool:
    """Return whether an error is ours: no request that is no HTTP, no page that was closed."""
    of_network = HttpProcessingError | ConnectionError
    return not (record.exc_info and isinstance(record.exc_info[1], of_network))


async def _add_headers(request: web.Request, response: web.StreamResponse) -> None:
    response.headers.update(_HEADERS)


def serve(
    session: Session,
    port: int,
    announce: Callable[[str], None],
    show: Callable[[str], object] | None = None,
) -> None:
    """Show a session in the browser until Ctrl-C.

    Args:
        announce: is called with a sentence that has the address.
        show: is called with the address, in a thread of its own, as a browser may not return.

    Raises:
        SetupError: the port is in use or not allowed.
    """

    async def run() -> None:
        server = WatchServer(session, port)
        await server.start()
        announce(
            f"Open {server.address} in a browser on this machine (from another one: "
            f"ssh -L {server.port}:{LOOPBACK}:{server.port} HOST). Ctrl-C ends it."
        )
        if show is not None:
            threading.Thread(target=show, args=[server.address], daemon=True).start()
        await server.play()

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(run())
