"""The runs of one arm, as wholes."""

from __future__ import annotations

from swarm_logistics_env.studies.comparisons import Arm
from swarm_logistics_env.studies.execution import Outcome
from swarm_logistics_env.studies.judgement import Findings


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
