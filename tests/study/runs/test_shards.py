"""Shards and the studies merged of them: each run once, parts of one study, and changes."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import Scenario, judge
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.fingerprint import UNSTABLE
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.questions.plan import make_plan
from swarm_logistics_env.study.questions.specification import Specification
from swarm_logistics_env.study.runs.engines import Shard
from swarm_logistics_env.study.runs.notes import StoredStudy, merge, note
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from tests.made_up import alter, delivered


def test_every_run_is_in_one_shard() -> None:
    runs = Study.preset("quick").plan().runs
    for count in (1, 2, 7, 1000):
        parts = [Shard.parse(f"{i}/{count}").of(runs) for i in range(1, count + 1)]
        assert sorted(run.key for part in parts for run in part) == sorted(run.key for run in runs)
        assert max(map(len, parts)) - min(map(len, parts)) <= 1
    for text in ("0/2", "3/2", "1", "a/b", "1/2/3", "-1/2"):
        with pytest.raises(StudyError, match="should be i/n"):
            Shard.parse(text)


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directory of a study of two sizes and other seeds and margin than the usual ones."""
    directory, other = tmp_path_factory.mktemp("whole"), {"first_seed": 1000, "margin": 0.2}
    small = {"n_robots": 3, "n_items": 4, "warehouse_width": 3, "warehouse_height": 3}
    scenario = {**small, "duration": 2}
    Study(out=directory, seeds=2, sizes=[{"values": [2, 3]}], scenario=scenario, **other).run()
    return directory


def altered(source: Path, directory: Path, change: str) -> Path:
    shutil.copytree(source, directory)
    alter(directory / FILE_NAME, change)
    return directory


def noted(name: str, value: str) -> str:
    return f"UPDATE notes SET value = json_set(value, '$.{name}', json('{value}'))"


def rows(directory: Path) -> list[dict[Any, Any]]:
    with Runs.existing(directory) as runs:
        return runs.frame().to_dict("records")


def test_merged_parts_are_the_declared_study_and_success_wins(full: Path, tmp_path: Path) -> None:
    fail = "UPDATE runs SET failed = 1, outcome = json_set(outcome, '$.error', 'Traceback')"
    failed = altered(full, tmp_path / "failed", fail)
    for number, order in enumerate([(full, failed), (failed, full)]):
        out = tmp_path / str(number)
        assert merge(order, out) == 4
        assert rows(out) == rows(full)
        assert [path.name for path in out.iterdir()] == [FILE_NAME]
        results = Study.stored(out).findings()
        assert (results.exploratory, results.late_margin) == (False, False)
        assert StoredStudy.existing(out) == StoredStudy.existing(full)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("UPDATE runs SET outcome = replace(outcome, '2.0', '1.5')", "has another result"),
        ("DELETE FROM notes", "does not note its study"),
        (noted("identities", "3"), "is damaged: its note does not read"),
        (noted("code", '"old"'), "differ: should be shards of one study"),
        (noted("specification.sizes", "[]"), "differ: should be shards of one study"),
        (noted("declared.seeds", "3"), "differ: should be shards of one study"),
    ],
)
def test_what_is_not_one_study_is_not_merged(
    full: Path, tmp_path: Path, change: str, words: str
) -> None:
    other = altered(full, tmp_path / "other", change)
    before = rows(other)
    with pytest.raises(StudyError, match=words):
        merge([full, other], tmp_path / "both")
    assert rows(other) == before
    assert not (tmp_path / "both" / FILE_NAME).exists()


def test_recorded_trials_are_not_merged(full: Path, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("robots,p\n4,1\n8,2\n")
    judge(tmp_path / "t.csv", out=tmp_path / "lab")
    with pytest.raises(StudyError, match="lab was imported: only studies that were run are merg"):
        merge([full, tmp_path / "lab"], tmp_path / "both")
    assert not (tmp_path / "both" / FILE_NAME).exists()


def test_another_result_of_a_run_is_no_part_of_the_same_study(tmp_path: Path) -> None:
    case = Case(PolicySpec(name="swarm-dt"), "identity", Scenario(), task=WAREHOUSE)
    run = Run(case, "code", 7)
    for name, outcome in (("a", delivered(2)), ("b", delivered(3)), ("failed", Outcome(error="x"))):
        with Runs(tmp_path / name) as store:
            store.add([(run, outcome)])
    with Runs(tmp_path / "a") as store, Runs(tmp_path / "b") as another:
        store.absorb(store)
        with pytest.raises(StudyError) as refused:
            store.absorb(another)
        assert str(refused.value) == (
            f"{tmp_path / 'b'} has another result than the stores before it for the run {run.key} "
            "(seed 7), of the same scenario, policy and code"
        )
        with Runs(tmp_path / "failed") as failed:
            store.absorb(failed)
            assert store.succeeded() == {run.key}
            failed.absorb(another)
            assert failed.outcomes([run])[case.key, 7].delivered == 3


def test_what_changed_since_the_runs_were_stored_is_told(tmp_path: Path) -> None:
    fields: dict[str, Any] = {"seeds": 2, "sizes": [{"values": [2, 3]}]}
    specification = Specification(**fields)
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
    for changes, differing in further:
        assert noted.specification.differing(Specification(**{**fields, **changes})) == differing
