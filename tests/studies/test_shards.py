"""Shards and the studies merged of them: each run once, and nothing but parts of one study."""

from __future__ import annotations

import json
import shutil
import sqlite3
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.declaration import StoredStudy, merge
from swarm_logistics_env.studies.plan import Shard
from swarm_logistics_env.studies.runs import FILE_NAME, Runs


@pytest.mark.parametrize("count", [1, 2, 7, 1000])
def test_every_run_is_in_one_shard(count: int) -> None:
    runs = Study.preset("quick").plan().runs
    parts = [Shard(i, count).of(runs) for i in range(1, count + 1)]
    assert Counter(run.key for part in parts for run in part) == Counter(run.key for run in runs)
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize("text", ["0/2", "3/2", "1/0", "1", "a/b", "1/2/3", "-1/2", ""])
def test_no_such_shard(text: str) -> None:
    with pytest.raises(StudyError, match="should be i/n"):
        Shard.parse(text)


SCENARIO = {"n_robots": 3, "n_items": 4, "warehouse_width": 3, "warehouse_height": 3, "duration": 2}
TWO_SIZES: dict[str, Any] = {"scenario": SCENARIO, "sizes": [{"values": [2, 3]}], "seeds": 2}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directory of a study of two sizes and other seeds and margin than the usual ones."""
    directory = tmp_path_factory.mktemp("whole")
    Study(out=directory, first_seed=1000, margin=0.2, **TWO_SIZES).run()
    return directory


def altered(directory: Path, change: Callable[[sqlite3.Connection], object]) -> Path:
    with sqlite3.connect(directory / FILE_NAME) as database:
        change(database)
    database.close()
    return directory


def sql(statement: str) -> Callable[[sqlite3.Connection], object]:
    return lambda database: database.execute(statement)


def noted(name: str, value: object) -> Callable[[sqlite3.Connection], object]:
    """Return what changes a field of the study's note."""

    def change(database: sqlite3.Connection) -> None:
        ((text,),) = database.execute("SELECT value FROM notes")
        note = json.loads(text)
        note[name] = note[name] | value if isinstance(value, dict) and note[name] else value
        database.execute("UPDATE notes SET value = ?", (json.dumps(note),))

    return change


def rows(directory: Path) -> list[dict[Any, Any]]:
    with Runs.existing(directory) as runs:
        return runs.frame().to_dict("records")


def test_merged_parts_are_the_declared_study_and_success_wins(whole: Path, tmp_path: Path) -> None:
    failed = shutil.copytree(whole, tmp_path / "failed")
    altered(failed, sql("""UPDATE runs SET failed = 1, outcome = '{"error": "Traceback"}'"""))
    for number, order in enumerate([(whole, failed), (failed, whole), (whole, whole)]):
        out = tmp_path / str(number)
        assert merge(order, out) == 4
        assert rows(out) == rows(whole)
        assert [path.name for path in out.iterdir()] == [FILE_NAME]
        found = Study.stored(out).findings()
        assert (found.exploratory, found.late_margin) == (False, False)
        assert StoredStudy.existing(out) == StoredStudy.existing(whole)
    with pytest.raises(StudyError, match="holds a study already"):
        merge([whole, failed], failed)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (sql("""UPDATE runs SET outcome = replace(outcome, '2.0', '1.5')"""), "has another result"),
        (noted("code", "old"), "differ in code"),
        (sql("DELETE FROM notes"), "does not note its study"),
        (noted("identities", 3), "its note 'identities' does not read"),
        (noted("imported", {"file": "x.csv", "digest": "d", "paired": True}), "was imported"),
        (noted("identities", {"policy swarm-dt": "x"}), "differ in identities"),
        (noted("specification", {"sizes": []}), "differ in sizes"),
        (noted("declared", {"seeds": 3}), "differ in declared: should be shards"),
    ],
)
def test_what_is_not_one_study_is_not_merged(
    whole: Path, tmp_path: Path, change: Callable[[sqlite3.Connection], object], words: str
) -> None:
    other = altered(shutil.copytree(whole, tmp_path / "other"), change)
    before = rows(other)
    with pytest.raises(StudyError, match=words):
        merge([whole, other], tmp_path / "both")
    assert rows(other) == before
    assert not (tmp_path / "both" / FILE_NAME).exists()
