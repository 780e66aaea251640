"""A server in a thread, and what asks it."""

from __future__ import annotations

import asyncio
import http.client
import json
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import urlsplit

import aiohttp
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.views.watch import Session
from swarm_logistics_env.views.watch.server import WatchServer

SMALL = Scenario(
    n_robots=6, n_items=8, n_obstacles=1, duration=60.0, warehouse_width=5, warehouse_height=5
)


LONG = 300.0  # [s]; ends what hangs


class Served:
    """A server that plays in a thread; its session is changed by orders alone."""

    def __init__(self, session: Session | None = None) -> None:
        self.server = WatchServer(session or Session(SMALL, speed=8.0), 0)
        self._started = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._run()))
        self._thread.start()
        assert self._started.wait(600)

    async def _run(self) -> None:
        self._loop, self._stop = asyncio.get_running_loop(), asyncio.Event()
        await self.server.start()
        playing = asyncio.create_task(self.server.play())
        self._started.set()
        await self._stop.wait()
        playing.cancel()
        await asyncio.gather(playing, return_exceptions=True)

    def stop(self) -> None:
        self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join()


@pytest.fixture
def served() -> Iterator[Served]:
    running_server = Served()
    yield running_server
    running_server.stop()


def ask(served: Served, name: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    """Ask for a file below the token, or for a path that begins with /."""
    path = name if name.startswith("/") else f"/{served.server.token}/{name}"
    host = urlsplit(served.server.address).hostname or ""
    connection = http.client.HTTPConnection(host, served.server.port, timeout=LONG)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    response = answer.status, answer.read(), dict(answer.getheaders())
    connection.close()
    return response


def messages(
    served: Served, orders: list[str], enough: int | Callable[[dict[str, Any]], bool]
) -> list[dict[str, Any]]:
    """Send orders and return the messages that come, until a problem or `enough` of them.

    Args:
        enough: how many, or whether a message is the last.
    """

    def is_last(got: list[dict[str, Any]]) -> bool:
        if isinstance(enough, int):
            return len(got) >= enough
        return bool(got) and enough(got[-1])

    async def talk() -> list[dict[str, Any]]:
        got: list[dict[str, Any]] = []
        live = f"{served.server.address}live"
        async with aiohttp.ClientSession() as client, client.ws_connect(live) as page:
            for order in orders:
                await page.send_str(order)
            while not is_last(got) and not (got and "problem" in got[-1]):
                got.append(json.loads((await page.receive(LONG)).data))
        return got

    return asyncio.run(talk())


def wait_until(is_true: Callable[[], bool]) -> None:
    """Wait for something that comes, however slow the machine is."""
    is_over = time.monotonic() + LONG
    while not is_true():
        assert time.monotonic() < is_over
        time.sleep(0.01)
