"""Sections on faults beyond FT and R: budgets, resilience and self-repair, anchoring."""

from __future__ import annotations

from collections.abc import Iterator

from swarm_logistics_env.studies.analysis.faulty_runs import (
    ModeBudget,
    anchoring_loads,
    fault_budgets,
)
from swarm_logistics_env.studies.judgement import Findings
from swarm_logistics_env.studies.reporting import wording
from swarm_logistics_env.studies.reporting.beyond_resilience import beyond_resilience
from swarm_logistics_env.studies.reporting.sections import Section


def beyond_faults(findings: Findings) -> Iterator[Section]:
    """Yield what there is to say of a study's faults beyond FT and R."""
    budgets = [_budget(budget) for budget in fault_budgets(findings)]
    if budgets:
        yield Section(
            "Fault budget",
            ("policy", "failure mode", "N", "m tested", "robots that may fail"),
            tuple(budgets),
            (
                (
                    "The largest m with R > 0 supported at every m' up to it, tested in order, "
                    "with unadjusted verdicts: the sequence is fixed, so the error stays below "
                    f"5 %. Over {wording.seeds_text(findings)}."
                ),
            ),
        )
    yield from beyond_resilience(findings)
    loads = [
        (
            load.comparison.policy,
            str(load.comparison.changed.level),
            wording.bracketed(load.load, 1),
            wording.bracketed(load.neighbours, 3),
        )
        for load in anchoring_loads(findings)
    ]
    if loads:
        yield Section(
            "Anchoring load",
            ("policy", "fault", "robot-seconds a run [95 %]", "robots by a failed one [95 %]"),
            tuple(loads),
            (
                (
                    "Time that working robots spend in contact range of failed ones; in the paired "
                    "run with the same robots removed it is 0. The last column is the load per "
                    "failed robot and second of failure."
                ),
            ),
        )


def _budget(budget: ModeBudget) -> tuple[str, ...]:
    level = budget.comparison.changed.level
    if budget.budget is None:
        answer = "blocked: runs are missing"
    elif budget.budget.limit is None:
        answer = f"at least {budget.budget.robots}"
    elif budget.budget.limit not in budget.tested:
        answer = f"{budget.budget.robots} shown; m = {budget.budget.limit} was not tested"
    else:
        # That more may fail is either refuted, or not known: not the same to who has to decide.
        answer = f"{budget.budget.robots}; m = {budget.budget.limit} {budget.verdict}"
    return (
        budget.comparison.policy,
        level.name + (f" from {level.onset:g} s" if level.onset else ""),
        str(budget.comparison.original.condition.scenario.n_robots),
        ", ".join(map(str, budget.tested)),
        answer,
    )
