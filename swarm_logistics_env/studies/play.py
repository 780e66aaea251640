"""Playing: what plays runs, in this process, in many or on Ray, and keeps each in a store.

Whichever engine plays them, the outcomes are the same; their order is not.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from types import ModuleType
from unittest.mock import patch

from swarm_logistics_env.errors import RAISED_BY_OTHERS, StudyError, how_to_install, suggest
from swarm_logistics_env.kernels import QUIET
from swarm_logistics_env.policies.current_folder import found_here, look_here
from swarm_logistics_env.progress_bar import ProgressBar
from swarm_logistics_env.tasks.task import Outcome, Run

from .runs import Runs

Played = Generator[tuple[Run, Outcome], None, None]
Engine = Callable[[Iterable[Run]], Played]
NAMES = ("local", "process", "ray")


@dataclass(frozen=True)
class Tally:
    """The numbers of one call of `Study.run`.

    Attributes:
        played: runs played now; failed: those of them that failed; kept: found in the store.
        seconds: wall-clock time [s].
        error: what the first that failed raised, without its traceback; None: none failed.
        left: runs that the time did not suffice for.
    """

    played: int
    failed: int
    kept: int
    seconds: float
    error: str | None = None
    left: int = 0


def play(
    runs: Sequence[Run], engine: Engine, store: Runs, title: str, end: float | None = None
) -> list[str | None]:
    """Play runs and keep each in the store at once; show a progress bar.

    Args:
        end: when to stop (`time.monotonic`) [s]; None: when all are played.

    Returns:
        What each run raised, as they finished; None: it succeeded.
    """
    errors: list[str | None] = []
    # Closed at once where this stops early, so that no worker outlives it.
    with closing(engine(runs)) as finished, ProgressBar(title, len(runs), "runs") as progress:
        for run, outcome in finished:
            store.add(run, outcome)
            errors.append(outcome.error)
            progress.reach(len(errors), f"{len(errors) - errors.count(None)} failed")
            if end is not None and time.monotonic() > end:
                break
    return errors


def serial(runs: Iterable[Run]) -> Played:
    """Play the runs one after the other in this process."""
    for run in runs:
        yield run, run.play()


def engine_named(name: str, processes: int | None = None, address: str | None = None) -> Engine:
    """Return an engine.

    Args:
        name: "local": this process; "process": worker processes on this machine; "ray": a cluster.
        processes: the number of worker processes, or of cores of a local cluster; None means one
            for each core.
        address: the address of the Ray cluster; None starts one on this machine.

    Raises:
        StudyError: there is no such engine, or it has no use for one of the arguments.
    """
    if name not in NAMES:
        raise StudyError(f"no engine {name!r}{suggest(name, NAMES)}")
    if address is not None and name != "ray":
        raise StudyError(f"engine {name}: only ray has an address")
    if name == "local":
        if processes not in (None, 1):
            raise StudyError(f"engine local: is one process, not {processes}")
        return serial
    if name == "process":
        return partial(_in_processes, processes or os.cpu_count() or 1)
    if address is not None and processes is not None:
        raise StudyError("engine ray: a cluster that runs already has its own number of cores")
    return partial(_on_ray, address, processes)


# Environment of workers. One thread each: n workers with n threads would wait for each other. And
# Python looks for none of its own modules in the current folder before it gets this process's path.
_OF_WORKERS = dict.fromkeys(
    (
        "NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS",
        "PYTHONSAFEPATH",
    ),
    "1",
)  # fmt: skip


def _in_processes(count: int, runs: Iterable[Run]) -> Played:
    """Play the runs in `count` worker processes.

    When a worker dies, each run that was being played is played once more, alone in a new worker; a
    run that ends this worker as well is an outcome with an error.

    Raises:
        StudyError: a run cannot be sent to another process, or no worker comes up.
    """
    waiting = deque(runs)
    while waiting:
        with workers(min(count, len(waiting))) as pool:
            interrupted = yield from _played(pool, waiting, count)
        for run in interrupted:
            with workers(1) as alone:
                ended_again = yield from _played(alone, deque([run]), 1)
            if ended_again:
                yield run, Outcome(error="WorkerDied: two worker processes ended in this run\n")


def _played(
    pool: ProcessPoolExecutor, waiting: deque[Run], at_once: int
) -> Generator[tuple[Run, Outcome], None, list[Run]]:
    """Yield runs with their outcomes until none waits; return those that a dead worker played."""
    playing: dict[Future[Outcome], Run] = {}
    interrupted: list[Run] = []
    while playing or (waiting and not interrupted):
        while waiting and not interrupted and len(playing) < at_once:
            first = waiting.popleft()
            message = _pickled(first)
            try:
                playing[pool.submit(_play, message, found_here())] = first
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
    theirs, ours = context.Pipe(duplex=False)
    with patch.dict(os.environ, _OF_WORKERS):
        pool = ProcessPoolExecutor(count, context, _end_with_parent, (theirs,))
    try:
        with patch.dict(os.environ, _OF_WORKERS), _interrupts_ignored():
            started = [pool.submit(os.getpid) for _ in range(count)]
        try:
            started[0].result()
        except BrokenProcessPool:
            raise StudyError(
                "a worker process ended before its first run; in a script, run the study "
                'under `if __name__ == "__main__":`, or use one process'
            ) from None
        yield pool
    finally:
        ours.close()
        pool.shutdown(cancel_futures=True)
        theirs.close()


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


def _pickled(run: Run, dumps: Callable[[Run], bytes] = pickle.dumps) -> bytes:
    try:
        return dumps(run)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise StudyError(
            f"policy {run.case.policy.title!r} cannot be sent to another process "
            f"({str(error).splitlines()[0]}): use one process"
        ) from error


def _play(message: bytes, found: tuple[str, ...] | None) -> Outcome:
    os.environ[QUIET] = "1"
    if found is not None:
        look_here(found)
    try:
        run: Run = pickle.loads(message)
    except RAISED_BY_OTHERS:  # a policy that only the parent can import
        return Outcome(error=traceback.format_exc())
    return run.play()


RETRIES = 1  # after a worker's death, as local processes do
QUEUED_PER_CORE = 2  # so that no core waits for this process


def _on_ray(address: str | None, cores: int | None, runs: Iterable[Run]) -> Played:
    """Play the runs on the cores of a Ray cluster.

    Start one by `ray start --head` on one machine and `ray start --address ...` on the others,
    all with this version of the package.

    Args:
        address: the cluster's address; "auto" means the one that this machine belongs to; None
            starts one on this machine while the study runs.
        cores: the number of cores of a cluster that is started here; None means all.
        runs: to play.

    Raises:
        StudyError: ray is not installed, or there is no cluster at that address.
    """
    waiting = deque(runs)
    ray, ours = _connected(address, cores)
    pending: dict[Hashable, Run] = {}
    try:
        sent = ray.remote(num_cpus=1, max_retries=RETRIES)(_play)
        # A policy travels with every run, so only a few runs are sent at a time.
        limit = QUEUED_PER_CORE * max(1, int(ray.cluster_resources().get("CPU", 1)))
        while pending or waiting:
            while waiting and len(pending) < limit:
                message = _pickled(waiting[0], ray.cloudpickle.dumps)
                pending[sent.remote(message, found_here())] = waiting.popleft()
            for task in ray.wait(list(pending), num_returns=1)[0]:
                run = pending.pop(task)
                try:
                    outcome = ray.get(task)
                except ray.exceptions.RayError:  # its worker died twice
                    outcome = Outcome(error=traceback.format_exc())
                yield run, outcome
    finally:
        for task in pending:
            ray.cancel(task, force=True)
        if ours:
            ray.shutdown()


def _connected(address: str | None, cores: int | None) -> tuple[ModuleType, bool]:
    """Return ray, and whether the connection was made here."""
    try:
        import ray
    except ImportError:
        raise StudyError(f"the engine ray needs Ray: {how_to_install('ray')}") from None
    if ray.is_initialized():
        return ray, False
    # Its reports of use are for the user to switch on.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    quiet = {"logging_level": "error", "log_to_driver": False}
    try:
        if address is None:
            # "local": never a cluster that happens to run here.
            ray.init("local", num_cpus=cores, include_dashboard=False, **quiet)
        else:
            ray.init(address, **quiet)
    except (ConnectionError, RuntimeError, ValueError) as error:
        reason = str(error).strip().splitlines()[0]
        raise StudyError(f"no Ray cluster at {address}: {reason}") from error
    return ray, True
