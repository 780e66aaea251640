"""Engines: the same exports whichever plays a study, when one ends, and which are refused."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core import progress_bar
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import PolicySpec, SwarmDT
from swarm_logistics_env.study.runs import engines
from swarm_logistics_env.study.runs.engines import Engine, Shard, Tally, engine_named, play
from swarm_logistics_env.study.runs.notes import merge
from swarm_logistics_env.study.runs.store import Runs
from swarm_logistics_env.study.runs.worker_processes import Played, RunQueue
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from tests.conftest import SMALL
from tests.made_up import digest

has_ray = importlib.util.find_spec("ray") is not None

CASE = Case(PolicySpec(name="swarm-dt"), "identity", Scenario(), task=WAREHOUSE)
OTHER_CASE = replace(CASE, behaviour=1)
TRACEBACK = (
    'Traceback (most recent call last):\n  File "mine.py", line 3, in act\n    fail()\n'
    "RuntimeError: a wheel came off\n"
)


def runs_of(*cases: Case, seeds: int = 3) -> list[Run]:
    return [Run(case, "code", seed) for seed in range(seeds) for case in cases]


def engine_that_fails(*failing: tuple[int, int]) -> Engine:
    """Return an engine whose runs fail at these behaviours and seeds."""

    def engine(runs: Iterable[Run]) -> Played:
        for run in runs:
            fails = (run.case.behaviour, run.seed) in failing
            yield run, Outcome(error=TRACEBACK if fails else None)

    return engine


def test_two_processes(played: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert Study(out=out, **SMALL).run("process", processes=2).failed == 0
    assert digest(out, tmp_path) == digest(played, tmp_path)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no CPUs to choose here")
def test_there_are_as_many_workers_as_this_process_may_use_cores(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def cores() -> object:
        engine: Any = engine_named("process")
        return engine.args[0]

    before = os.sched_getaffinity(0)
    assert cores() == len(before)
    os.sched_setaffinity(0, {min(before)})  # as taskset does
    try:
        assert cores() == 1
    finally:
        os.sched_setaffinity(0, before)
    monkeypatch.setattr(engines, "_MOST_WORKERS", 61)
    monkeypatch.setattr(engines, "usable_cores", lambda: 128)
    assert cores() == 61


@pytest.mark.unmeasured
def test_two_shards_merged(played: Path, tmp_path: Path) -> None:
    parts, half = [tmp_path / "1", tmp_path / "2"], len(Study.stored(played).plan().runs) // 2
    for number, part in enumerate(parts, start=1):
        assert Study(out=part, **SMALL).run(shard=Shard(number, 2)).played == half
        assert Study(out=part, **SMALL).run(shard=Shard(number, 2)).kept == half
    merge(parts, tmp_path)
    assert digest(tmp_path, tmp_path) == digest(played, tmp_path)
    assert not Study.stored(tmp_path).findings().exploratory


@pytest.mark.skipif(not has_ray, reason="ray is not installed")
@pytest.mark.filterwarnings("ignore")  # of ray's own
def test_ray_with_two_local_nodes(played: Path, tmp_path: Path) -> None:
    from ray.cluster_utils import Cluster

    out = tmp_path / "out"
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        cluster.add_node(num_cpus=1)
        tally = Study(out=out, **SMALL).run("ray", address=cluster.address)
    finally:
        cluster.shutdown()
    assert tally.failed == 0
    assert digest(out, tmp_path) == digest(played, tmp_path)
    study = Study(**{**SMALL, "faults": [], "parameters": []})
    assert study.run("ray", processes=1).failed == 0  # on a node that it starts


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("engine", "fields", "words"),
    [
        ("proces", {}, r"did you mean 'process'\?"),
        ("local", {"processes": 0}, "^engine local: is one process, not 0$"),
        ("local", {"processes": 2}, "^engine local: is one process, not 2$"),
        ("local", {"address": "auto"}, "^engine local: only ray has an address$"),
        ("process", {"address": "auto"}, "^engine process: only ray has an address$"),
        ("local", {"run_limit": 3.0}, "^engine local: only process, whose .* has run_limit$"),
        ("ray", {"run_limit": 3.0}, "^engine ray: only process, whose .* has run_limit$"),
        ("process", {"run_limit": 0.0}, "^run_limit = 0: should be above 0 s$"),
        ("process", {"run_limit": -1.0}, "^run_limit = -1: should be above 0 s$"),
        ("process", {"run_limit": 1e30}, r"^run_limit = 1e\+30: should be above 0 s$"),
        ("ray", {"address": "auto", "processes": 2}, "its own number of cores"),
        ("ray", {"address": "auto"}, "no Ray cluster at auto" if has_ray else r"\.\[ray\]"),
    ],
)
def test_an_engine_that_cannot_be_is_refused(engine: str, fields: Any, words: str) -> None:
    with pytest.raises(StudyError, match=words):
        Study(**SMALL).run(engine, **fields)


def test_workers_end_a_run_after_an_hour_unless_somebody_says_otherwise() -> None:
    for limit, expected in ((None, (3, 3600.0)), (2.5, (3, 2.5))):
        engine: Any = engine_named("process", 3, run_limit=limit)
        assert engine.args == expected
    assert engine_named("local") is engine_named("local", 1)
    of_this_machine: Any = engine_named("ray", 2)
    of_a_cluster: Any = engine_named("ray", address="auto")
    assert (of_this_machine.args, of_a_cluster.args) == ((None, 2), ("auto", None))


def test_a_shard_is_named_by_its_number_and_count() -> None:
    shard = Shard.parse("2/3")
    assert (str(shard), shard.directory) == ("2/3", "shard-2-of-3")
    assert shard.of(runs_of(CASE, seeds=5)) == runs_of(CASE, seeds=5)[1::3]
    for text, words in (
        ("4/3", "^shard 4/3: should be i/n with i from 1 to n$"),
        ("2", "e.g. 2/8$"),
    ):
        with pytest.raises(StudyError, match=words):
            Shard.parse(text)


def test_a_tally_tells_what_went_wrong_first_and_where() -> None:
    failed = Tally(3, 1, 0, 2.0, TRACEBACK)
    assert (failed.error, failed.place) == ("RuntimeError: a wheel came off", "mine.py:3")
    well = Tally(3, 0, 0, 2.0)
    assert (well.error, well.place, well.left, well.gave_up) == (None, "no file", 0, False)


BOTH = [(behaviour, seed) for seed in range(3) for behaviour in (0, 1)]


@pytest.mark.parametrize(
    ("failing", "has_worked", "n_played"),
    [
        (BOTH, False, 3),
        (BOTH, True, 6),
        (BOTH[1:], False, 6),  # the first one works
        ([pair for pair in BOTH if pair[0]], False, 6),  # one condition works
        (BOTH[:2], False, 6),  # one seed fails alone
    ],
)
def test_it_gives_up_once_every_condition_failed_at_two_seeds_and_nothing_worked(
    failing: Sequence[tuple[int, int]], has_worked: bool, n_played: int
) -> None:
    with Runs(None) as store:
        runs = runs_of(CASE, OTHER_CASE)
        errors, left = play(runs, engine_that_fails(*failing), store, "mine", has_worked=has_worked)
        assert (len(errors), left, len(store)) == (n_played, 6 - n_played, n_played)
        expected = [(run.case.behaviour, run.seed) in failing for run in runs[:n_played]]
        assert [error is not None for error in errors] == expected


def test_of_a_single_seed_every_condition_has_to_fail() -> None:
    with Runs(None) as store:
        runs = runs_of(CASE, OTHER_CASE, replace(CASE, behaviour=2), seeds=1)
        fails = engine_that_fails((0, 0), (1, 0), (2, 0))
        assert len(play(runs, fails, store, "mine", has_worked=False)[0]) == 3
        errors, left = play(runs_of(CASE, seeds=9), fails, store, "mine", has_worked=False)
        assert (len(errors), left) == (9, 0)


@pytest.mark.parametrize(("end", "n_played"), [(-1.0, 1), (600.0, 6), (None, 6)])
def test_no_run_is_begun_when_the_time_is_over(end: float | None, n_played: int) -> None:
    with Runs(None) as store:
        stop_at = None if end is None else time.monotonic() + end
        errors, left = play(runs_of(CASE, OTHER_CASE), engine_that_fails(), store, "mine", stop_at)
        assert (len(errors), left) == (n_played, 6 - n_played)


@pytest.mark.parametrize("takes_all", [False, True])
def test_runs_that_become_necessary_are_played_and_counted(
    takes_all: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    further = [runs_of(OTHER_CASE, seeds=2), runs_of(replace(CASE, behaviour=2), seeds=1), []]
    engine = engine_that_fails((0, 1))
    most = iter([9, 5, 1, 0])

    def all_at_once(runs: Iterable[Run]) -> Played:
        yield from engine(list(runs))

    with Runs(None) as store:
        errors, left = play(
            runs_of(CASE, seeds=2),
            all_at_once if takes_all else engine,
            store,
            "mine",
            more=lambda: further.pop(0),
            n_most=lambda: next(most),
        )
        assert (len(errors), left, len(store)) == (5, 0, 5)
        assert [error is not None for error in errors] == [False, True, False, False, False]
    lines = [line.partition(",")[0] for line in capsys.readouterr().err.splitlines()]
    assert lines[:3] == [
        "mine: 1 of 9 runs at most", "mine: 2 of 9 runs at most", "mine: 3 of 7 runs at most",
    ]  # fmt: skip
    assert not further


def test_without_a_limit_the_runs_that_are_known_are_counted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    with Runs(None) as store:
        play(runs_of(CASE, seeds=3), engine_that_fails((0, 0)), store, "mine")
    line = capsys.readouterr().err.splitlines()[0]
    assert re.match(r"mine: 1 of 3 runs, .*1 failed", line)


def test_a_queue_goes_on_after_its_end() -> None:
    first, second = runs_of(CASE, seeds=2), runs_of(OTHER_CASE, seeds=1)
    queue = RunQueue(first, may_grow=True)
    assert (next(queue), len(queue), queue.total) == (first[0], 1, 2)
    assert [*queue] == first[1:]
    queue.extend(second)
    assert (len(queue), queue.total, [*queue]) == (1, 3, second)
    assert RunQueue([]).may_grow is False


class Remembering(SwarmDT):
    """Changes with every episode that one object plays, and keeps the seeds of all."""

    identity = "remembering"
    episodes = 0
    seeds: list[int] = []  # noqa: RUF012 - shared by the copies that runs play

    def reset(self, n_robots: int, seed: int) -> None:
        super().reset(n_robots, seed + self.episodes)
        self.episodes += 1
        Remembering.seeds.append(seed)


def test_other_behaviour_meets_the_same_worlds_and_nothing_is_remembered() -> None:
    scenario = Scenario(n_robots=3, n_items=5, warehouse_width=3, warehouse_height=3, duration=10)
    usual_case = Case(PolicySpec.of(Remembering()), "remembering", scenario, task=WAREHOUSE)
    cases = usual_case, replace(usual_case, behaviour=1), usual_case
    runs = [Run(case, WAREHOUSE.code(), seed) for seed in (0, 1) for case in cases]
    outcomes = [run.play() for run in runs]
    assert {outcome.error for outcome in outcomes} == {None}
    assert outcomes[0].digest == outcomes[2].digest != outcomes[1].digest
    first, other_first, again, second, other_second, _ = Remembering.seeds[-6:]
    assert (first, again, second) == (0, 0, 1)
    assert len({first, second, other_first, other_second}) == 4
    stale = Run(usual_case, "0" * 16, 0).play()
    assert "the package changed while the study ran" in str(stale.error)


def test_workers_end_with_a_parent_that_is_killed() -> None:
    script = (
        "import os, signal\n"
        "from swarm_logistics_env.study.runs.worker_processes import workers\n"
        "if __name__ == '__main__':\n"
        "    with workers(2) as pool:\n"
        "        print(len({pool.submit(os.getpid).result() for _ in range(20)}), flush=True)\n"
        "        os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    pipes: Any = {"stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    killed = subprocess.Popen([sys.executable, "-c", script], start_new_session=True, **pipes)
    try:
        # Its workers write there as well, so that it ends only once they have ended.
        printed, _ = killed.communicate(timeout=600)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(killed.pid, signal.SIGKILL)
    assert int(printed) >= 1
    assert killed.returncode == -signal.SIGKILL
