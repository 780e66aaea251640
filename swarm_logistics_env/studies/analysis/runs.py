"""The runs of one arm, as wholes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.studies.comparisons import Arm
from swarm_logistics_env.studies.execution import Outcome
from swarm_logistics_env.studies.judgement import Findings

Times = tuple[NDArray[np.float64], ...]


def outcomes_of(findings: Findings, arm: Arm) -> tuple[Outcome, ...] | None:
    """Return an arm's outcomes seed by seed; None where one failed, is missing or has no times."""
    plan = findings.plan
    found = [findings.outcomes.get(arm.condition.run(plan.code, seed).key) for seed in plan.seeds]
    complete = tuple(
        outcome
        for outcome in found
        if outcome is not None and outcome.error is None and outcome.untimed is None
    )
    return complete if len(complete) == len(found) else None


def times_of(findings: Findings, arm: Arm) -> Times | None:
    """Return an arm's delivery times [s] seed by seed; None as `outcomes_of`."""
    outcomes = outcomes_of(findings, arm)
    return None if outcomes is None else tuple(outcome.delivery_times for outcome in outcomes)
