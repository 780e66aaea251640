"""Shards and the studies merged of them: each run once, and nothing but parts of one study."""

from __future__ import annotations

import sqlite3
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.metadata import merge, of_existing
from swarm_logistics_env.studies.runs import Shard
from swarm_logistics_env.studies.store import FILE_NAME, Store


@pytest.mark.parametrize("count", [1, 2, 7, 1000])
def test_every_run_is_in_one_shard(count: int) -> None:
    runs = list(Study.preset("quick").plan().runs())
    parts = [list(Shard(i, count).of(runs)) for i in range(1, count + 1)]
    assert Counter(run.key for part in parts for run in part) == Counter(run.key for run in runs)
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize("text", ["0/2", "3/2", "1/0", "1", "a/b", "1/2/3", "-1/2", ""])
def test_no_such_shard(text: str) -> None:
    with pytest.raises(StudyError, match="should be i/n"):
        Shard.parse(text)


SCENARIO = {"n_robots": 3, "n_items": 4, "warehouse_width": 3, "warehouse_height": 3, "duration": 2}


def played(directory: Path, **fields: Any) -> Path:
    Study(
        out=directory,
        **{"scenario": SCENARIO, "sizes": [{"values": [2, 3]}], "seeds": 2, **fields},
    ).run()
    return directory


def altered(directory: Path, statement: str) -> Path:
    with sqlite3.connect(directory / FILE_NAME) as database:
        database.execute(statement)
    database.close()
    return directory


def rows(directory: Path) -> list[dict[str, Any]]:
    with Store.existing(directory) as store:
        return list(store.rows())


def test_shards_of_one_declared_study_stay_as_declared(tmp_path: Path) -> None:
    parts = [played(tmp_path / name, first_seed=1000) for name in ("one", "other")]
    merge(parts, tmp_path / "both")
    assert not Study.stored(tmp_path / "both").findings().exploratory


def test_merged_study_keeps_its_declared_margin(tmp_path: Path) -> None:
    parts = [played(tmp_path / name, margin=0.2) for name in ("one", "other")]
    merge(parts, tmp_path / "both")
    assert of_existing(tmp_path / "both").declared.margin == 0.2
    assert not Study.stored(tmp_path / "both").findings().late_margin


def test_success_wins_over_failure_whichever_comes_first(tmp_path: Path) -> None:
    whole = played(tmp_path / "whole")
    failed = altered(
        played(tmp_path / "failed"), "UPDATE runs SET error = 'Traceback', delivered = NULL"
    )
    for number, order in enumerate([(whole, failed), (failed, whole)]):
        merge(order, tmp_path / str(number))
        assert rows(tmp_path / str(number)) == rows(whole)


def test_store_merged_with_its_own_copy_stays_as_it_is(tmp_path: Path) -> None:
    one, other = played(tmp_path / "one"), played(tmp_path / "other")
    assert merge([one, other], tmp_path / "both") == 4
    assert rows(tmp_path / "both") == rows(one)
    assert not [path for path in (tmp_path / "both").iterdir() if path.name != FILE_NAME]


@pytest.mark.parametrize(
    ("fields", "statement", "words"),
    [
        ({}, "UPDATE runs SET ended_at = 1.5", "has another result"),
        ({}, "UPDATE notes SET value = 'old' WHERE name = 'code'", "differ in code version"),
        ({}, "DELETE FROM notes WHERE name = 'identities'", "does not note its identities"),
        (
            {},
            """INSERT INTO notes VALUES
            ('imported', '{"file": "x.csv", "digest": "d", "paired": true}')""",
            "was imported",
        ),
        (
            {},
            """UPDATE notes SET value = '{"policy swarm-dt": "x"}' WHERE name = 'identities'""",
            "differ in the code of their policies",
        ),
        ({"sizes": [{"values": [2, 4]}]}, "SELECT 1", "differ in sizes"),
        ({"seeds": 3}, "SELECT 1", "differ in seeds, what they declared: should be shards"),
        ({"policies": ["random-walk"]}, "SELECT 1", "differ in policies"),
        ({"until_clear": True}, "SELECT 1", "differ in until_clear"),
        ({"margin": 0.3}, "SELECT 1", "differ in margin"),
    ],
)
def test_what_is_not_one_study_is_not_merged(
    tmp_path: Path, fields: dict[str, Any], statement: str, words: str
) -> None:
    one = played(tmp_path / "one")
    other = altered(played(tmp_path / "other", **fields), statement)
    before = rows(one), rows(other)
    with pytest.raises(StudyError, match=words):
        merge([one, other], tmp_path / "both")
    assert (rows(one), rows(other)) == before
    assert not (tmp_path / "both").exists() or not list((tmp_path / "both").iterdir())


def test_study_is_not_overwritten(tmp_path: Path) -> None:
    one, other = played(tmp_path / "one"), played(tmp_path / "other")
    with pytest.raises(StudyError, match="holds a study already"):
        merge([one, other], other)
