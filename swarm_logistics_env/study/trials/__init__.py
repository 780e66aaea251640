"""Trials recorded anywhere: real robots, another simulator, a paper's tables.

A reader makes a `Table` of a file's cells, `columns` says what each column is, `reading` makes
trials of the rows.
"""

from .reading import read_trials
from .trial import NO_FAULT_WORD, REMOVED_WORD, REPEATED, Column, Trial, Trials

__all__ = ["NO_FAULT_WORD", "REMOVED_WORD", "REPEATED", "Column", "Trial", "Trials", "read_trials"]
