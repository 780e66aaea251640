"""What a store says of damage, and of runs that were written without digests."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from tests.made_up import delivered, made_old

CASE = Case(PolicySpec(name="swarm-dt"), "identity", Scenario(), task=WAREHOUSE)


def stored(path: Path, n_runs: int) -> list[str]:
    """Write so many runs; return their keys, ascending."""
    runs = [Run(CASE, "code", seed) for seed in range(n_runs)]
    with Runs(path) as store:
        store.add((run, delivered(run.seed, ended_at=60.0)) for run in runs)
    return sorted(run.key for run in runs)


def change(path: Path, statement: str, *values: object) -> None:
    with closing(sqlite3.connect(path)) as database, database:
        database.execute(statement, values)


@pytest.mark.parametrize("n_damaged", [0, 1, 3, 4])
def test_damage_is_told_by_the_first_three_runs(n_damaged: int, tmp_path: Path) -> None:
    path = tmp_path / FILE_NAME
    keys = stored(path, 6)
    for key in keys[:n_damaged]:
        change(path, "UPDATE runs SET outcome = '{}' WHERE key = ?", key)
    named = ", ".join(key[:12] for key in keys[:3])
    words = {
        1: f"1 run of {path} is damaged and left out ({keys[0][:12]})",
        3: f"3 runs of {path} are damaged and left out ({named})",
        4: f"4 runs of {path} are damaged and left out ({named}, ..)",
    }.get(n_damaged)
    with Runs(path) as store:
        assert store.damage() == words
        assert store.succeeded() == set(keys[n_damaged:])
        assert len(store.outcomes(Run(CASE, "code", seed) for seed in range(6))) == 6 - n_damaged
        assert store.damage() == words
        assert len(store) == 6
        assert store.discard_damaged() == words
        assert (store.damage(), len(store)) == (None, 6 - n_damaged)


def test_a_damaged_note_is_refused(tmp_path: Path) -> None:
    path = tmp_path / FILE_NAME
    with Runs(path) as store:
        store.note("study", "first")
        store.note("study", "second")
        assert store.notes() == {"study": "second"}
    change(path, "UPDATE notes SET value = 'third'")
    with Runs(path) as store, pytest.raises(StudyError) as refused:
        store.notes()
    assert str(refused.value) == (
        f"the store {path} is damaged: a note in it is not as it was written; its runs can be "
        "exported (swarm-logistics study export)"
    )


def test_a_store_without_digests_is_read_and_gets_them_when_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / FILE_NAME
    keys = stored(path, 2)
    with Runs(path) as store:
        store.note("study", "value")
    made_old(path)
    before = path.read_bytes()
    with Runs.existing(tmp_path) as store:
        assert (store.succeeded(), store.notes()) == (set(keys), {"study": "value"})
    assert path.read_bytes() == before
    with Runs(path) as store:
        assert (store.succeeded(), store.notes()) == (set(keys), {"study": "value"})
    change(path, "UPDATE runs SET run = replace(run, 'identity', 'other') WHERE key = ?", keys[0])
    with Runs.existing(tmp_path) as store:
        assert store.succeeded() == {keys[1]}
