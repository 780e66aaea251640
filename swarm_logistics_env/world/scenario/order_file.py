"""Orders that come by themselves: the shapes of their rates, and a CSV file that lists them."""

from __future__ import annotations

import csv
import math
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.errors import suggest
from swarm_logistics_env.world.floor.floor_plan import is_file, read_text

NEXT = "next"  # an item is asked for when one was delivered
ANY = -1  # of docks, items and classes: none is named
MOST_ROWS = 100_000
_ROW_END = "/"  # of the rows of a file within a single line, as those of a floor plan

# Orders an hour of a shop's day beside the mean, from midnight on; chosen: a quiet night, a morning
# that rises to noon, and the highest hours in the evening.
_DAY = (
    0.4, 0.2, 0.1, 0.1, 0.1, 0.2, 0.4, 0.7, 1.0, 1.2, 1.3, 1.4,
    1.4, 1.3, 1.2, 1.2, 1.2, 1.3, 1.5, 1.8, 2.0, 1.8, 1.4, 0.8,
)  # fmt: skip

# Factors of `order_rate` in equal parts of `order_cycle`, each with mean 1.
ORDER_SHAPES: dict[str, tuple[float, ...]] = {
    "poisson": (1.0,),
    "bursts": (5.0, 0.0, 0.0, 0.0, 0.0),
    "day": tuple(hour * len(_DAY) / sum(_DAY) for hour in _DAY),
}

COLUMNS = ("time", "item", "dock", "due", "priority")


class OrderFile(NamedTuple):
    """The orders of a file, by their times; O orders.

    Attributes:
        time: when each comes [s], ascending (O,).
        item: number of the item, or `ANY` (O,).
        kind: the item's class, by its place in `classes`, or `ANY` (O,).
        dock: letter of the dock, or "" for any (O,).
        due: when it is due [s], or infinite (O,).
        priority: higher is more urgent (O,).
        line: where it stands in the file, from 1 (O,).
        classes: names of the classes, in the alphabet's order; item i is of class i, repeating.
    """

    time: NDArray[np.float64]
    item: NDArray[np.int64]
    kind: NDArray[np.int64]
    dock: tuple[str, ...]
    due: NDArray[np.float64]
    priority: NDArray[np.float64]
    line: NDArray[np.int64]
    classes: tuple[str, ...]

    @property
    def names_docks(self) -> bool:
        """Whether any order names its dock."""
        return any(self.dock)

    @property
    def has_due_times(self) -> bool:
        """Whether any order is due at some time."""
        return bool(np.isfinite(self.due).any())


def orders_text(orders: str) -> str:
    """Return the value of `Scenario.orders` in its one form: a name, or the rows of a file.

    Args:
        orders: "next", a name of `ORDER_SHAPES`, a CSV file, or its rows, between line breaks or
            "/".

    Raises:
        ValueError: it is none of these, or the file cannot be read; says what would be right.
    """
    names = (NEXT, *ORDER_SHAPES)
    if orders in names:
        return orders
    if is_file(orders):
        try:
            orders = read_text(Path(orders))
        except (OSError, UnicodeError) as error:
            raise ValueError(f"cannot read the orders: {error}") from None
    elif "\n" not in orders and not _looks_like_rows(orders):
        raise ValueError(
            f"{orders!r}: should be {', '.join(names)} or a CSV file with the columns time "
            f"and item{suggest(orders, names)}"
        )
    if _ROW_END in orders and "\n" in orders.strip():
        raise ValueError(f"a row has the sign {_ROW_END!r}: should have none, as it ends a row")
    return _ROW_END.join(line.rstrip() for line in orders.strip().splitlines())


def _looks_like_rows(text: str) -> bool:
    header = text.split(_ROW_END, 1)[0].lower().replace(";", ",")
    return _ROW_END in text and not {"time", "item"}.isdisjoint(header.split(","))


def orders_title(text: str) -> str:
    """Return how a table names orders: the rows of a file are too long for that."""
    return f"file of {text.count(_ROW_END)} orders" if _looks_like_rows(text) else text


@lru_cache(maxsize=64)
def order_file(text: str) -> OrderFile:
    """Return the orders of a file's rows, the first of which names the columns.

    Raises:
        ValueError: it cannot be; names the line, the column and the value.
    """
    lines = text.split(_ROW_END)
    rows = csv.reader(lines, delimiter=";" if ";" in lines[0] else ",")
    names = [name.strip().lower() for name in next(rows)]
    _check_names(names)
    cells = [(rows.line_num, _cells_of(names, row, rows.line_num)) for row in rows if row]
    if not 0 < len(cells) <= MOST_ROWS:
        raise ValueError(f"{len(cells)} orders: should be 1 to {MOST_ROWS}")
    cells.sort(key=lambda order: _number(order[0], order[1], "time", least=0.0))
    classes = tuple(sorted({row["item"] for _, row in cells if not row["item"].isdecimal()}))
    order_rows = [_order(line, row, classes) for line, row in cells]
    time, item, kind, dock, due, priority, line = zip(*order_rows, strict=True)
    return OrderFile(
        np.array(time),
        np.array(item),
        np.array(kind),
        dock,
        np.array(due),
        np.array(priority),
        np.array(line),
        classes,
    )


def _check_names(names: list[str]) -> None:
    for name in names:
        if name not in COLUMNS:
            raise ValueError(
                f"line 1: column {name!r}: should be one of {', '.join(COLUMNS)}"
                f"{suggest(name, COLUMNS)}"
            )
        if names.count(name) > 1:
            raise ValueError(f"line 1: column {name!r} stands there twice: should once")
    for name in ("time", "item"):
        if name not in names:
            raise ValueError(f"line 1: no column {name!r}: should be there")


def _cells_of(names: list[str], row: list[str], line: int) -> dict[str, str]:
    if len(row) != len(names):
        raise ValueError(f"line {line}: {len(row)} cells: should be {len(names)}, as in line 1")
    cells = {name: cell.strip() for name, cell in zip(names, row, strict=True)}
    item = cells["item"]
    if not item:
        raise ValueError(f"line {line}: item is empty: should be an item's number or a class")
    if not (item.isdecimal() or item[0].isalpha()):
        raise ValueError(
            f"line {line}: item = {item!r}: should be an item's number, 0 or more, or a class, "
            "which begins with a letter"
        )
    return cells


def _order(
    line: int, row: dict[str, str], classes: tuple[str, ...]
) -> tuple[float, int, int, str, float, float, int]:
    time = _number(line, row, "time", least=0.0)
    due = _number(line, row, "due", least=time) if row.get("due") else math.inf
    priority = _number(line, row, "priority") if row.get("priority") else 0.0
    item = row["item"]
    if item in classes:
        return time, ANY, classes.index(item), row.get("dock", ""), due, priority, line
    return time, int(item), ANY, row.get("dock", ""), due, priority, line


def _number(line: int, row: dict[str, str], name: str, least: float = -math.inf) -> float:
    try:
        number = float(row[name])
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"line {line}: {name} = {row[name]!r}: should be a number")
    if number < least:
        what = f"the order's time, {least:g} s" if name == "due" else f"{least:g}"
        raise ValueError(f"line {line}: {name} = {number:g}: should be at least {what}")
    return number
