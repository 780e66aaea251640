"""Local processes: workers play runs and send the outcomes back; only the parent writes."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import traceback
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.conditions import Run
from swarm_logistics_env.studies.engines import execute
from swarm_logistics_env.tasks.task import Outcome

# One thread per worker: n workers with n threads each would wait for each other.
_THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class Processes:
    """An engine of `count` worker processes.

    A worker that dies is replaced and its run played once more; a run that ends two workers is
    an outcome with an error.

    Raises:
        StudyError: a run cannot be sent to another process, or no worker comes up.
    """

    def __init__(self, count: int) -> None:
        self.count = count

    def __call__(self, runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
        """Yield each run with its outcome, as they finish."""
        waiting = deque(runs)
        again: set[str] = set()
        workers = [_Worker() for _ in range(min(self.count, len(waiting)))]
        try:
            while workers:
                for connection in wait([worker.connection for worker in workers]):
                    worker = next(w for w in workers if w.connection is connection)
                    run = worker.run
                    outcome = worker.receive()
                    if outcome is None and worker.died:
                        workers.remove(worker)
                        if run is not None and run.key in again:
                            outcome = Outcome(run.key, error=worker.obituary())
                        elif run is not None:
                            again.add(run.key)
                            waiting.appendleft(run)
                        if waiting:
                            workers.append(_Worker())
                    elif waiting:
                        worker.send(waiting.popleft())
                    else:
                        workers.remove(worker)
                        worker.stop()
                    if run is not None and outcome is not None:
                        yield run, outcome
        finally:
            for worker in workers:
                worker.stop()


class _Worker:
    """A process that plays the runs that it is sent."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_work, args=(theirs,), daemon=True)
        with _one_thread_each(), _keyboard_ignored():
            self.process.start()
        theirs.close()  # or its end would never be seen to close
        self.run: Run | None = None
        self.ready = False
        self.died = False

    def send(self, run: Run) -> None:
        try:
            message = pickle.dumps(run)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise StudyError(
                f"policy {run.condition.policy.label!r} cannot be sent to another process "
                f"({error}): use one process"
            ) from error
        self.run = run
        try:
            self.connection.send_bytes(message)
        except OSError:
            return  # it died meanwhile: the next wait says so

    def receive(self) -> Outcome | None:
        try:
            outcome: Outcome | str | None = self.connection.recv()
        except (EOFError, OSError):
            self.process.join()
            self.connection.close()
            self.died = True
            if not self.ready:
                raise StudyError(
                    "a worker process ended before its first run; in a script, run the study "
                    'under `if __name__ == "__main__":`, or use one process'
                ) from None
            return None
        if isinstance(outcome, str):
            assert self.run is not None
            outcome = Outcome(self.run.key, error=outcome)
        self.ready = True
        self.run = None
        return outcome

    def obituary(self) -> str:
        code = self.process.exitcode or 0
        cause = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        return f"WorkerDied: two worker processes ended in this run, the second by {cause}\n"

    def stop(self) -> None:
        self.connection.close()
        self.process.terminate()
        self.process.join()


def _work(connection: Connection) -> None:
    connection.send(None)  # ready
    while True:
        try:
            message = connection.recv_bytes()
        except (EOFError, OSError):
            return
        reply: Outcome | str
        try:
            reply = execute(pickle.loads(message))
        except Exception:  # noqa: BLE001 - a policy that only the parent can import
            reply = traceback.format_exc()
        try:
            connection.send(reply)
        except OSError:
            return  # the parent was killed


@contextmanager
def _one_thread_each() -> Iterator[None]:
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _keyboard_ignored() -> Iterator[None]:
    """Let children be born deaf to Ctrl-C: the parent alone decides how the study stops."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
