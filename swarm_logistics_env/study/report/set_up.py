"""The set-up of a study: all that was fixed and varied, and how it was measured and tested."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import version

from swarm_logistics_env.spi.definitions import DEFINITIONS
from swarm_logistics_env.study.questions.comparison import CONFIDENCE, Setting
from swarm_logistics_env.study.questions.plan import Origin, Plan

from .section import Section, join_names, percent


def setup_sheet(plan: Plan) -> tuple[Section, ...]:
    """Return everything that was held fixed and everything that was varied."""
    if plan.origin is not None:
        return _recorded_setup(plan, plan.origin)
    policies = {case.policy.title: case.identity for case in plan.cases}
    return (
        Section("Study", lines=(f"{_version()}, code version {plan.code}.",)),
        Section("Policies", ("policy", "identity"), tuple(sorted(policies.items()))),
        *_failure_modes(plan),
        Section(
            "Base scenario",
            ("condition", "value", "unit, meaning; source"),
            tuple(plan.specification.scenario.conditions()),
            tuple(_variations(plan)),
        ),
    )


def _failure_modes(plan: Plan) -> Iterator[Section]:
    modes = dict.fromkeys(fault.mode for case in plan.cases for fault in case.faults)
    descriptions = plan.cases[0].task.failure_modes
    if modes:
        rows = tuple((mode, descriptions[mode]) for mode in modes)
        yield Section("Failure modes", ("mode", "what it does to a robot"), rows)


def _variations(plan: Plan) -> Iterator[str]:
    study = plan.specification
    base = study.scenario.model_dump()
    for factor in (*study.sizes, *study.faults, *study.parameters, *study.ablations):
        changed = plan.cases[0].task.vary(study.scenario, factor.scenario).model_dump()
        differing = [f"{name} = {x}" for name, x in changed.items() if x != base.get(name)]
        if differing:
            title = factor.title or type(factor).__name__
            yield f"{title} differs: {', '.join(differing)}."
    for faults in study.faults:
        if manner := str(faults):
            yield f"{faults.title or 'Faults'}: robots fail {manner}."
    for ablation in study.ablations:
        if ablation.mode:
            fault = Setting("fault", ablation.mode, ablation.robots, ablation.onset)
            yield f"{ablation.title or 'Ablation'}: {fault}, under both policies."


def _recorded_setup(plan: Plan, origin: Origin) -> tuple[Section, ...]:
    """Return what is known of the trials, the set-up that the user states, and the methods."""
    shared = "Unpaired: it names no seeds"
    if origin.paired:
        shared = "Paired by the seeds that it names"
    if origin.paired and origin.blocks:
        shared = "Paired by the blocks that it names"
    text = (
        f"Study {plan.specification.name!r}: {len(plan.cases)} conditions, imported from "
        f"{origin.file}. {shared}. Their conditions are known as far as the file tells them "
        "and they are stated below."
    )
    unstated = () if origin.setup else ("Nothing is stated of the set-up (--setup NAME=VALUE).",)
    return (
        Section("Study", lines=(text, *origin.notes)),
        Section("Set-up as stated", ("condition", "value"), origin.setup, unstated),
    )


def methods(plan: Plan, looks: tuple[int, ...] = ()) -> str:
    """Return a paragraph for a paper: what was measured, how it was estimated and tested.

    Args:
        looks: numbers of seeds at which comparisons might stop; none: they are not looked at.
    """
    symbols = dict.fromkeys(comparison.indicator for comparison in plan.comparisons)
    names = [DEFINITIONS[symbol].heading for symbol in symbols]
    n = len(plan.seeds)
    if plan.paired:
        runs = "trials" if plan.origin else "simulated runs"
        count = f"at least {n}" if looks else f"{n}"
        pair = "block" if plan.origin and plan.origin.blocks else "seed"
        trials = f"{count} {runs} of each of {len(plan.cases)} conditions, paired by {pair}"
        if plan.origin and any(trial.n_trials > 1 for trial in plan.origin.trials):
            trials = f"{n} blocks, by the means of their trials in {len(plan.cases)} conditions"
        test = "the paired t-test of a logarithm"
    else:
        trials = f"up to {n} independent trials of each of {len(plan.cases)} conditions"
        test = "Welch's t-test of a logarithm"
    level = percent(CONFIDENCE)
    side = f"{50 * (1 - CONFIDENCE):.3g} %"
    interval = f"the {level} interval"
    stops = ""
    if looks:
        interval = "the interval"
        side = f"its share of {side}"
        stops = (
            f" The study was looked at after {join_names([*map(str, looks)])} seeds, and each "
            "comparison stopped where it was clear, where its verdict could hardly change any more "
            "or where P was shown to change within the margin; the latter two stayed open. Its "
            "error was spent over these looks in "
            "proportion to the seeds, so that an interval has the level of its look, which stands "
            f"with it, and those of all looks together hold the true value with {level}."
        )
    if any(len(arm.case.trainings) > 1 for _, _, arm in plan.cells):
        stops += (
            " An interval over trainings holds for trainings like those played; that more collapse "
            "is part of the verdict alone."
        )
    return (
        f"We measured performance P in {trials}. We report {join_names(names)}, each a ratio of "
        f"mean performances, with {interval} that inverts {test}.{stops} An indicator is called "
        "above its threshold (supported) or below it (refuted) where this test rejects at "
        f"{side} on that side, also if runs that stall were hidden, else open; it is "
        "untestable where it cannot lie below, where P_o is not told from 0 or where P is the "
        "same in nearly all pairs of runs. Beside it stands whether two one-sided tests find that "
        "P changes by less than "
        f"{100 * plan.specification.margin:.3g} % of P_o; p is adjusted by Holm's method over all "
        f"comparisons of one indicator for one policy. Computed with {_version()}."
    )


def _version() -> str:
    return f"swarm-logistics-env {version('swarm-logistics-env')}"
