"""Workbooks (.xlsx) and tables in Parquet, read by pandas."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.spi.trials.table import Table

from .data_frame import cells_of, header_of

if TYPE_CHECKING:
    import pandas as pd

_ZIP, _PARQUET = b"PK\x03\x04", b"PAR1"
LARGEST = 200_000_000  # unpacked, in bytes


def read(path: Path, content: bytes, digest: str) -> Table | None:
    """Return the table in the first sheet of a workbook, or in a file of Parquet.

    Raises:
        IndicatorError: the content is not what the name says, unpacks beyond `LARGEST`, or what
            reads it is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in (".xlsx", ".xlsm", ".parquet"):
        return None
    is_workbook = suffix != ".parquet"
    if not content.startswith(_ZIP if is_workbook else _PARQUET):
        kind = "workbook" if is_workbook else "table in Parquet"
        raise IndicatorError(
            f"{path} is no {kind} by its content: should have the ending of its kind"
        )
    return (_workbook if is_workbook else _parquet)(path, content, digest)


def _workbook(path: Path, content: bytes, digest: str) -> Table:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    except zipfile.BadZipFile as error:
        raise IndicatorError(f"{path} is a damaged workbook ({error}): save it again") from error
    _check_size(path, unpacked)
    sheets: dict[str, pd.DataFrame] = _read_by_pandas(
        path, "read_excel", content, sheet_name=None, header=None, dtype=object
    )
    filled = {name: sheet for name, sheet in sheets.items() if not sheet.dropna(how="all").empty}
    if not filled:
        raise IndicatorError(f"{path} is empty: should have a row of column names, then the trials")
    name, sheet = next(iter(filled.items()))
    rows = {line: cells for line, cells in enumerate(cells_of(sheet), 1) if any(cells)}
    header = list(rows.pop(min(rows)))
    notes = [f"The sheet {name!r} is read, the first of {len(filled)}."] if len(filled) > 1 else []
    return Table(
        str(path), digest, header, list(rows.values()), list(rows), "row", "a workbook",
        decimal=".", notes=tuple(notes),
    )  # fmt: skip


def _parquet(path: Path, content: bytes, digest: str) -> Table:
    try:
        from pyarrow import ArrowException
        from pyarrow.parquet import ParquetFile
    except ImportError as error:
        raise _not_installed(path) from error
    try:
        metadata = ParquetFile(io.BytesIO(content)).metadata
    except ArrowException as error:
        raise IndicatorError(f"{path} is a damaged table in Parquet: {error}") from error
    groups = range(metadata.num_row_groups)
    _check_size(path, sum(metadata.row_group(group).total_byte_size for group in groups))
    frame: pd.DataFrame = _read_by_pandas(path, "read_parquet", content)
    cells = cells_of(frame)
    rows = range(1, len(cells) + 1)
    return Table(
        str(path), digest, header_of(frame), cells, rows, "row", "a table in Parquet", decimal="."
    )


def _check_size(path: Path, unpacked: int) -> None:
    if unpacked > LARGEST:
        raise IndicatorError(
            f"{path} unpacks to {unpacked / 1e6:.0f} MB: should be at most {LARGEST / 1e6:.0f} MB; "
            "save it as CSV"
        )


def _read_by_pandas(path: Path, function: str, content: bytes, **options: Any) -> Any:
    import pandas as pd

    try:
        return getattr(pd, function)(io.BytesIO(content), **options)
    except ImportError as error:
        raise _not_installed(path) from error
    except Exception as error:  # whatever a parser raises on what somebody else wrote
        reason = str(error).partition("\n")[0]
        raise IndicatorError(
            f"{path} cannot be read ({reason}): save it again, or as CSV"
        ) from error


def _not_installed(path: Path) -> IndicatorError:
    return IndicatorError(
        f'{path}: reading it needs pip install "swarm-logistics-env[tables]"; or save it as CSV'
    )
