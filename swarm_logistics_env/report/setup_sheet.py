"""The set-up sheet: without the conditions in full, no indicator means anything."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.metadata import version

from swarm_logistics_env.report.recorded_setup import recorded_setup
from swarm_logistics_env.report.result_tables import Section
from swarm_logistics_env.report.wording import NOTHING
from swarm_logistics_env.studies.plan import Plan


def setup_sheet(plan: Plan) -> tuple[Section, ...]:
    """Return everything that was held fixed and everything that was varied."""
    if plan.imported_from is not None:
        return recorded_setup(plan)
    policies = {condition.policy.label: condition.policy.identity for condition in plan.conditions}
    return (
        Section("Study", lines=tuple(_study(plan))),
        Section(
            "Policies",
            ("policy", "class", "parameters", "source"),
            tuple((label, *_identified(policies[label])) for label in sorted(policies)),
        ),
        *_failure_modes(plan),
        Section(
            "Base scenario",
            ("condition", "value", "unit, meaning; source"),
            tuple(plan.specification.scenario.conditions()),
            tuple(_variations(plan)),
        ),
    )


def _study(plan: Plan) -> Iterator[str]:
    yield (
        f"Study {plan.specification.name!r}: {len(plan.conditions)} conditions x "
        f"{len(plan.seeds)} seeds ({plan.seeds[0]} to {plan.seeds[-1]}), the same seeds for every "
        f"condition. swarm-logistics-env {version('swarm-logistics-env')}, code version "
        f"{plan.code}."
    )
    looks = plan.specification.looks
    level = "at the levels of the declared looks." if looks else "2.5 % on each side."
    yield (
        f"Performance P is {plan.specification.played.performance}. Intervals of P are "
        "t-intervals over seeds; those of indicators invert the test, paired by seed. A verdict is "
        "a paired test against the threshold, from ten seeds on the larger p of Student's t and "
        f"the studentised bootstrap, below them t alone, one-sided {level}"
    )


def _identified(identity: str) -> tuple[str, str, str]:
    """Return class, parameters and digest of the source from a policy's identity."""
    try:
        told = json.loads(identity)
    except json.JSONDecodeError:  # a policy's own identity need not be JSON
        told = None
    match told:
        case {"given": given, "policy": str(policy)}:
            kind, parameters, source = _identified(policy)
            own = "" if parameters == NOTHING else f"{parameters}; "
            return kind, f"{own}given: {_listed(given)}", source
        case {"class": kind, "parameters": parameters, "source": source}:
            return kind, _listed(parameters) or NOTHING, source
    return identity, NOTHING, NOTHING


def _listed(parameters: object) -> str:
    if not isinstance(parameters, dict):
        return str(parameters)
    return ", ".join(f"{name} = {value}" for name, value in parameters.items())


def _failure_modes(plan: Plan) -> Iterator[Section]:
    modes = dict.fromkeys(fault.mode for c in plan.conditions for fault in c.faults)
    known = plan.conditions[0].task.failure_modes
    if modes:
        rows = tuple((mode, known[mode]) for mode in modes)
        yield Section("Failure modes", ("mode", "what it does to a robot"), rows)


def _variations(plan: Plan) -> Iterator[str]:
    asked = plan.specification
    base = asked.scenario.model_dump()
    for factor in (*asked.sizes, *asked.faults, *asked.parameters, *asked.ablations):
        changed = plan.conditions[0].task.vary(asked.scenario, factor.scenario).model_dump()
        differing = [f"{name} = {x}" for name, x in changed.items() if x != base[name]]
        if differing:
            title = factor.title or type(factor).__name__
            yield f"{title} differs: {', '.join(differing)}."
