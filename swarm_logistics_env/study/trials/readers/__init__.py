"""Readers: from a file of some kind to a `Table`.

A kind is a module of this folder with a function `read(path, content, digest)`: it returns the
table, or None where the file is of another kind. What none of them knows is a table of text.
"""

from __future__ import annotations

import hashlib
import importlib
import pkgutil
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.study.trials.sheet import without_surroundings
from swarm_logistics_env.study.trials.table import WORKBOOK, Table

from . import csv_text, data_frame, folder

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["read_table"]

_NO_KINDS = ("csv_text", "data_frame", "folder")  # which are read where no kind is recognised


def read_table(
    source: str | Path | pd.DataFrame, columns: Mapping[str, str], ignore: Sequence[str]
) -> Table:
    """Return the table in a file, in the files of a folder, or of a data frame.

    Args:
        columns: what a column is to its name, as somebody says.
        ignore: names of columns that files of a folder need not have.

    Raises:
        IndicatorError: it cannot be read.
    """
    if not isinstance(source, str | Path):
        return data_frame.read(source)
    path = Path(source)
    if path.is_dir():
        return folder.read(path, _read_file, columns, ignore)
    return _read_file(path)


def _read_file(path: Path) -> Table:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise IndicatorError(f"cannot read {path}: {error.strerror}") from error
    digest = hashlib.sha256(content).hexdigest()[:16]
    for kind in _kinds():
        table: Table | None = kind.read(path, content, digest)
        if table is not None:
            return without_surroundings(table) if table.kind == WORKBOOK else table
    return without_surroundings(csv_text.read(path, content, digest))


@cache
def _kinds() -> list[ModuleType]:
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return [
        importlib.import_module(f"{__name__}.{name}") for name in names if name not in _NO_KINDS
    ]
