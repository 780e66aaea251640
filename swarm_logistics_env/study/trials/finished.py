"""Which trials finished, in the words of those who noted it.

A word that `words` has neither for yes nor for no is refused: a guess would count a trial that was
stopped as one that finished.
"""

from __future__ import annotations

from shlex import quote

from .complaints import Complaints
from .table import CellError, Columns
from .words import plain, says_yes

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


def _refuse_unnamed(columns: Columns) -> None:
    """Ask of a column that may say which trials finished, and would be a parameter."""
    for cells in (*columns.parameters, *columns.covariates):
        words = {*cells.texts}
        means = says_yes(cells.name.bare)
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
