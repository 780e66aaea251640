"""Workbooks (.xlsx), read by openpyxl, and tables in Parquet, read by pyarrow."""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.study.trials.table import (
    LARGEST_EXACT,
    WORKBOOK,
    Formula,
    MergedCell,
    NoTrialsError,
    Table,
)

from .data_frame import cell_text, cells_of, header_of

_ZIP = b"PK\x03\x04"
_PARQUET = b"PAR1"
_SHEETS = "xl/workbook.xml"  # the part of a workbook that lists them
LARGEST = 200_000_000  # unpacked, in bytes


def read(path: Path, content: bytes, digest: str) -> Table | None:
    """Return the table in the first visible sheet of a workbook, or in a file of Parquet.

    Raises:
        IndicatorError: the content is not what the name says, is damaged, unpacks beyond `LARGEST`,
            or what reads it is not installed.
    """
    suffix = path.suffix.lower()
    if suffix not in (".xlsx", ".xlsm", ".parquet"):
        return None
    is_workbook = suffix != ".parquet"
    kind = "workbook" if is_workbook else "table in Parquet"
    if not content.startswith(_ZIP if is_workbook else _PARQUET):
        raise IndicatorError(
            f"{path} is no {kind} by its content: should have the ending of its kind"
        )
    try:
        return (_workbook if is_workbook else _parquet)(path, content, digest)
    except IndicatorError:
        raise
    except ImportError as error:
        raise IndicatorError(
            f'{path}: reading it needs pip install "swarm-logistics-env[tables]"; or save it as CSV'
        ) from error
    except Exception as error:  # whatever a parser raises on what somebody else wrote
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise IndicatorError(
            f"{path} is a damaged {kind} ({reason}): should be read from a backup, or be saved "
            "again, or as CSV"
        ) from error


def _workbook(path: Path, content: bytes, digest: str) -> Table:
    """Return the table in the first visible sheet with content.

    Of the cells, openpyxl reads either the values or the formulas. What is merged or hidden it
    tells with the formulas. `pandas.read_excel` tells none of them but the values.
    """
    from openpyxl import load_workbook

    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        _check_size(path, sum(entry.file_size for entry in archive.infolist()))
        # Programs that compute no formula, and may write 0 for its value, ask for it by this.
        is_computed = re.search(b'fullCalcOnLoad="(1|true)"', archive.read(_SHEETS)) is None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what openpyxl does not know, as some charts
        values = load_workbook(io.BytesIO(content), read_only=True, data_only=True)
        layout = load_workbook(io.BytesIO(content))
        cells_by_sheet = {
            sheet.title: _cells(sheet, layout[sheet.title], is_computed)
            for sheet in values.worksheets
        }
    filled = [name for name, cells in cells_by_sheet.items() if cells]
    visible = [name for name in filled if layout[name].sheet_state == "visible"]
    hidden = [name for name in filled if name not in visible]
    if not filled:
        raise NoTrialsError(f"{path} is empty: should have a row of column names, then the trials")
    if not visible:
        raise IndicatorError(
            f"{path} has content in hidden sheets alone ({_listed(hidden)}): should show the one "
            "with the trials"
        )
    name = visible[0]
    cells = cells_by_sheet[name]
    sheet = layout[name]
    _fill_merged(cells, sheet)
    header = cells.pop(min(cells))
    hidden_rows = {line for line, row in sheet.row_dimensions.items() if row.hidden}
    notes = [*_notes_on_hidden(path, header, sorted(hidden_rows & cells.keys()), sheet)]
    if len(visible) > 1:
        notes.insert(0, f"The sheet {name!r} is read, the first of {len(visible)}.")
    if hidden:
        notes.append(f"Hidden sheets of {path.name} are left out: {_listed(hidden)}.")
    shown = {line: row for line, row in sorted(cells.items()) if line not in hidden_rows}
    width = len(header)
    padded = [(row + [""] * width)[:width] for row in shown.values()]
    return Table(
        str(path), digest, header, padded, list(shown), "row", WORKBOOK, decimal=".",
        notes=tuple(notes),
    )  # fmt: skip


