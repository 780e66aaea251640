"""What a report on recorded trials says of their conditions, and how they were judged."""

from __future__ import annotations

from importlib.metadata import version

from swarm_logistics_env.report.result_tables import Section
from swarm_logistics_env.spi.bootstrap import MIN_SEEDS
from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.studies.plan import Plan


def recorded_setup(plan: Plan) -> tuple[Section, ...]:
    """Return what is known of the trials, the set-up that the user states, and the methods."""
    shared = "Paired by the seeds that it names" if plan.paired else "Unpaired: it names no seeds"
    known = (
        f"Study {plan.specification.name!r}: {len(plan.conditions)} conditions, imported from "
        f"{plan.imported_from}. {shared}. Of their conditions what varies is known, and what is "
        "stated below."
    )
    unstated = () if plan.setup else ("Nothing is stated of the set-up (--setup NAME=VALUE).",)
    return (
        Section("Study", lines=(known,)),
        Section("Set-up as stated", ("condition", "value"), plan.setup, unstated),
        Section("Methods", lines=(methods(plan),)),
    )


def methods(plan: Plan) -> str:
    """Return a paragraph for a paper: what was measured, how it was estimated and tested."""
    asked = dict.fromkeys(comparison.indicator for comparison in plan.comparisons)
    names = [DEFINITIONS[symbol].heading for symbol in asked]
    listed = " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
    n = len(plan.seeds)
    if plan.paired:
        trials = f"{n} trials of each of {len(plan.conditions)} conditions, paired by seed"
        test = "the paired t-test (Fieller's interval)"
        if n >= MIN_SEEDS:
            test += " and its studentised bootstrap, whichever gives the larger p"
    else:
        trials = f"up to {n} independent trials of each of {len(plan.conditions)} conditions"
        test = "Welch's t-test for independent samples"
    return (
        f"We measured performance P in {trials}. We report {listed}, each a ratio of mean "
        f"performances, with the 95 % interval that inverts {test}. An indicator is called above "
        "its threshold (supported) or below it (refuted) where this test rejects at 2.5 % on that "
        "side, else inconclusive; p is adjusted by Holm's method over all comparisons of one "
        "indicator for one policy. Computed with swarm-logistics-env "
        f"{version('swarm-logistics-env')}."
    )
