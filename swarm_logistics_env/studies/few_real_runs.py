"""Few real trials and many simulated ones: what the real say alone, and with the simulated."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.spi.summaries import Interval

from .comparisons import Arm, Comparison
from .results import StudyResults


class Narrowed(NamedTuple):
    """One mean performance or indicator of the real trials.

    Attributes:
        policy: label of the policy.
        name: what it is, e.g. "P, no fault" or "R > 0, FM1, m = 2".
        alone: from the real trials alone.
        combined: with the simulated ones; None: `problem` says why not.
    """

    policy: str
    name: str
    alone: Interval | Estimate
    combined: Interval | Estimate | None
    problem: str | None = None

    @property
    def width(self) -> float | None:
        """Width of the combined interval over that of the real trials alone; None: unknown."""
        widths = [
            math.nan if one is None or one.low is None or one.high is None else one.high - one.low
            for one in (self.combined, self.alone)
        ]
        ratio = widths[0] / widths[1] if widths[1] else math.nan
        return ratio if math.isfinite(ratio) else None


def replays(real: StudyResults, simulated: StudyResults) -> tuple[list[int], list[int]]:
    """Return the seeds of the real trials, and those that were simulated only.

    Raises:
        StudyError: trials without seeds, or a real one whose set-up was not simulated.
    """
    for name, results in (("real", real), ("simulated", simulated)):
        if not results.plan.paired:
            raise StudyError(
                f"the {name} trials have no seeds: should have them, so that each real trial is "
                "beside the simulation of its own set-up"
            )
    seeds = list(real.plan.seeds)
    missing = [seed for seed in seeds if seed not in set(simulated.plan.seeds)]
    if missing:
        raise StudyError(f"seed {missing[0]} of the real trials was not simulated: should be")
    return seeds, [seed for seed in simulated.plan.seeds if seed not in set(seeds)]


def narrowed(real: StudyResults, simulated: StudyResults) -> Iterator[Narrowed]:
    """Yield P and every indicator of the real trials, alone and with the simulated ones.

    What is compared in both is matched by the words and numbers of the settings, and by the policy
    where the simulated study has several.

    Raises:
        StudyError: as `replays`, or no comparison of the one is in the other.
    """
    seeds, further = replays(real, simulated)
    several = len({comparison.policy for comparison in simulated.plan.comparisons}) > 1
    models = {
        (comparison.question, comparison.policy if several else ""): comparison
        for comparison in simulated.plan.comparisons
    }
    matched = {
        comparison: models[key]
        for comparison in real.plan.comparisons
        if (key := (comparison.question, comparison.policy if several else "")) in models
    }
    if not matched:
        asked = "; ".join(dict.fromkeys(c.label for c in real.plan.comparisons))
        theirs = "; ".join(dict.fromkeys(c.label for c in simulated.plan.comparisons))
        raise StudyError(f"the simulated trials compare {theirs}: should be some of {asked}")
    arms = {
        (comparison.policy, arm): other
        for comparison, model in matched.items()
        for arm, other in zip(comparison.arguments.values(), model.arguments.values())
    }
    for (policy, arm), model_arm in arms.items():
        p = _performance(real, arm, seeds)
        found = Narrowed(policy, f"P, {arm.setting}", spi.mean_interval(p), None)
        replayed, others = (_performance(simulated, model_arm, some) for some in (seeds, further))
        try:
            yield found._replace(combined=spi.mean_with_simulation(p, replayed, others))
        except spi.IndicatorError as error:
            yield found._replace(problem=str(error))
    for comparison, model in matched.items():
        yield _indicator(comparison, model, real, simulated, (seeds, further))


def _indicator(
    comparison: Comparison,
    model: Comparison,
    real: StudyResults,
    simulated: StudyResults,
    seeds: tuple[Sequence[int], Sequence[int]],
) -> Narrowed:
    def of_real(arm: Arm) -> NDArray[np.float64]:
        return _performance(real, arm, seeds[0])

    simulation = spi.Simulation(
        *(
            {name: _performance(simulated, arm, some) for name, arm in model.arguments.items()}
            for some in seeds
        )
    )
    name = f"{comparison.indicator} > {comparison.threshold:.3g}, {comparison.label}"
    found = Narrowed(comparison.policy, name, comparison.estimate(of_real), None)
    try:
        return found._replace(combined=comparison.estimate(of_real, simulation=simulation))
    except spi.IndicatorError as error:
        return found._replace(problem=str(error))


def _performance(results: StudyResults, arm: Arm, seeds: Sequence[int]) -> NDArray[np.float64]:
    """Return P of an arm at some seeds, shape (len(seeds),).

    Raises:
        StudyError: a run of them is missing or failed.
    """
    values = []
    for seed in seeds:
        outcome = results.outcome(arm, seed)
        if outcome is None:
            raise StudyError(f"{arm.setting}: the run of seed {seed} is missing or failed")
        values.append(outcome.delivered)
    return np.array(values, dtype=np.float64)