def _cells(sheet: Any, layout: Any, is_computed: bool) -> dict[int, list[str]]:
    """Return the cells of each row with content, by its number.

    Args:
        sheet: with values.
        layout: the same sheet with formulas.
        is_computed: whether the values of formulas are theirs.
    """
    sheet.reset_dimensions()  # some programs write wrong ones
    cells_by_line = {}
    for line, row in enumerate(sheet.iter_rows(), 1):
        texts = []
        for column, cell in enumerate(row, 1):
            text = cell_text(_plain(cell.value))
            # An empty text that a formula gives has the type "str".
            has_no_value = cell.value is None and cell.data_type != "str"
            if has_no_value or not is_computed:
                written = layout.cell(line, column)
                if written.data_type == "f":
                    text = Formula(getattr(written.value, "text", written.value))
            texts.append(text)
        if any(texts):
            cells_by_line[line] = texts
    return cells_by_line


def _plain(value: object) -> object:
    """Return a value as a sheet shows it: numbers without needless decimals or digits."""
    if isinstance(value, int | float) and abs(value) >= LARGEST_EXACT:
        return f"{value:.14E}"  # the digits that a sheet keeps
    is_whole = isinstance(value, float) and value.is_integer()
    return int(value) if is_whole else value  # type: ignore[call-overload]


def _fill_merged(cells: dict[int, list[str]], sheet: Any) -> None:
    """Carry the values of merged cells: names to all their columns, others down to all rows."""
    header_line = min(cells)
    for merged in sheet.merged_cells.ranges:
        column = merged.min_col - 1
        first = cells.get(merged.min_row, [])
        value = first[column] if column < len(first) else ""
        if not value:
            continue
        if merged.min_row == header_line:
            first += [""] * (merged.max_col - len(first))
            first[column : merged.max_col] = [value] * (merged.max_col - column)
            continue
        for line in range(merged.min_row + 1, merged.max_row + 1):
            row = cells.setdefault(line, [])
            row += [""] * (column + 1 - len(row))
            row[column] = MergedCell(value)


def _notes_on_hidden(path: Path, header: list[str], lines: list[int], sheet: Any) -> Iterator[str]:
    """Yield which rows are hidden, by their lines, and which columns."""
    if lines:
        numbers = ", ".join(map(str, lines[:5]))
        if len(lines) > 5:
            numbers += ", .."
        yield (
            f"Hidden rows of {path.name} are left out, as a filter or a group hides them: "
            f"{len(lines)} (rows {numbers}). Show them in the sheet if they count."
        )
    numbers_of_hidden = {
        number
        for dimension in sheet.column_dimensions.values()
        if dimension.hidden
        for number in range(dimension.min, dimension.max + 1)
    }
    names = [name for number, name in enumerate(header, 1) if number in numbers_of_hidden and name]
    if names:
        yield (
            f"Hidden columns of {path.name} are read: {_listed(names)}. --ignore NAME leaves one "
            "out."
        )


def _listed(names: list[str]) -> str:
    return ", ".join(map(repr, names))


def _parquet(path: Path, content: bytes, digest: str) -> Table:
    from pyarrow.parquet import ParquetFile

    file = ParquetFile(io.BytesIO(content), page_checksum_verification=True)
    groups = range(file.metadata.num_row_groups)
    _check_size(path, sum(file.metadata.row_group(group).total_byte_size for group in groups))
    names = file.schema_arrow.names
    # Pages have checksums, but names have none: pandas writes them a second time.
    about = file.schema_arrow.pandas_metadata or {"columns": []}
    second_names = [column["field_name"] for column in about["columns"]]
    if len(second_names) == len(names) and second_names != names:
        raise ValueError(f"its columns are {_listed(names)}, or {_listed(second_names)}")
    numbered = [name for name in names if name.startswith("__index_level_")]  # rows of pandas
    frame = file.read().drop_columns(numbered).to_pandas(ignore_metadata=True)
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
