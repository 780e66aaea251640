"""What playing tells: shards, tallies, when it gives up, and what a progress bar counts."""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core import progress_bar
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.runs.engines import Engine, Shard, Tally, engine_named, play
from swarm_logistics_env.study.runs.store import Runs
from swarm_logistics_env.study.runs.worker_processes import Played, RunQueue
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE

CASE = Case(PolicySpec(name="swarm-dt"), "identity", Scenario(), task=WAREHOUSE)
OTHER = replace(CASE, behaviour=1)
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
    ("failing", "has_worked", "played"),
    [
        (BOTH, False, 3),
        (BOTH, True, 6),
        (BOTH[1:], False, 6),  # the first one works
        ([pair for pair in BOTH if pair[0]], False, 6),  # one condition works
        (BOTH[:2], False, 6),  # one seed fails alone
    ],
)
def test_it_gives_up_once_every_condition_failed_at_two_seeds_and_nothing_worked(
    failing: Sequence[tuple[int, int]], has_worked: bool, played: int
) -> None:
    with Runs(None) as store:
        runs = runs_of(CASE, OTHER)
        errors, left = play(runs, engine_that_fails(*failing), store, "mine", has_worked=has_worked)
        assert (len(errors), left, len(store)) == (played, 6 - played, played)
        expected = [(run.case.behaviour, run.seed) in failing for run in runs[:played]]
        assert [error is not None for error in errors] == expected


def test_of_a_single_seed_every_condition_has_to_fail() -> None:
    with Runs(None) as store:
        runs = runs_of(CASE, OTHER, replace(CASE, behaviour=2), seeds=1)
        fails = engine_that_fails((0, 0), (1, 0), (2, 0))
        assert len(play(runs, fails, store, "mine", has_worked=False)[0]) == 3
        errors, left = play(runs_of(CASE, seeds=9), fails, store, "mine", has_worked=False)
        assert (len(errors), left) == (9, 0)


@pytest.mark.parametrize(("end", "played"), [(-1.0, 1), (600.0, 6), (None, 6)])
def test_no_run_is_begun_when_the_time_is_over(end: float | None, played: int) -> None:
    with Runs(None) as store:
        stop_at = None if end is None else time.monotonic() + end
        errors, left = play(runs_of(CASE, OTHER), engine_that_fails(), store, "mine", stop_at)
        assert (len(errors), left) == (played, 6 - played)


@pytest.mark.parametrize("takes_all", [False, True])
def test_runs_that_become_necessary_are_played_and_counted(
    takes_all: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    further = [runs_of(OTHER, seeds=2), runs_of(replace(CASE, behaviour=2), seeds=1), []]
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
    told = [line.partition(",")[0] for line in capsys.readouterr().err.splitlines()]
    assert told[:3] == [
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
    first, second = runs_of(CASE, seeds=2), runs_of(OTHER, seeds=1)
    queue = RunQueue(first, may_grow=True)
    assert (next(queue), len(queue), queue.total) == (first[0], 1, 2)
    assert [*queue] == first[1:]
    queue.extend(second)
    assert (len(queue), queue.total, [*queue]) == (1, 3, second)
    assert RunQueue([]).may_grow is False


@pytest.mark.parametrize(
    ("name", "fields", "words"),
    [
        ("local", {"processes": 0}, "engine local: is one process, not 0"),
        ("local", {"address": "auto"}, "engine local: only ray has an address"),
        ("process", {"run_limit": 0.0}, "run_limit = 0: should be above 0 s"),
        ("process", {"run_limit": 1e30}, r"run_limit = 1e\+30: should be above 0 s"),
    ],
)
def test_an_engine_is_refused_with_the_argument_that_it_has_no_use_for(
    name: str, fields: dict[str, Any], words: str
) -> None:
    with pytest.raises(StudyError, match=f"^{words}$"):
        engine_named(name, **fields)


def test_workers_end_a_run_after_an_hour_unless_somebody_says_otherwise() -> None:
    for limit, expected in ((None, (3, 3600.0)), (2.5, (3, 2.5))):
        engine: Any = engine_named("process", 3, run_limit=limit)
        assert engine.args == expected
    assert engine_named("local") is engine_named("local", 1)
    of_this_machine: Any = engine_named("ray", 2)
    of_a_cluster: Any = engine_named("ray", address="auto")
    assert (of_this_machine.args, of_a_cluster.args) == ((None, 2), ("auto", None))
