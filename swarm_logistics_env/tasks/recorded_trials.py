"""Recorded trials as a task: conditions that were met elsewhere, and cannot be played again."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from swarm_logistics_env.errors import StudyError, SwarmLogisticsError
from swarm_logistics_env.policies.spec import NO_MAKERS
from swarm_logistics_env.records import Record

from .task import Case, Fields, Outcome, TaskScenario


class RecordedScenario(Record):
    """What a file says of the conditions of a trial.

    Args:
        n_robots: swarm size N; 0: the file does not say.
        duration: of a trial [s]; 0: the file does not say.
        table: which of the file's own tables it stands in, where each has runs of its own.
        parameters: name and value of whatever else varies.
    """

    error_type: ClassVar[type[SwarmLogisticsError]] = StudyError

    n_robots: int = 0
    duration: float = 0.0
    table: str = ""
    parameters: tuple[tuple[str, float], ...] = ()

    def conditions(self) -> list[tuple[str, str, str]]:
        """Return name, value and unit of every condition."""
        return [(name, f"{value:g}", "") for name, value in self.parameters]


class RecordedFault(Record):
    """A failure mode of any name, in so many robots from `onset` [s] on."""

    error_type: ClassVar[type[SwarmLogisticsError]] = StudyError

    mode: str
    robots: int
    onset: float = 0.0


class RecordedTrials:
    """Trials of real robots, another simulator or a paper; see `Task` for the attributes."""

    name = "recorded trials"
    removed: str | None = "removed"
    performance = "what the file holds for each trial"
    default = RecordedScenario()
    policies = NO_MAKERS
    fields: Mapping[str, str] = MappingProxyType({})
    failure_modes: Mapping[str, str] = MappingProxyType({})

    def code(self) -> str:
        """Return a word in place of a code version: none made these runs."""
        return "imported"

    def vary(self, base: TaskScenario, fields: Fields) -> RecordedScenario:
        """Return the scenario of a file, of which nothing is varied by a study."""
        assert isinstance(base, RecordedScenario)
        return base.replace(**fields)

    def fault(
        self, mode: str, robots: int, onset: float, duration: float | None, manner: Fields
    ) -> RecordedFault:
        """Return the fault; how long it lasted is not recorded."""
        return RecordedFault(mode=mode, robots=robots, onset=onset)

    def play(self, case: Case, seed: int, policy_seed: int) -> Outcome:
        """Raise: what was recorded cannot be played again.

        Raises:
            StudyError: always.
        """
        raise StudyError("recorded trials cannot be played again: give a file with more of them")


RECORDED = RecordedTrials()
