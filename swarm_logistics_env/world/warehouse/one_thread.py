"""A world is used by one thread at a time: compiled code changes it without the interpreter's lock.

Another thread is refused rather than made to wait, as whose turn it is would be chance.
"""

from __future__ import annotations

import contextlib
import functools
import threading
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeAlias, TypeVar, cast

from swarm_logistics_env.core.errors import SetupError

# A call inside of another one is of the same thread, which a lock of this kind lets pass.
Lock: TypeAlias = "threading.RLock"
M = TypeVar("M", bound=Callable[..., Any])


def in_one_thread(method: M) -> M:
    """Let a method of what has a `lock` raise a SetupError while another thread holds that."""

    @functools.wraps(method)
    def refusing(self: Any, *arguments: Any, **keywords: Any) -> Any:
        lock: Lock = self.lock
        if not lock.acquire(blocking=False):  # as `holding`, in a tenth of the time
            raise used_elsewhere()
        try:
            return method(self, *arguments, **keywords)
        finally:
            lock.release()

    return cast("M", refusing)


@contextlib.contextmanager
def holding(locks: Iterable[Lock]) -> Iterator[None]:
    """Hold the locks of worlds.

    Raises:
        SetupError: another thread uses one of the worlds.
    """
    held_locks = []
    try:
        for lock in locks:
            if not lock.acquire(blocking=False):
                raise used_elsewhere()
            held_locks.append(lock)
        yield
    finally:
        for lock in held_locks:
            lock.release()


def used_elsewhere() -> SetupError:
    """Return the error about a world that another thread is using."""
    return SetupError(
        "another thread is using this world: should be one environment for each thread, or one "
        "that each thread uses `with env.unwrapped.lock:`"
    )
