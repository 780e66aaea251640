"""Export: the rows of a store as one file. Equal rows give equal bytes."""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.results import Value
from swarm_logistics_env.studies.store import Store


def export(store: Store, path: Path) -> tuple[int, str]:
    """Write every stored run, sorted by key, without wall times, as CSV or Parquet by suffix.

    Returns:
        How many runs, and the SHA-256 of the file.

    Raises:
        StudyError: another suffix, pyarrow is missing, or the file cannot be written.
    """
    if path.suffix == ".csv":
        count = _csv(store, path)
    elif path.suffix == ".parquet":
        count = _parquet(store, path)
    else:
        raise StudyError(f"cannot export to {path}: should end in .csv or .parquet")
    return count, hashlib.sha256(path.read_bytes()).hexdigest()


def _csv(store: Store, path: Path) -> int:
    rows = list(store.rows())
    columns = list(rows[0]) if rows else []
    write_csv(path, columns, (list(row.values()) for row in rows))
    return len(rows)


def _parquet(store: Store, path: Path) -> int:
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
    rows = list(store.rows())
    for row in rows:
        if row["all_delivered"] is not None:
            row["all_delivered"] = bool(row["all_delivered"])
    if any(isinstance(row["delivered"], float) for row in rows):
        numbers["delivered"] = pa.float64()
    names = list(rows[0]) if rows else []
    # Named types: a column of failed runs alone would have none.
    schema = pa.schema([(name, numbers.get(name, pa.string())) for name in names])
    try:
        pq.write_table(pa.Table.from_pylist(rows, schema=schema), path)
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error}") from error
    return len(rows)


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Value]]) -> None:
    """Write a CSV file with Unix line ends; floats in shortest exact form.

    Raises:
        StudyError: the file cannot be written.
    """
    try:
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(_texts(row) for row in rows)
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error.strerror}") from error


def _texts(row: Sequence[Value]) -> Iterator[str]:
    for value in row:
        if isinstance(value, list):
            yield " ".join(repr(number) for number in value)
        elif isinstance(value, float):
            yield repr(value)
        else:
            yield "" if value is None else str(value)
