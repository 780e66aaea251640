"""Engines: what plays the runs. Whichever does, the outcomes are the same; their order is not."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable

from swarm_logistics_env.studies.conditions import Run
from swarm_logistics_env.studies.execution import Outcome, execute

Engine = Callable[[Iterable[Run]], Generator[tuple[Run, Outcome], None, None]]


def serial(runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
    """Play the runs one after the other in this process."""
    for run in runs:
        yield run, execute(run)
