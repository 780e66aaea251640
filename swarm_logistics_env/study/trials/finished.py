"""Which trials finished, in the words of those who noted it.

A word that `words` has neither for yes nor for no is refused: a guess would count a trial that was
stopped as one that finished.
"""

from __future__ import annotations

from shlex import quote

from swarm_logistics_env.spi.inputs import IndicatorError

from .complaints import Complaints
from .table import CellError, Columns
from .trial_columns import bare
from .words import NO_WORDS, YES_WORDS, plain

_FEWEST_AT_A_LIMIT = 3  # trials that last as long, and the longest, by no chance
_CROSS = "x"  # marks yes, unless another word of the column does


def finished_words(columns: Columns, complaints: Complaints) -> dict[str, bool]:
    """Return what each cell of the column `finished` says; none where nothing does.

    Args:
        complaints: take a cell that is of neither list, or is empty beside others; or a column that
            may say which trials finished, and would be a parameter.
    """
    if "time_to_finish" not in columns.by_meaning:
        return {}
    cells = columns.by_meaning.get("finished")
    if cells is None:
        with complaints.noted():
            _refuse_unnamed(columns)
        return {}
    first_rows = {text: row for row, text in reversed([*enumerate(cells.texts)])}
    if not any(first_rows):
        return {}
    meanings = {}
    for text, row in first_rows.items():
        meaning = says_yes(text)
        word = plain(text)
        if word == _CROSS:
            other_marks = any(says_yes(other) for other in first_rows if plain(other) != _CROSS)
            meaning = None if other_marks else True
        if meaning is None:
            option = quote(f"finished:{text}=no")
            error = cells.error(
                row,
                f"should be a word for yes or no: --value {option} where it means that a trial did "
                "not finish, else with =yes",
            )
            complaints.add(error)
        else:
            meanings[text] = meaning
    return meanings


def refuse_time_limit(columns: Columns, duration: float | None) -> None:
    """Ask whether trials that lasted the longest, all as long, were stopped then.

    Args:
        duration: of every trial [s], as somebody says.

    Raises:
        IndicatorError: nothing says it.
    """
    cells = columns.by_meaning.get("time_to_finish")
    is_said = duration is not None or {"finished", "performance"} & columns.by_meaning.keys()
    if cells is None or is_said or not cells.are_like_numbers():
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


def _refuse_unnamed(columns: Columns) -> None:
    """Ask of a column that may say which trials finished, and would be a parameter."""
    for cells in (*columns.parameters, *columns.covariates):
        words = {*cells.texts}
        means = says_yes(bare(cells.name))
        is_number = all(word.replace(".", "").isdigit() for word in words)
        if {says_yes(word) for word in words} != {True, False} or (is_number and means is None):
            continue
        values = ""
        if means is False:  # it says who did not finish
            for word in sorted(words):
                finished = "no" if says_yes(word) else "yes"
                values += f" --value {quote(f'finished:{word}={finished}')}"
        message = (
            f"{cells.table.source}: {cells.name!r} may say which trials finished: say --column "
            f"{quote(f'finished={cells.name}')}{values}, or leave it out by --ignore "
            f"{quote(cells.name)}"
        )
        raise CellError(message, cells.name, 0)


def says_yes(cell: str) -> bool | None:
    """Return what a word says; None: it is neither for yes nor for no."""
    word = plain(cell)
    if word in YES_WORDS:
        return True
    return False if word in NO_WORDS else None
