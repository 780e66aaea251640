"""The store of a study: what is finished stays, whatever else is killed, refused or damaged."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.runs import Condition, Run, StudiedPolicy
from swarm_logistics_env.studies.store import FILE_NAME, Store, new_store, refuse_study_in
from swarm_logistics_env.tasks.task import Outcome
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE

POLICY = StudiedPolicy("mine", "identity", "swarm-dt")


def run(seed: int) -> Run:
    return Condition(POLICY, Scenario(), task=WAREHOUSE).run("code", seed)


def outcome(of: Run, times: list[float]) -> Outcome:
    return Outcome(of.key, np.array(times), 500.0, False, (3,), 1.5, wall_seconds=0.1)


def test_result_survives_closing(tmp_path: Path) -> None:
    times = [0.1, 1 / 3, 499.99999999999994]
    with Store(tmp_path / FILE_NAME) as store:
        store.add(run(0), outcome(run(0), times))
    with Store.existing(tmp_path) as store:
        (kept,) = store.outcomes([run(0), run(1)]).values()
    assert kept.delivery_times.tolist() == times
    assert (kept.delivered, kept.ended_at, kept.failed_robots) == (3, 500.0, (3,))
    assert kept.anchoring_seconds == 1.5
    assert kept.error is None


def test_failure_is_kept_until_the_run_succeeds_and_success_for_good() -> None:
    with Store(None) as store:
        store.add(run(0), Outcome(run(0).key, error="Traceback: first"))
        assert store.succeeded() == set()
        (row,) = store.rows()
        assert row["error"] == "Traceback: first"
        assert row["delivered"] is None
        store.add(run(0), outcome(run(0), [1.0]))
        assert store.succeeded() == {run(0).key}
        store.add(run(0), Outcome(run(0).key, error="Traceback: late"))
        store.add(run(0), outcome(run(0), [1.0, 2.0]))
        (row,) = store.rows()
        assert (row["delivered"], row["error"]) == (1, None)


def test_rows_are_sorted_and_know_no_wall_time() -> None:
    with Store(None) as store:
        for seed in range(20):
            store.add(run(seed), outcome(run(seed), [1.0]))
        rows = list(store.rows())
    assert [row["run"] for row in rows] == sorted(row["run"] for row in rows)
    assert "wall_seconds" not in rows[0]


def test_unfinished_transaction_leaves_what_was_there(tmp_path: Path) -> None:
    with Store(tmp_path / FILE_NAME) as store:
        store.add(run(0), outcome(run(0), [1.0]))
        (pages,) = store._connection.execute("PRAGMA page_count").fetchone()
        store._connection.execute(f"PRAGMA max_page_count = {pages}")  # the disk is full
        with pytest.raises(StudyError, match="full"):
            store.add(run(1), outcome(run(1), np.arange(100_000.0).tolist()))
        assert store.succeeded() == {run(0).key}
    with Store.existing(tmp_path) as store:
        assert store.succeeded() == {run(0).key}


def spoil_text(path: Path) -> None:
    path.write_text("run,seed\n" * 200)


def spoil_version(path: Path) -> None:
    with Store(path):
        pass
    database = sqlite3.connect(path)
    database.execute("PRAGMA user_version = 99")
    database.close()


def spoil_stranger(path: Path) -> None:
    database = sqlite3.connect(path)
    database.execute("CREATE TABLE runs (x)")
    database.close()


def spoil_truncated(path: Path) -> None:
    with Store(path) as store:
        for seed in range(50):
            store.add(run(seed), outcome(run(seed), [1.0] * 50))
    path.write_bytes(path.read_bytes()[:5000])


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (spoil_text, "not a database"),
        (spoil_version, "store schema 99"),
        (spoil_stranger, "not the store of a study"),
        (spoil_truncated, "malformed"),
    ],
)
def test_what_is_no_store_is_refused_with_the_reason(
    tmp_path: Path, spoil: Any, words: str
) -> None:
    path = tmp_path / FILE_NAME
    spoil(path)
    before = path.read_bytes()
    with pytest.raises(StudyError, match=words), Store(path) as store:
        list(store.rows())
    assert path.read_bytes() == before


def test_store_that_may_not_be_written_is_read_and_left_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # A space and the signs that a URI gives a meaning.
    directory = tmp_path / "a study? 100% #1"
    directory.mkdir()
    path = directory / FILE_NAME
    with Store(path) as store:
        store.add(run(0), outcome(run(0), [1.0]))
    before = path.read_bytes()
    # Root may write everywhere, whatever the mode says.
    monkeypatch.setattr(os, "access", lambda *_: False)
    with Store.existing(directory) as store:
        assert store.succeeded() == {run(0).key}
        assert store.notes() == {}
        with pytest.raises(StudyError, match="readonly database"):
            store.add(run(1), outcome(run(1), [1.0]))
        assert list(directory.iterdir()) == [path]
    assert path.read_bytes() == before

    log = directory / f"{FILE_NAME}-wal"
    log.write_bytes(b"runs")
    with pytest.raises(StudyError, match=f"latest runs are still in {FILE_NAME}-wal: copy both"):
        Store.existing(directory)
    log.unlink()

    path.write_bytes(b"")
    with pytest.raises(StudyError, match="should be a store of schema"):
        Store.existing(directory)


def test_no_study_there(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="no study in"):
        Store.existing(tmp_path)
    assert list(tmp_path.iterdir()) == []


MAKER = """
import pathlib, sys
from swarm_logistics_env.studies.store import Store

for line in sys.stdin:
    with Store(pathlib.Path(line.strip())) as store:
        store.note({sys.argv[1]: "here"})
    print("made", flush=True)
"""


def test_two_processes_may_make_the_store_at_once(tmp_path: Path) -> None:
    makers = [
        subprocess.Popen(
            [sys.executable, "-c", MAKER, str(number)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for number in range(2)
    ]
    with makers[0], makers[1]:
        for attempt in range(15):
            directory = tmp_path / str(attempt)
            directory.mkdir()
            for maker in makers:
                print(directory / FILE_NAME, file=maker.stdin, flush=True)
            for maker in makers:
                assert maker.stdout is not None
                assert maker.stdout.readline() == "made\n"
            with Store.existing(directory) as store:
                assert store.notes() == {"0": "here", "1": "here"}


def test_store_is_there_once_it_is_whole(tmp_path: Path) -> None:
    with new_store(tmp_path / "new") as store:
        store.note({"name": "value"})
        refuse_study_in(tmp_path / "new", "merge")
    with Store.existing(tmp_path / "new") as store:
        assert store.notes() == {"name": "value"}
    assert [path.name for path in (tmp_path / "new").iterdir()] == [FILE_NAME]
    with pytest.raises(StudyError, match="holds a study already: merge into a new directory"):
        refuse_study_in(tmp_path / "new", "merge")


def test_failure_leaves_nothing(tmp_path: Path) -> None:
    def stopped() -> None:
        with new_store(tmp_path) as store:
            store.note({"name": "value"})
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert list(tmp_path.iterdir()) == []


def test_directory_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(StudyError, match=f"cannot write to {file / 'in'}"), new_store(file / "in"):
        pass
