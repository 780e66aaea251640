"""Export: every run of a study as one file. Equal runs give equal bytes."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.store import Store

if TYPE_CHECKING:
    import pandas as pd


_TYPES = {
    "seed": "Int64",
    "delivered": "Int64",
    "behaviour": "Int64",
    "ended_at": "Float64",
    "anchoring_seconds": "Float64",
    "all_delivered": "boolean",
    "delivery_times": "object",
}


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
    # Named types: a column of failed runs alone would have none.
    types = {name: _TYPES.get(name, "string") for name in runs.columns}
    if any(isinstance(number, float) for number in runs.get("delivered", ())):
        types["delivered"] = "Float64"  # a task measures fractions
    try:
        runs.astype(types).to_parquet(path, engine="pyarrow", index=False)
    except ImportError:
        raise StudyError(
            "Parquet needs pyarrow: pip install 'swarm-logistics-env[study]', or export to .csv"
        ) from None
    except OSError as error:
        raise StudyError(f"cannot write {path}: {error}") from error
