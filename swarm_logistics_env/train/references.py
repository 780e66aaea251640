"""Reference performances from a stored study."""

from __future__ import annotations

from pathlib import Path

from swarm_logistics_env.errors import StudyError, TrainingError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.wrappers.condition import Condition, changes_of


def performances_of_study(directory: str | Path, own: Scenario) -> dict[Condition, float]:
    """Return the mean P [items] of every condition that the study in `directory` ran.

    Args:
        directory: the directory of a study of one policy, the policy to improve on.
        own: the scenario of the training; conditions are relative to it.

    Raises:
        TrainingError: there is no such study, or it is of several policies.
    """
    try:
        results = Study.stored(directory).findings()
    except StudyError as error:
        raise TrainingError(f"indicators.references: {error}") from error
    labels = set(results.performance["policy"])
    if len(labels) != 1:
        raise TrainingError(
            f"indicators.references: the study in {directory} is of {', '.join(sorted(labels))}: "
            "should be of one policy"
        )
    performances: dict[Condition, float] = {}
    for cell in rows_of(results.performance):
        condition = cell.arm.condition
        if cell.n_seeds and not condition.behaviour:
            performances[_met(condition.scenario, condition.faults, own)] = cell.mean
    return performances


def _met(scenario: Scenario, faults: tuple[Fault, ...], own: Scenario) -> Condition:
    counts = {fault.mode: _count(fault) for fault in faults}
    removed = counts.pop("removed", 0)
    return Condition(
        scenario.n_robots,
        tuple(sorted(counts)),
        # The sets of one seed are nested, so the largest is all of them.
        n_failed=max(counts.values(), default=0),
        n_removed=removed,
        changes=changes_of(scenario, own),
    )


def _count(fault: Fault) -> int:
    return len(fault.robots) if isinstance(fault.robots, tuple) else fault.robots
