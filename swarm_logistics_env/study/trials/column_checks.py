"""Checks of columns: whether those are there that no other can stand for, and what they may be."""

from __future__ import annotations

from collections.abc import Mapping
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .complaints import Complaints
from .fault_names import FaultNames
from .finished import refuse_time_limit
from .table import Columns, holds_numbers
from .units import word_of_time
from .wide import options_for_wide
from .words import MEANING, MORE_IS_BETTER

_MOST_OPTIONS = 4  # that are proposed for a column that is lacking


def check_columns(
    columns: Columns,
    faults: FaultNames,
    mapped: Mapping[str, str],
    duration: float | None,
    complaints: Complaints,
) -> None:
    """Check that the columns are there that no other can stand for.

    Args:
        mapped: what a column is to its name in the file, as somebody says.
        duration: of every trial [s], as somebody says.
        complaints: take what is lacking, a time that may be a limit, and a performance that is a
            time by its name.
    """
    names = columns.by_meaning
    lacking = {}
    if not {"performance", "time", "time_to_finish"} & names.keys():
        lacking["performance"] = "column 'performance', or time, for one delivery a row"
    if faults.any_fails and "faulty" not in names:
        lacking["faulty"] = "column 'faulty', for how many robots fail"
    if faults.any_fails and "n_robots" not in names:
        lacking["robots"] = "column 'robots', for the swarm's size, without which R is undefined"
    header = ", ".join(map(repr, columns.table.header))
    for name, words in lacking.items():
        if MEANING[name] not in complaints.suspected.values():
            message = f"{columns.table.source} has no {words}: it has {header}; say which it is by "
            message += f"{_options_for(name, columns, complaints)}, or add it"
            complaints.add(IndicatorError(message))
    with complaints.noted():
        refuse_time_limit(columns, duration)
    if MORE_IS_BETTER not in mapped:
        with complaints.noted():
            _refuse_time_as_performance(columns)


def _options_for(meaning: str, columns: Columns, complaints: Complaints) -> str:
    """Return the options that name a column which may be what is lacking."""
    left_out = {cells.name for cells in (*columns.by_meaning.values(), *columns.ignored)}
    left_out |= complaints.suspected.keys()
    candidates = [
        cells
        for name, cells in columns.table.columns.items()
        if name and name not in left_out and holds_numbers(cells.texts)
    ]
    options = []
    for cells in candidates:
        is_time = meaning == "performance" and word_of_time(cells.name)
        word = "time_to_finish" if is_time else meaning
        options.append(f"--column {quote(f'{word}={cells.name}')}")
    text = " or ".join(options) if 0 < len(options) <= _MOST_OPTIONS else f"--column {meaning}=NAME"
    if meaning == "faulty":
        return f"{text}, or --column faulty=1 where one fails in each trial with a fault"
    if meaning == "robots":
        return f"{text}, or --column robots=8 where there are 8 in each trial"
    if len(candidates) > 1:
        names = [cells.name for cells in candidates]
        return f"{text}, or, where each column is a condition, {options_for_wide(names)}"
    return text


def _refuse_time_as_performance(columns: Columns) -> None:
    """Ask of a performance that is a time by its name whether more of it is better."""
    cells = columns.by_meaning.get("performance")
    if cells and (word := word_of_time(cells.name)):
        raise IndicatorError(
            f"{cells.table.source}: {cells.name!r} is a time by its name ({word}): where less is "
            "better, as of the time until all is done, say --column "
            f"time_to_finish={cells.name!r}, and --column work=NAME if what was done in it varies; "
            f"where more is better, --column {MORE_IS_BETTER}={cells.name!r}"
        )
