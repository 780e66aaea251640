from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.store import Store, export


@pytest.fixture
def store(small: dict[str, Any], tmp_path: Path) -> Any:
    Study(out=tmp_path, **{**small, "faults": []}).run()
    with Store.existing(tmp_path) as opened:
        yield opened


def test_csv_says_what_the_store_holds(store: Store, tmp_path: Path) -> None:
    assert export(store, tmp_path / "rows.csv")[0] == len(store)
    text = pd.read_csv(tmp_path / "rows.csv")
    assert text["delivered"].sum() > 0
    for times, row in zip(text["delivery_times"].fillna(""), store.rows()):
        assert list(map(float, times.split())) == row["delivery_times"]
    assert json.loads(text["scenario"][0])["warehouse_width"] == 3.0


def test_equal_rows_give_equal_bytes(store: Store, tmp_path: Path) -> None:
    first, second = (export(store, tmp_path / f"{n}rows.csv")[1] for n in range(2))
    assert first == second


def test_failed_runs_are_rows_too(tmp_path: Path, store: Store) -> None:
    store._connection.execute(
        "UPDATE runs SET error = 'Traceback', delivered = NULL, delivery_times = NULL"
    )
    export(store, tmp_path / "rows.csv")
    table = pd.read_csv(tmp_path / "rows.csv")
    assert table["delivered"].isna().all()
    assert (table["error"] == "Traceback").all()


@pytest.mark.parametrize("name", ["rows.xlsx", "rows", "rows.parquet", "nowhere/rows.csv"])
def test_cannot_export(store: Store, tmp_path: Path, name: str) -> None:
    with pytest.raises(StudyError, match=r"cannot (export to|write)"):
        export(store, tmp_path / name)
