"""What becomes of runs whose worker dies or takes too long, by a pool that stands for workers."""

from __future__ import annotations

import faulthandler
import pickle
import signal
import threading
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from pathlib import Path
from typing import Any, TextIO

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.compiler.numba_fence import QUIET
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.runs import worker_processes
from swarm_logistics_env.study.runs.worker_processes import in_processes
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE

CASE = Case(PolicySpec(name="swarm-dt"), "identity", Scenario(), task=WAREHOUSE)
REPORT = "Timeout (0:00:03)!\n  File a.py, line 2 in act\n  File b.py, line 1 in play\n"
OVER_LIMIT = (
    "  File b.py, line 1 in play\n  File a.py, line 2 in act\n"
    "RunLimit: a run took longer than the limit of 3 s (run_limit, --run-limit)\n"
)


class Pool:
    """Lets each run end as the first of its endings says, which it takes out."""

    def __init__(self, endings: dict[int, list[str]]) -> None:
        self.endings = endings

    def submit(self, play: Any, message: bytes, modules: object, watch: Any) -> Future[Outcome]:
        run: Run = pickle.loads(message)
        ending = self.endings[run.seed].pop(0)
        future = Future[Outcome]()
        if ending == "dead before":
            raise BrokenProcessPool
        if ending == "hangs":
            (watch.reports / run.key).write_text(REPORT)
        if ending == "plays":
            future.set_result(play(message, None, watch))
            assert not any(watch.reports.iterdir())
        elif ending == "done":
            future.set_result(Outcome(ended_at=float(run.seed)))
        else:
            future.set_exception(BrokenProcessPool())
        return future


@pytest.mark.parametrize(
    ("endings", "error"),
    [
        (["dies", "done"], None),
        (["dead before", "done"], None),
        (["dies", "dies"], "WorkerDied: two worker processes ended in this run"),
        (["hangs"], OVER_LIMIT),
        (["dies", "hangs"], OVER_LIMIT),
    ],
)
def test_a_run_whose_worker_died_is_played_once_more_alone_unless_it_took_too_long(
    endings: list[str], error: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    pool = Pool({0: ["done"], 1: [*endings], 2: ["done"], 3: ["done"]})
    sizes: list[int] = []

    def workers(count: int) -> nullcontext[Pool]:
        sizes.append(count)
        return nullcontext(pool)

    monkeypatch.setattr(worker_processes, "workers", workers)
    runs = [Run(CASE, "code", seed) for seed in range(4)]
    outcomes = {run.seed: outcome for run, outcome in in_processes(2, 3.0, runs)}
    assert {seed: outcome.error for seed, outcome in outcomes.items()} == {
        **dict.fromkeys(range(4)),
        1: error,
    }
    assert [outcomes[seed].ended_at for seed in (0, 2, 3)] == [0.0, 2.0, 3.0]
    assert not any(pool.endings.values())
    assert sizes == ([2, 1, 2] if len(endings) > 1 else [2, 2])


def test_only_the_main_thread_has_workers_ignore_ctrl_c() -> None:
    handlers = []

    def start() -> None:
        with worker_processes._interrupts_ignored():
            handlers.append(signal.getsignal(signal.SIGINT))

    usual = signal.getsignal(signal.SIGINT)
    start()
    thread = threading.Thread(target=start)
    thread.start()
    thread.join()
    assert handlers == [signal.SIG_IGN, usual]
    assert signal.getsignal(signal.SIGINT) == usual


def test_a_worker_ends_in_a_run_that_takes_too_long_and_leaves_no_report_of_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    run = Run(CASE, "old code", 0)
    calls: list[object] = []

    def begin(limit: float, *, exit: bool, file: TextIO) -> None:
        calls.append((limit, exit, Path(file.name).name))

    monkeypatch.setattr(faulthandler, "dump_traceback_later", begin)
    monkeypatch.setattr(faulthandler, "cancel_dump_traceback_later", lambda: calls.append("ends"))
    monkeypatch.setattr(worker_processes, "workers", lambda _: nullcontext(Pool({0: ["plays"]})))
    monkeypatch.setenv(QUIET, "1")  # which a worker sets
    ((_, outcome),) = in_processes(1, 3.0, [run])
    assert "the package changed while the study ran" in str(outcome.error)
    assert calls == [(3.0, True, run.key), "ends"]
