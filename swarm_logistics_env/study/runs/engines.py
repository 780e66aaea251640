"""Playing: what plays runs, in this process, in many or on Ray, and keeps each in a store.

Whichever engine plays them, the outcomes are the same; their order is not.
"""

from __future__ import annotations

import os
import re
import sys
import threading
import time
import traceback
from collections.abc import Callable, Hashable, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Self

from swarm_logistics_env.core.current_folder import current_folder_modules
from swarm_logistics_env.core.errors import StudyError, how_to_install, suggest, users_line
from swarm_logistics_env.core.progress_bar import ProgressBar
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Run

from .store import Runs
from .worker_processes import Played, RunQueue, in_processes, pickled, play_pickled

Engine = Callable[[Iterable[Run]], Played]
ENGINES = ("local", "process", "ray")


@dataclass(frozen=True)
class Shard:
    """Part `number` of `count`, counted from 1.

    Raises:
        StudyError: there is no such part.
    """

    number: int
    count: int

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise StudyError(f"shard {self}: should be i/n with i from 1 to n")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the shard that "i/n" means."""
        match = re.fullmatch(r"(\d+)/(\d+)", text)
        if match is None:
            raise StudyError(f"shard {text}: should be i/n, e.g. 2/8")
        return cls(int(match[1]), int(match[2]))

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    @property
    def directory(self) -> str:
        """Name of the directory of its store: shards on one disk never share a file."""
        return f"shard-{self.number}-of-{self.count}"

    def of(self, runs: Sequence[Run]) -> Sequence[Run]:
        """Return every n-th run from the i-th on."""
        # Count all runs, not the missing ones, so that a shard depends on nothing but the plan.
        return runs[self.number - 1 :: self.count]


@dataclass(frozen=True)
class Tally:
    """The numbers of one call of `Study.run`.

    Attributes:
        played: runs played now; failed: those of them that failed; kept: found in the store.
        seconds: wall-clock time [s].
        traceback: of the first that failed; None: none failed.
        left: runs that the time did not suffice for, or that were given up.
        gave_up: whether it stopped because nothing worked, see `play`.
        changes: sentences on why runs that were stored before do not count any more.
    """

    played: int
    failed: int
    kept: int
    seconds: float
    traceback: str | None = None
    left: int = 0
    gave_up: bool = False
    changes: tuple[str, ...] = ()

    @property
    def error(self) -> str | None:
        """What the first run that failed raised, without its traceback; None: none failed."""
        return self.traceback and self.traceback.strip().splitlines()[-1]

    @property
    def place(self) -> str:
        """File and line at which it did, outside this package and the libraries if possible."""
        line = users_line(self.traceback or "")
        return "no file" if line is None else ":".join(line)


def play(
    runs: Sequence[Run],
    engine: Engine,
    store: Runs,
    title: str,
    end: float | None = None,
    *,
    has_worked: bool = True,
    more: Callable[[], Sequence[Run]] | None = None,
    n_most: Callable[[], int] | None = None,
) -> tuple[list[str | None], int]:
    """Play runs and keep each in the store at once; show a progress bar.

    Args:
        more: called when all are played; returns the runs that they make necessary. None: none.
        n_most: returns how many runs are left at most, with those that may become necessary; called
            at the start and after `more`. None: as many as are known.
        end: when to stop (`time.monotonic`) [s]; None: when all are played.
        has_worked: whether a run of the study has succeeded. While none has, it stops as soon as
            every condition has failed, at more than one seed, in as many runs as a condition has.

    Returns:
        What each run raised, as they finished; None: it succeeded. And how many runs are left.
    """
    queue = RunQueue(runs, may_grow=more is not None)
    errors: list[str | None] = []
    failed: list[Run] = []
    n_played_at_growth = -1  # how many were played when others joined the queue
    goes_on = True
    n_runs = n_most() if n_most else len(runs)
    with ProgressBar(title, n_runs, "runs at most" if n_most else "runs") as progress:
        while goes_on and len(queue):
            # Closed at once where this stops early, so that no worker outlives it.
            with closing(engine(queue)) as finished:
                for run, outcome in finished:
                    store.add([(run, outcome)])
                    errors.append(outcome.error)
                    if outcome.error is None:
                        has_worked = True
                    else:
                        failed.append(run)
                    progress.reach(len(errors), f"{len(failed)} failed")
                    is_late = end is not None and time.monotonic() > end
                    if is_late or (not has_worked and _is_hopeless(runs, failed)):
                        return errors, queue.total - len(errors)
                    if more and len(errors) == queue.total:
                        n_played_at_growth = len(errors)
                        queue.extend(more())
                        n_runs = len(errors) + n_most() if n_most else queue.total
                        progress.extend(n_runs)
            # An engine that took all runs at once ends when others join them: it is called again.
            goes_on = len(errors) == n_played_at_growth
    return errors, queue.total - len(errors)


def _is_hopeless(runs: Sequence[Run], failed: Sequence[Run]) -> bool:
    """Return whether these failures, without a success, say that all the others will fail."""
    cases = {run.case.key for run in runs}
    seeds = {run.seed for run in runs}
    # A fault or a size alone, or a single seed, may be what a policy cannot do.
    return (
        len(failed) >= len(runs) / len(cases)
        and {run.case.key for run in failed} == cases
        and len({run.seed for run in failed}) >= min(2, len(seeds))
    )


def serial(runs: Iterable[Run]) -> Played:
    """Play the runs one after the other in this process."""
    for run in runs:
        yield run, run.play()


RUN_LIMIT = 3600.0  # [s], far more than an episode takes, and less than for ever


def engine_named(
    name: str,
    processes: int | None = None,
    address: str | None = None,
    run_limit: float | None = None,
) -> Engine:
    """Return an engine.

    Args:
        name: "local": this process; "process": worker processes on this machine; "ray": a cluster.
        processes: the number of worker processes, or of cores of a local cluster; None means one
            for each core that this process may use. On Windows there are 61 at most.
        address: the address of the Ray cluster; None starts one on this machine.
        run_limit: wall-clock time after which a worker process ends a run, which has failed then
            [s]; None: `RUN_LIMIT`. Other engines wait for ever.

    Raises:
        StudyError: there is no such engine, or it has no use for one of the arguments.
    """
    if name not in ENGINES:
        raise StudyError(f"no engine {name!r}{suggest(name, ENGINES)}")
    if address is not None and name != "ray":
        raise StudyError(f"engine {name}: only ray has an address")
    if run_limit is not None and name != "process":
        raise StudyError(f"engine {name}: only process, whose workers can be ended, has run_limit")
    if run_limit is not None and not 0.0 < run_limit <= threading.TIMEOUT_MAX:
        raise StudyError(f"run_limit = {run_limit:g}: should be above 0 s")
    if name == "local":
        if processes not in (None, 1):
            raise StudyError(f"engine local: is one process, not {processes}")
        return serial
    if name == "process":
        count = min(processes or usable_cores(), _MOST_WORKERS)
        return partial(in_processes, count, run_limit or RUN_LIMIT)
    if address is not None and processes is not None:
        raise StudyError("engine ray: a cluster that runs already has its own number of cores")
    return partial(_on_ray, address, processes)


# More handles cannot be waited for at once.
_MOST_WORKERS = 61 if sys.platform == "win32" else sys.maxsize


def usable_cores() -> int:
    """Return how many cores this process may use; `taskset` and queues of clusters limit them."""
    if hasattr(os, "process_cpu_count"):  # from Python 3.13 on
        return os.process_cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


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
    waiting = runs if isinstance(runs, RunQueue) else RunQueue(runs)
    ray, started_here = _connected(address, cores)
    pending: dict[Hashable, Run] = {}
    try:
        sent = ray.remote(num_cpus=1, max_retries=RETRIES)(play_pickled)
        # A policy travels with every run, so only a few runs are sent at a time.
        limit = QUEUED_PER_CORE * max(1, int(ray.cluster_resources().get("CPU", 1)))
        while pending or waiting:
            while waiting and len(pending) < limit:
                run = next(waiting)
                pending[sent.remote(pickled(run), current_folder_modules())] = run
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
        if started_here:
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
