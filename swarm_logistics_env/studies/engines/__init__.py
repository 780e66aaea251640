"""Engines: what plays the runs. Whichever does, the outcomes are the same; their order is not."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable

from swarm_logistics_env.errors import StudyError, suggest
from swarm_logistics_env.studies.conditions import Run
from swarm_logistics_env.studies.execution import Outcome, execute

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
        processes: how many worker processes, or cores of a local cluster; None: one a core.
        address: of the Ray cluster; None: one on this machine.

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
        from swarm_logistics_env.studies.engines.processes import Processes

        return Processes(processes or os.cpu_count() or 1)
    from swarm_logistics_env.studies.engines.cluster import Cluster

    if address is not None and processes is not None:
        raise StudyError("engine ray: a cluster that runs already has its own number of cores")
    return Cluster(address, processes)
