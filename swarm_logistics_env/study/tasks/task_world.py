"""What a task says of its world, and what P of its runs is: what it counts, or another measure."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .outcome import Outcome
from .task import Case, Task, TaskFault, TaskScenario


class TaskWorld:
    """What reports and verdicts ask a task about its world, and the answers of one that is silent.

    A task inherits from it to say more; `Task` does not require it.

    Attributes:
        counted: what P counts, as "items"; empty: P is no count, or nobody says of what.
    """

    counted: str = ""

    def world_in_words(self, scenario: TaskScenario) -> str:
        """Return where runs are played, e.g. "a warehouse of 6 m x 5 m"; empty: by its name."""
        return ""

    def preset_in_words(self, scenario: TaskScenario) -> str:
        """Return the preset of a scenario and what differs; empty: it is near none."""
        return ""

    def engine(self, scenario: TaskScenario) -> str:
        """Return what moves the bodies, e.g. "chipmunk"; empty: there is nothing to choose."""
        return ""

    def largest_performance(self, scenario: TaskScenario) -> float:
        """Return the largest P that a run can have; infinite: none is."""
        return math.inf

    def mode_title(self, mode: str) -> str:
        """Return a failure mode in two words, for tables of verdicts; empty: its name says it."""
        return ""

    def check_faults(self, scenario: TaskScenario, faults: Sequence[TaskFault]) -> None:
        """Raise a SwarmLogisticsError if a fault names robots that a scenario has not."""

    def watch_command(self, case: Case) -> str | None:
        """Return the command that shows a run of a case, but for its seed; None: there is none."""
        return None


def p_of(case: Case, outcome: Outcome) -> float:
    """Return P of a run of a case."""
    return case.performance.of_run(outcome) if case.performance else outcome.delivered


def is_capped(case: Case, outcome: Outcome) -> bool:
    """Return whether P of a run of a case would be larger if there had been more to do."""
    return case.performance.is_capped(outcome) if case.performance else outcome.capped


def counted_in(case: Case) -> str:
    """Return what P of a case counts, as "items"; empty: it is no count."""
    return case.performance.counted if case.performance else world_of(case.task).counted


def largest_performance(case: Case) -> float:
    """Return the largest P that a run of a case can have; infinite: none is."""
    if case.performance is None:
        return world_of(case.task).largest_performance(case.scenario)
    largest = case.performance.largest
    return math.inf if largest is None else largest


def world_of(task: Task) -> TaskWorld:
    """Return what a task says of its world."""
    return task if isinstance(task, TaskWorld) else TaskWorld()
