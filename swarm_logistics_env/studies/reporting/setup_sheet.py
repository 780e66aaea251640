"""The set-up sheet: without the conditions in full, no indicator means anything."""

from __future__ import annotations

from importlib.metadata import version

from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.studies.plan import Plan
from swarm_logistics_env.studies.specification import vary


def setup_sheet(plan: Plan) -> str:
    """Return everything that was held fixed, as Markdown."""
    specification = plan.specification
    lines = [
        "## Set-up",
        "",
        (
            f"Study {specification.name!r}: {len(plan.conditions)} conditions x "
            f"{len(plan.seeds)} seeds (0 to {plan.seeds[-1]}), the same seeds for every condition. "
            f"swarm-logistics-env {version('swarm-logistics-env')}, code version {plan.code}."
        ),
        "",
        (
            "Performance P is the number of items delivered in the order requested. Intervals of "
            "P are t-intervals over seeds; those of indicators are Fieller's, paired by seed. A "
            "verdict is a paired t-test against the threshold, one-sided 2.5 % on each side."
        ),
        "",
        "Policies:",
        "",
    ]
    policies = {condition.policy for condition in plan.conditions}
    lines += [
        f"* {policy.label}: `{policy.identity}`"
        for policy in sorted(policies, key=lambda policy: policy.label)
    ]
    lines += ["", "Base scenario:", "", specification.scenario.sheet()]
    for factor in (
        *specification.sizes,
        *specification.faults,
        *specification.parameters,
        *specification.ablations,
    ):
        differing = _differing(
            vary(specification.scenario, factor.scenario), specification.scenario
        )
        if differing:
            title = factor.title or type(factor).__name__
            lines.append(f"{title} differs: {differing}.\n")
    return "\n".join(lines)


def _differing(scenario: Scenario, base: Scenario) -> str:
    theirs, ours = base.model_dump(), scenario.model_dump()
    return ", ".join(f"{name} = {ours[name]}" for name in ours if ours[name] != theirs[name])
