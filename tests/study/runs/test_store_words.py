"""What a store says of damage, of other results, and of what changed since its runs were played."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.fingerprint import UNSTABLE
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.questions.plan import make_plan
from swarm_logistics_env.study.questions.specification import Specification
from swarm_logistics_env.study.runs.notes import StoredStudy, note
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs, export
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
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
        assert len(store) == 6 - n_damaged


def test_of_the_runs_of_a_store_those_that_are_asked_for_are_shown(tmp_path: Path) -> None:
    path = tmp_path / FILE_NAME
    keys = stored(path, 3)
    with Runs(path) as store:
        assert store.frame()["run"].tolist() == keys
        rows = store.frame([keys[2], keys[0], "nobody"])
        assert rows["run"].tolist() == [keys[0], keys[2]]
        assert len(store.frame([])) == 0
    assert set(rows["policy_identity"]) == {"identity"}
    assert set(rows["longest_standstill"]) <= {60.0, 59.0}
    with Runs(None) as empty:
        assert export(empty, tmp_path / "none.csv")[0] == 0
        with pytest.raises(StudyError, match=r"cannot export to .*rows\.txt: should end in \.csv$"):
            export(empty, tmp_path / "rows.txt")


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


def test_another_result_of_a_run_is_no_part_of_the_same_study(tmp_path: Path) -> None:
    run = Run(CASE, "code", 7)
    for name, outcome in (("a", delivered(2)), ("b", delivered(3)), ("failed", Outcome(error="x"))):
        with Runs(tmp_path / name) as store:
            store.add([(run, outcome)])
    with Runs(tmp_path / "a") as store, Runs(tmp_path / "b") as other:
        store.absorb(store)
        with pytest.raises(StudyError) as refused:
            store.absorb(other)
        assert str(refused.value) == (
            f"{tmp_path / 'b'} has another result than the stores before it for the run {run.key} "
            "(seed 7), of the same scenario, policy and code"
        )
        with Runs(tmp_path / "failed") as failed:
            store.absorb(failed)
            assert store.succeeded() == {run.key}
            failed.absorb(other)
            assert failed.outcomes([run])[CASE.key, 7].delivered == 3


def test_what_changed_since_the_runs_were_stored_is_told(tmp_path: Path) -> None:
    asked: dict[str, Any] = {"seeds": 2, "sizes": [{"values": [2, 3]}]}
    specification = Specification(**asked)
    plan = make_plan(specification, code="new", identities={"policy swarm-dt": "now"})
    with Runs(tmp_path / FILE_NAME) as store:
        assert StoredStudy.of(store) is None
        note(store, plan, Study(seeds=2)._declared(store))
        noted = StoredStudy.of(store)
    assert noted is not None
    assert [*noted.changes(plan)] == []
    assert [*noted.changes(replace(plan, code="newer"))] == [
        "the code of the task warehouse changed"
    ]
    unstable = replace(plan, identities={"policy swarm-dt": f"{UNSTABLE} 1"})
    assert [*noted.changes(unstable)] == [
        "policy swarm-dt is another one each time it is made; an `identity` would name it"
    ]
    assert noted.specification.differing(specification) == []
    further: tuple[tuple[dict[str, Any], list[str]], ...] = (
        ({"seeds": 3, "margin": 0.2, "first_seed": 9, "until_clear": True}, []),
        ({"name": "mine", "sizes": [{"values": [2, 4]}]}, ["name", "sizes"]),
        ({"task": "clearing"}, ["task"]),
    )
    for fields, differing in further:
        assert noted.specification.differing(Specification(**{**asked, **fields})) == differing
