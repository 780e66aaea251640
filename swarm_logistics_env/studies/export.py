"""Export: every run of a study as one file. Equal runs give equal bytes."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.store import Store

if TYPE_CHECKING:
    import pandas as pd


def export(store: Store, path: Path) -> tuple[int, str]:
    """Write every stored run, sorted by key, without wall times, as CSV or Parquet by suffix.

    Returns:
        How many runs, and the SHA-256 of the file.

    Raises:
        StudyError: another suffix, pyarrow is missing, or the file cannot be written.
    """
    import pandas as pd

    runs = pd.DataFrame(store.rows(), dtype=object)
    if path.suffix == ".csv":
        if not runs.empty:
            runs["delivery_times"] = runs["delivery_times"].map(
                lambda times: " ".join(map(repr, times)), na_action="ignore"
            )
        write_csv(path, runs)
    elif path.suffix == ".parquet":
        _write_parquet(path, runs)
    else:
        raise StudyError(f"cannot export to {path}: should end in .csv or .parquet")
    return len(runs), hashlib.sha256(path.read_bytes()).hexdigest()


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table as CSV with Unix line ends; floats in shortest exact form.

    Raises:
        StudyError: the file cannot be written.
    """
    try:
        table.to_csv(path, index=False, lineterminator="\n")
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error.strerror or error}") from error


def _write_parquet(path: Path, runs: pd.DataFrame) -> None:
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise StudyError(
            "Parquet needs pyarrow: pip install 'swarm-logistics-env[study]', or export to .csv"
        ) from None
    numbers = {
        "seed": pa.int64(),
        "delivered": pa.int64(),
        "behaviour": pa.int64(),
        "ended_at": pa.float64(),
        "anchoring_seconds": pa.float64(),
        "all_delivered": pa.bool_(),
        "delivery_times": pa.list_(pa.float64()),
    }
    if not runs.empty:
        runs["all_delivered"] = runs["all_delivered"].map(bool, na_action="ignore")
    # Named types: a column of failed runs alone would have none.
    schema = pa.schema([(name, numbers.get(name, pa.string())) for name in runs.columns])
    try:
        pq.write_table(pa.Table.from_pandas(runs, schema, preserve_index=False), path)
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error}") from error
