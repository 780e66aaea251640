"""A server in a thread."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.views.watch import Session
from swarm_logistics_env.views.watch.server import WatchServer

SMALL = Scenario(
    n_robots=6, n_items=8, n_obstacles=1, duration=60.0, warehouse_width=5, warehouse_height=5
)


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
