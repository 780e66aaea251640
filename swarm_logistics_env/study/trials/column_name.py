"""The name of a column, and what it says of the column."""

from __future__ import annotations

import re

from .units import without_unit, word_of_time
from .words import MEANING, TIMES, plain

_ROBOT = re.compile(r"(robot|agent|drone|bot)(_?(id|no|nr|num|number|name|index|label))?|id_robot")

_IN_PERCENT = re.compile(r"(.*\S)\s+in\s+%\s*")


class ColumnName(str):
    """The name of a column as a file has it."""

    __slots__ = ()

    @property
    def bare(self) -> str:
        """In small letters, without accents and unit: "Time [s]" is "time"."""
        without_brackets = re.sub(r"\s*[\[(].*?[\])]\s*", " ", self)
        return re.sub(r"\W+", "_", plain(without_brackets)).strip("_")

    @property
    def meaning(self) -> str | None:
        """What the column is by its name, a key of `COLUMN_NAMES`; None: it is not known."""
        if percent := _IN_PERCENT.fullmatch(self):  # "P in %", but no number of robots
            return "performance" if ColumnName(percent[1]).meaning == "performance" else None
        word = self.bare
        stem = without_unit(word)
        is_time = MEANING.get(stem) in TIMES and stem != "length"  # whose "min" may be the least
        return MEANING.get(stem if is_time else word)

    @property
    def tells_robots(self) -> bool:
        """Whether the column tells robots apart."""
        return _ROBOT.fullmatch(self.bare) is not None

    @property
    def word_of_time(self) -> str | None:
        """The word by which it is the name of a time; None: it is none."""
        return word_of_time(self)
