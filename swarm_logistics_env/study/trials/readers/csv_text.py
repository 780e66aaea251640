"""A table of text: CSV as people and programs write it, its encoding and its delimiter."""

from __future__ import annotations

import codecs
import csv
import io
import re
import unicodedata
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

from swarm_logistics_env.core.csv_cells import text_of_inert
from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.study.trials.table import Formula, NoTrialsError, Table

_LINE_END = re.compile(r"\r\n|\r|\n")
_LINE_SIGNS = "\n\v\f\r\x85\u2028\u2029"  # what some program or other takes for a line's end
_QUOTED = r'"(?:[^"]|"")*+"'
_HEADER = re.compile(rf'(?:{_QUOTED}|[^\r\n"])*+')
_EXCEL = re.compile(r'\s*"?sep=(\t|[^\w\s"\'])"?[;,\t ]*(?:\r\n|\r|\n)', re.IGNORECASE)
_COMMENT = re.compile(r"#[^\r\n]*(?:\r\n|\r|\n)\s*")  # before the names of the columns
# What files of other kinds begin with.
_OTHER_KINDS = {
    b"PK\x03\x04": "a workbook or an archive: should end in .xlsx, or be unpacked",
    b"PAR1": "a table in Parquet: should end in .parquet",
    b"\x1f\x8b": "packed by gzip: should be unpacked",
    b"\xd0\xcf\x11\xe0": "a workbook of before 2007: should be saved as .xlsx or CSV",
    b"\x89HDF": "a file of HDF5: should be saved as CSV",
}


def read(path: Path, content: bytes, digest: str) -> Table:
    """Return the table in a file of text.

    Raises:
        IndicatorError: it holds no text, no table, or one with a quote that is never closed.
    """
    for start, kind in _OTHER_KINDS.items():
        if content.startswith(start):
            raise IndicatorError(f"{path} is no text but {kind}")
    text, notes = _text(path, content)
    header, rows = _cells(path, text)
    return Table(str(path), digest, header, list(rows.values()), list(rows), notes=tuple(notes))


def _text(path: Path, content: bytes) -> tuple[str, list[str]]:
    """Return the text of a file, and notes on its encoding."""
    notes = []
    is_utf_16 = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        text = content.decode("utf-16" if is_utf_16 else "utf-8-sig")
    except UnicodeDecodeError:
        try:
            text = content.decode("cp1252")
        except UnicodeDecodeError:
            raise IndicatorError(
                f"{path} is text neither in UTF-8 nor in Windows-1252: save it as CSV UTF-8"
            ) from None
        notes.append("The file is no UTF-8: it is read as Windows-1252 (cp1252).")
    signs = {*text} - {"\t", *_LINE_SIGNS}
    if steering := {sign for sign in signs if unicodedata.category(sign) in ("Cc", "Cf")}:
        first = min(map(text.index, steering))
        line = len(_LINE_END.findall(text, 0, first)) + 1
        raise IndicatorError(
            f"{path}, line {line}: holds {text[first]!r}: should be plain text, without control "
            "signs"
        )
    return text, notes


def _cells(path: Path, text: str) -> tuple[list[str], dict[int, list[str]]]:
    """Return the columns' names, and the cells of every row with any, by line."""
    excel = _EXCEL.match(text)
    start = excel.end() if excel else len(text) - len(text.lstrip(" \r\n"))
    if excel:
        delimiter = excel[1]
    else:
        while comment := _COMMENT.match(text, start):
            start = comment.end()
        # By its names alone: csv.Sniffer refuses a table of one column.
        head = next(_HEADER.finditer(text, start))[0]
        delimiter = max(";\t,|", key=re.sub(_QUOTED, "", head).count)
    rows = {line: cells for line, cells in _rows(path, text, start, delimiter) if any(cells)}
    if not rows:
        raise NoTrialsError(f"{path} is empty: should have a row of column names, then the trials")
    header = rows.pop(min(rows))
    n_columns = len(header)
    for line, cells in rows.items():
        if len(cells) > n_columns and any(cells[n_columns:]):
            hint = ""
            if delimiter == ",":
                hint = ": if decimals have a comma, put ; between the columns"
            raise IndicatorError(
                f"{path}, line {line}: has {len(cells)} values, more values than the "
                f"{n_columns} columns{hint}"
            )
        cells[n_columns:] = []
        cells += [""] * (n_columns - len(cells))
    return header, rows


def _rows(path: Path, text: str, start: int, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the line that each row begins in, and its cells, of which one may hold several lines.

    By the csv module, as pandas tells no lines and reads "no"ne as none.
    """
    # Blanks may stand around quotes: the module skips those before.
    body = re.sub(rf'(?<!")" +(?=[{re.escape(delimiter)}\r\n]|\Z)', '"', text[start:])
    csv.field_size_limit(max(csv.field_size_limit(), len(body)))  # a cell may hold a trajectory
    reader = csv.reader(
        io.StringIO(body, newline=""), delimiter=delimiter, skipinitialspace=True, strict=True
    )
    first_line = len(_LINE_END.findall(text, 0, start)) + 1
    line = first_line
    n_columns = 0
    try:
        for row in reader:
            lines_below = [part for cell in row for part in cell.splitlines()[1:]]
            most_signs = max((part.count(delimiter) for part in lines_below), default=0)
            if most_signs >= n_columns - 1 > 0:
                raise IndicatorError(
                    f"{path}, line {line}: opens a quote that holds whole rows: should be closed "
                    "in the row that it opens in"
                )
            n_columns = n_columns or len(row)
            yield line, [*map(_read, row)]
            line = first_line + reader.line_num
    except csv.Error as error:
        raise IndicatorError(
            f"{path}, line {line}: opens a quote that is not closed at its cell's end ({error}): "
            'close it there by ", or take it out; a " within is written ""'
        ) from None


@lru_cache(100_000)  # most cells are some of a few texts
def _read(cell: str) -> str:
    """Return a cell in one line, and without what `inert` put before it."""
    cell = cell.lstrip(" ")
    if cell.startswith("=") and not cell.startswith('="'):  # which stands before a text
        return Formula(cell)
    return re.sub(rf"[{_LINE_SIGNS}]+", " ", text_of_inert(cell).strip())
