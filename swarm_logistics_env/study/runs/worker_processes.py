"""Worker processes: what plays runs in several at once, and ends with a run that takes too long."""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import traceback
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Self
from unittest.mock import patch

import cloudpickle

from swarm_logistics_env.compiler.numba_fence import QUIET
from swarm_logistics_env.core.current_folder import current_folder_modules, search_current_folder
from swarm_logistics_env.core.errors import RAISED_BY_OTHERS, StudyError
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Run

Played = Generator[tuple[Run, Outcome], None, None]


class RunQueue:
    """Runs to be played, first come, first served; an iterator that goes on after `extend`.

    An engine asks for the next run again after each outcome that it yields, so what the outcomes so
    far make necessary is played by the same workers.

    Attributes:
        may_grow: whether runs may be added later.
        total: how many runs there were in all.
    """

    def __init__(self, runs: Iterable[Run], *, may_grow: bool = False) -> None:
        self._waiting = deque[Run]()
        self.may_grow = may_grow
        self.total = 0
        self.extend(runs)

    def extend(self, runs: Iterable[Run]) -> None:
        """Let further runs wait."""
        n_before = len(self._waiting)
        self._waiting.extend(runs)
        self.total += len(self._waiting) - n_before

    def __len__(self) -> int:
        return len(self._waiting)

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> Run:
        if not self._waiting:
            raise StopIteration
        return self._waiting.popleft()


# Environment of workers. One thread each: n workers with n threads would wait for each other. And
# Python looks for none of its own modules in the current folder before it gets this process's path.
_OF_WORKERS = dict.fromkeys(
    (
        "NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS",
        "PYTHONSAFEPATH",
    ),
    "1",
)  # fmt: skip


@dataclass(frozen=True)
class _Watch:
    """What ends a worker in the middle of a run that takes too long, even one that hangs in C.

    Attributes:
        limit: of a run [s].
        reports: folder in which the worker writes what it was doing.
    """

    limit: float
    reports: Path

    @contextmanager
    def over(self, run: Run) -> Iterator[None]:
        """End this process with a report if the block takes too long."""
        path = self.reports / run.key
        with path.open("w") as file:
            faulthandler.dump_traceback_later(self.limit, exit=True, file=file)
            try:
                yield
            finally:
                faulthandler.cancel_dump_traceback_later()
        path.unlink()

    def error(self, run: Run) -> str | None:
        """Return that the run took too long, and where it was; None: it did not."""
        path = self.reports / run.key
        if not path.exists() or not (lines := path.read_text().splitlines()[1:]):
            return None
        # It begins with the most recent call, a traceback ends with it.
        where = "\n".join(reversed(lines))
        limit = f"the limit of {self.limit:g} s (run_limit, --run-limit)"
        return f"{where}\nRunLimit: a run took longer than {limit}\n"


def in_processes(count: int, run_limit: float, runs: Iterable[Run]) -> Played:
    """Play the runs in `count` worker processes, each run for at most so long [s].

    When a worker dies, each run that was being played is played once more, alone in a new worker; a
    run that ends this worker as well is an outcome with an error, as one that takes too long.

    Raises:
        StudyError: a run cannot be sent to another process, or no worker comes up.
    """
    waiting = runs if isinstance(runs, RunQueue) else RunQueue(runs)
    with TemporaryDirectory() as reports:
        watch = _Watch(run_limit, Path(reports))
        while waiting:
            with workers(count if waiting.may_grow else min(count, len(waiting))) as pool:
                interrupted = yield from _played(pool, waiting, count, watch)
            for run in interrupted:
                error = watch.error(run)
                died = [run]
                if error is None:
                    with workers(1) as alone:
                        died = yield from _played(alone, RunQueue([run]), 1, watch)
                    error = watch.error(run) or "WorkerDied: two worker processes ended in this run"
                if died:
                    yield run, Outcome(error=error)


def _played(
    pool: ProcessPoolExecutor, waiting: RunQueue, at_once: int, watch: _Watch
) -> Generator[tuple[Run, Outcome], None, list[Run]]:
    """Yield runs with their outcomes until none waits; return those that a dead worker played."""
    playing: dict[Future[Outcome], Run] = {}
    interrupted: list[Run] = []
    while playing or (waiting and not interrupted):
        while waiting and not interrupted and len(playing) < at_once:
            first = next(waiting)
            message = pickled(first)
            try:
                playing[pool.submit(play_pickled, message, current_folder_modules(), watch)] = first
            except BrokenProcessPool:  # a worker died between two runs
                interrupted.append(first)
        for future in wait(playing, return_when=FIRST_COMPLETED).done:
            run = playing.pop(future)
            try:
                yield run, future.result()
            except BrokenProcessPool:
                interrupted.append(run)
    return interrupted


@contextmanager
def workers(count: int) -> Generator[ProcessPoolExecutor, None, None]:
    """Start worker processes, and end them at once with the block, or when this process dies."""
    context = multiprocessing.get_context("spawn")
    worker_end, own_end = context.Pipe(duplex=False)
    with patch.dict(os.environ, _OF_WORKERS):
        pool = ProcessPoolExecutor(count, context, _end_with_parent, (worker_end,))
    try:
        with patch.dict(os.environ, _OF_WORKERS), _without_main(), _interrupts_ignored():
            started = [pool.submit(os.getpid) for _ in range(count)]
        try:
            started[0].result()
        except BrokenProcessPool:
            raise StudyError(
                "a worker process ended before its first run: use one process"
            ) from None
        yield pool
    finally:
        own_end.close()
        pool.shutdown(cancel_futures=True)
        worker_end.close()


@contextmanager
def _without_main() -> Generator[None, None, None]:
    """Start workers that do not execute the main script again: what it defines travels with runs.

    So a script needs no guard, and it may be a notebook or come from standard input.
    """
    main = sys.modules["__main__"]
    with patch.object(main, "__spec__", None), patch.object(main, "__file__", None, create=True):
        yield


def _end_with_parent(connection: Connection) -> None:
    """End this worker when the parent closes its end of the pipe, which its death does as well."""

    def watch() -> None:
        try:
            connection.recv()
        except (EOFError, OSError):
            os._exit(0)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def _interrupts_ignored() -> Generator[None, None, None]:
    """Start workers that ignore SIGINT: the parent alone decides how the study stops."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def pickled(run: Run) -> bytes:
    """Return a run as it is sent to a worker.

    Raises:
        StudyError: it cannot be.
    """
    try:
        message: bytes = cloudpickle.dumps(run)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise StudyError(
            f"policy {run.case.policy.title!r} cannot be sent to another process "
            f"({str(error).splitlines()[0]}): use one process"
        ) from error
    return message


def play_pickled(
    message: bytes, modules: tuple[str, ...] | None, watch: _Watch | None = None
) -> Outcome:
    """Play a run that was sent to this worker.

    Args:
        message: the run.
        modules: those to be found in the current folder, see `search_current_folder`.
        watch: what ends the run where it takes too long.
    """
    os.environ[QUIET] = "1"
    if modules is not None:
        search_current_folder(modules)
    try:
        run: Run = pickle.loads(message)
    except RAISED_BY_OTHERS:  # a policy that only the parent can import
        return Outcome(error=traceback.format_exc())
    with nullcontext() if watch is None else watch.over(run):
        return run.play()
