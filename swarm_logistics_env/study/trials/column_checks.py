"""Checks of a table as a whole: whether the columns that trials need are there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .complaints import Complaints
from .fault_names import FaultNames
from .table import Columns
from .wide import options_for_wide
from .words import MEANING, MORE_IS_BETTER

_FEWEST_AT_A_LIMIT = 3  # trials that last as long, and the longest, by no chance
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
        _refuse_time_limit(columns, duration)
    with complaints.noted():
        _refuse_time_beside_finished(columns, mapped)
    if MORE_IS_BETTER not in mapped:
        with complaints.noted():
            _refuse_time_as_performance(columns)


def _options_for(meaning: str, columns: Columns, complaints: Complaints) -> str:
    """Return the options that name a column which may be what is lacking."""
    used = {cells.name for cells in (*columns.by_meaning.values(), *columns.ignored)}
    left_out = used | complaints.suspected.keys()
    candidates = [
        cells
        for name, cells in columns.table.columns.items()
        if name and name not in left_out and cells.are_mostly_numbers
    ]
    options = []
    for cells in candidates:
        is_time = meaning == "performance" and cells.name.word_of_time
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
    if cells and (word := cells.name.word_of_time):
        raise IndicatorError(
            f"{cells.table.source}: {cells.name!r} is a time by its name ({word}): where less is "
            "better, as of the time until all is done, say --column "
            f"time_to_finish={cells.name!r}, and --column work=NAME if what was done in it varies; "
            f"where more is better, --column {MORE_IS_BETTER}={cells.name!r}"
        )


def _refuse_time_limit(columns: Columns, duration: float | None) -> None:
    """Ask whether trials that lasted the longest, all as long, were stopped then.

    Args:
        duration: of every trial [s], as somebody says.

    Raises:
        IndicatorError: nothing says it, or `duration` is no time.
    """
    if duration is not None and not 0.0 < duration < math.inf:
        raise IndicatorError(f"duration = {duration:g} s: should be a finite time above 0 s")
    cells = columns.by_meaning.get("time_to_finish")
    is_said = duration is not None or {"finished", "performance"} & columns.by_meaning.keys()
    if cells is None or is_said or not cells.are_like_numbers:
        return
    times = [cells.number(row) for row, text in enumerate(cells.texts) if text]
    longest = max(times, default=0.0)
    n_longest = times.count(longest)
    if n_longest >= _FEWEST_AT_A_LIMIT:
        lasted = columns.by_meaning.get("duration")
        ignored = f" --ignore {quote(lasted.name)}" if lasted else ""
        raise IndicatorError(
            f"{cells.table.source}: {n_longest} of {len(times)} trials have the longest "
            f"{cells.name!r}, {longest:.15g}, as if they had been stopped then: --duration "
            f"{longest:.15g}{ignored} says so; where they finished, --duration with a longer time"
        )


def _refuse_time_beside_finished(columns: Columns, mapped: Mapping[str, str]) -> None:
    """Ask whether a time is that of a delivery or that which a trial took.

    Raises:
        IndicatorError: the trials say whether they finished, and nobody what the time is.
    """
    cells = columns.by_meaning.get("time")
    if cells is None or "finished" not in columns.by_meaning or "time" in mapped:
        return
    raise IndicatorError(
        f"{cells.table.source} says whether trials finished, so {cells.name!r} may be how long "
        f"they took: --column time_to_finish={quote(cells.name)} says so; where each row is a "
        f"delivery, --column time={quote(cells.name)}"
    )
