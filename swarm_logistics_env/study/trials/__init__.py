"""Trials recorded anywhere: real robots, another simulator, a paper's tables.

A reader makes a `Table` of a file's cells, `trial_columns` says what each column is and cuts its
cells out, `trial_rows` makes trials of them; `reading` has them do so, one after the other.
"""

from .reading import read_trials
from .trial import NO_FAULT_WORD, REMOVED_WORD, REPEATED, Column, Trial, Trials

__all__ = ["NO_FAULT_WORD", "REMOVED_WORD", "REPEATED", "Column", "Trial", "Trials", "read_trials"]
