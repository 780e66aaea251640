"""The set-up sheet: without the conditions in full, no indicator means anything."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.metadata import version
from typing import Any

from swarm_logistics_env.report.recorded_setup import recorded_setup
from swarm_logistics_env.report.result_tables import NOTHING, Section
from swarm_logistics_env.studies.plan import Plan


def setup_sheet(plan: Plan) -> tuple[Section, ...]:
    """Return everything that was held fixed and everything that was varied."""
    if plan.imported_from is not None:
        return recorded_setup(plan)
    specification = plan.specification
    policies = {condition.policy for condition in plan.conditions}
    return (
        Section(
            "Study",
            lines=_study(plan),
        ),
        Section(
            "Policies",
            ("policy", "class", "parameters", "source"),
            tuple(
                (policy.label, *_identified(policy.identity))
                for policy in sorted(policies, key=lambda policy: policy.label)
            ),
        ),
        *_failure_modes(plan),
        Section(
            "Base scenario",
            ("condition", "value", "unit, meaning; source"),
            tuple(specification.scenario.conditions()),
            tuple(_variations(plan)),
        ),
    )


def _study(plan: Plan) -> tuple[str, ...]:
    name = plan.specification.name
    return (
        (
            f"Study {name!r}: {len(plan.conditions)} conditions x {len(plan.seeds)} seeds "
            f"({plan.seeds[0]} to {plan.seeds[-1]}), the same seeds for every condition. "
            f"swarm-logistics-env {version('swarm-logistics-env')}, code version {plan.code}."
        ),
        (
            f"Performance P is {plan.specification.played.performance}. Intervals of "
            "P are t-intervals over seeds; those of indicators invert the test, paired by seed. A "
            "verdict is a paired test against the threshold, from ten seeds on the larger p of "
            "Student's t and the studentised bootstrap, below them t alone, one-sided "
            + (
                "at the levels of the declared looks."
                if plan.specification.looks
                else "2.5 % on each side."
            )
        ),
    )


def _identified(identity: str) -> tuple[str, str, str]:
    """Return class, parameters and digest of the source from a policy's identity."""
    try:
        told = json.loads(identity)
    except json.JSONDecodeError:  # one that a policy gave itself
        return identity, NOTHING, NOTHING
    if not isinstance(told, dict):
        return identity, NOTHING, NOTHING
    if set(told) == {"given", "policy"}:
        kind, parameters, source = _identified(told["policy"])
        given = f"given: {_listed(told['given'])}"
        return kind, given if parameters == NOTHING else f"{parameters}; {given}", source
    if set(told) != {"class", "parameters", "source"}:
        return identity, NOTHING, NOTHING
    return told["class"], _listed(told["parameters"]) or NOTHING, told["source"]


def _listed(parameters: object) -> str:
    if not isinstance(parameters, dict):
        return str(parameters)
    return ", ".join(f"{name} = {value}" for name, value in parameters.items())


def _failure_modes(plan: Plan) -> Iterator[Section]:
    modes = dict.fromkeys(fault.mode for c in plan.conditions for fault in c.faults)
    if modes:
        task = plan.conditions[0].task
        yield Section(
            "Failure modes",
            ("mode", "what it does to a robot"),
            tuple((mode, task.failure_modes[mode]) for mode in modes),
        )


def _variations(plan: Plan) -> Iterator[str]:
    specification = plan.specification
    for factor in (
        *specification.sizes,
        *specification.faults,
        *specification.parameters,
        *specification.ablations,
    ):
        scenario = plan.conditions[0].task.vary(specification.scenario, factor.scenario)
        if differing := _differing(scenario, specification.scenario):
            yield f"{factor.title or type(factor).__name__} differs: {differing}."


def _differing(scenario: Any, base: Any) -> str:
    theirs, ours = base.model_dump(), scenario.model_dump()
    return ", ".join(f"{name} = {ours[name]}" for name in ours if ours[name] != theirs[name])
