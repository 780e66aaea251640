"""A data frame of pandas, however it was made."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from swarm_logistics_env.spi.inputs import IndicatorError
from swarm_logistics_env.study.trials.table import Table

if TYPE_CHECKING:
    import pandas as pd


def read(frame: pd.DataFrame) -> Table:
    """Return the table of a data frame; a column's missing values are empty cells.

    Raises:
        IndicatorError: it is none.
    """
    import pandas as pd

    if not isinstance(frame, pd.DataFrame):
        raise IndicatorError(
            f"trials = {frame!r}: should be the path of a file or folder, or a data frame of pandas"
        )
    named = frame.reset_index() if any(name is not None for name in frame.index.names) else frame
    header = header_of(named)
    cells = cells_of(named)
    content = repr((header, cells)).encode()
    digest = hashlib.sha256(content).hexdigest()[:16]
    rows = range(1, len(cells) + 1)
    return Table("data frame", digest, header, cells, rows, "row", "a data frame", decimal=".")


def header_of(frame: pd.DataFrame) -> list[str]:
    """Return the names of a frame's columns; levels of names are joined by a blank."""
    return [
        " ".join(filter(None, map(str, name))) if isinstance(name, tuple) else str(name).strip()
        for name in frame.columns
    ]


def cells_of(frame: pd.DataFrame) -> list[Sequence[str]]:
    """Return the cells of a frame as texts, a sequence for each row."""
    columns = [
        ["" if is_missing else cell_text(value) for value, is_missing in zip(column, column.isna())]
        for _, column in frame.items()
    ]
    return list(zip(*columns))


def cell_text(value: Any) -> str:
    """Return a value as the text of a cell, in one line; None is an empty cell."""
    if value is None:
        return ""
    if isinstance(value, float):  # numpy's, too
        return repr(float(value))
    return " ".join(str(value).split())
