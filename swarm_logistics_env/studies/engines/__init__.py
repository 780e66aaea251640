"""Engines: what plays the runs. Whichever does, the outcomes are the same; their order is not."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Callable, Generator, Iterable
from dataclasses import replace

from swarm_logistics_env.errors import StudyError, suggest
from swarm_logistics_env.studies.runs import Run
from swarm_logistics_env.tasks.task import Outcome

Engine = Callable[[Iterable[Run]], Generator[tuple[Run, Outcome], None, None]]


def serial(runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
    """Play the runs one after the other in this process."""
    for run in runs:
        yield run, execute(run)


NAMES = ("local", "process", "ray")


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
        from swarm_logistics_env.studies.engines.process_pool import ProcessPool

        return ProcessPool(processes or os.cpu_count() or 1)
    from swarm_logistics_env.studies.engines.ray_cluster import Cluster

    if address is not None and processes is not None:
        raise StudyError("engine ray: a cluster that runs already has its own number of cores")
    return Cluster(address, processes)


def execute(run: Run) -> Outcome:
    """Play a run; whatever goes wrong in it is its outcome."""
    start = time.perf_counter()
    condition = run.condition
    try:
        code = condition.task.code()
        if run.code != code:
            raise StudyError(
                f"this process runs code version {code}, the study {run.code}: "
                "the package changed while the study ran"
            )
        outcome = condition.task.play(condition.policy.source, condition, run.seed, run.policy_seed)
    except Exception:  # noqa: BLE001 - kept as the run's row, and blocks the verdict
        outcome = Outcome("", error=traceback.format_exc())
    return replace(outcome, run=run.key, wall_seconds=time.perf_counter() - start)
