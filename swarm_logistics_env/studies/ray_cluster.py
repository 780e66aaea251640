"""Ray: runs are tasks on the nodes of a cluster; only this process writes."""

from __future__ import annotations

import os
import traceback
from collections.abc import Generator, Iterable
from types import ModuleType
from typing import Any

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.kernels import QUIET
from swarm_logistics_env.tasks.task import Outcome

from .engines import execute
from .runs import Run

RETRIES = 1  # after a worker's death, as local processes do
QUEUED_PER_CORE = 2  # so that no core waits for this process


def _execute_quietly(run: Run) -> Outcome:
    os.environ[QUIET] = "1"
    return execute(run)


class Cluster:
    """An engine of the cores of a Ray cluster.

    Start one by `ray start --head` on one machine and `ray start --address ...` on the others,
    all with this version of the package.

    Args:
        address: the cluster's address; "auto" means the one that this machine belongs to; None
            starts one on this machine while the study runs.
        cores: the number of cores of a cluster that is started here; None means all.

    Raises:
        StudyError: ray is not installed, or there is no cluster at that address.
    """

    def __init__(self, address: str | None = None, cores: int | None = None) -> None:
        self.address = address
        self.cores = cores

    def __call__(self, runs: Iterable[Run]) -> Generator[tuple[Run, Outcome], None, None]:
        """Yield each run with its outcome, as they finish."""
        waiting = iter(runs)
        first = next(waiting, None)
        if first is None:
            return
        ray, ours = self._connected()
        pending: dict[Any, Run] = {}
        try:
            play = ray.remote(num_cpus=1, max_retries=RETRIES)(_execute_quietly)
            # A policy travels with every run, so only a few runs are sent at a time.
            limit = QUEUED_PER_CORE * max(1, int(ray.cluster_resources().get("CPU", 1)))
            pending[_submitted(play, first)] = first
            while pending:
                while len(pending) < limit and (run := next(waiting, None)) is not None:
                    pending[_submitted(play, run)] = run
                for task in ray.wait(list(pending), num_returns=1)[0]:
                    run = pending.pop(task)
                    yield run, _outcome(ray, task, run)
        finally:
            for task in pending:
                ray.cancel(task, force=True)
            if ours:
                ray.shutdown()

    def _connected(self) -> tuple[ModuleType, bool]:
        """Return ray, and whether the connection was made here."""
        try:
            import ray
        except ImportError:
            raise StudyError(
                "the engine ray needs Ray: pip install 'swarm-logistics-env[ray]'"
            ) from None
        if ray.is_initialized():
            return ray, False
        # Its reports of use are for the user to switch on.
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        quiet = {"logging_level": "error", "log_to_driver": False}
        try:
            if self.address is None:
                # "local": never a cluster that happens to run here.
                ray.init("local", num_cpus=self.cores, include_dashboard=False, **quiet)
            else:
                ray.init(self.address, **quiet)
        except (ConnectionError, RuntimeError, ValueError) as error:
            reason = str(error).strip().splitlines()[0]
            raise StudyError(f"no Ray cluster at {self.address}: {reason}") from error
        return ray, True


def _submitted(play: Any, run: Run) -> Any:
    try:
        return play.remote(run)
    except TypeError as error:
        raise StudyError(
            f"policy {run.condition.policy.label!r} cannot be sent to another process "
            f"({str(error).splitlines()[0]}): use the engine local"
        ) from error


def _outcome(ray: ModuleType, task: Any, run: Run) -> Outcome:
    try:
        outcome: Outcome = ray.get(task)
    except ray.exceptions.RayError:  # its worker died twice, or cannot import the policy
        return Outcome(run.key, error=traceback.format_exc())
    return outcome
