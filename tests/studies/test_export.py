from __future__ import annotations

import json
import sys
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


def test_parquet_says_what_csv_says(store: Store, tmp_path: Path) -> None:
    for name in ("rows.csv", "rows.parquet"):
        assert export(store, tmp_path / name)[0] == len(store)
    text, columns = pd.read_csv(tmp_path / "rows.csv"), pd.read_parquet(tmp_path / "rows.parquet")
    assert list(text.columns) == list(columns.columns)
    assert text["run"].tolist() == columns["run"].tolist()
    assert text["delivered"].tolist() == columns["delivered"].tolist()
    assert columns["delivered"].sum() > 0
    for times, row in zip(columns["delivery_times"], store.rows()):
        assert times.tolist() == row["delivery_times"]
    assert json.loads(columns["scenario"][0])["warehouse_width"] == 3.0


@pytest.mark.parametrize("name", ["rows.csv", "rows.parquet"])
def test_equal_rows_give_equal_bytes(store: Store, tmp_path: Path, name: str) -> None:
    first, second = (export(store, tmp_path / f"{n}{name}")[1] for n in range(2))
    assert first == second


@pytest.mark.parametrize("name", ["rows.csv", "rows.parquet"])
def test_failed_runs_are_rows_too(tmp_path: Path, name: str, store: Store) -> None:
    store._connection.execute(
        "UPDATE runs SET error = 'Traceback', delivered = NULL, delivery_times = NULL"
    )
    export(store, tmp_path / name)
    table = (
        pd.read_csv(tmp_path / name) if name.endswith("csv") else pd.read_parquet(tmp_path / name)
    )
    assert table["delivered"].isna().all()
    assert (table["error"] == "Traceback").all()


@pytest.mark.parametrize("name", ["rows.xlsx", "rows", "nowhere/rows.csv", "nowhere/rows.parquet"])
def test_cannot_export(store: Store, tmp_path: Path, name: str) -> None:
    with pytest.raises(StudyError, match=r"cannot (export to|write)"):
        export(store, tmp_path / name)


def test_parquet_without_pyarrow_is_refused_in_words(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(StudyError, match=r"swarm-logistics-env\[study\]"):
        export(store, tmp_path / "rows.parquet")
