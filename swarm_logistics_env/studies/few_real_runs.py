"""Few real trials beside many simulated ones: each indicator from the real alone and from both."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.studies.comparisons import Arm, Comparison
from swarm_logistics_env.studies.results import StudyResults


class Narrowed(NamedTuple):
    """One indicator of the real trials.

    Attributes:
        comparison: of the real study.
        alone: from its trials alone.
        combined: with the simulated ones; None: `problem` says why not.
    """

    comparison: Comparison
    alone: Estimate
    combined: Estimate | None
    problem: str | None

    @property
    def width(self) -> float | None:
        """Width of the combined interval over that of the real trials alone."""
        if self.combined is None:
            return None
        low, high, combined = self.alone.low, self.alone.high, self.combined
        if low is None or high is None or combined.low is None or combined.high is None:
            return None
        ratio = (combined.high - combined.low) / (high - low)
        return ratio if np.isfinite(ratio) else None


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
    """Yield every indicator of the real trials, alone and with the simulated ones.

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
    found = False
    for comparison in real.plan.comparisons:
        model = models.get((comparison.question, comparison.policy if several else ""))
        if model is None:
            continue
        found = True
        alone = comparison.estimate(lambda arm: _performance(real, arm, seeds))
        named = model.arguments.items()
        simulation = spi.Simulation(
            {name: _performance(simulated, arm, seeds) for name, arm in named},
            {name: _performance(simulated, arm, further) for name, arm in named},
        )
        try:
            both = comparison.estimate(
                lambda arm: _performance(real, arm, seeds), simulation=simulation
            )
            yield Narrowed(comparison, alone, both, None)
        except spi.IndicatorError as error:
            yield Narrowed(comparison, alone, None, str(error))
    if not found:
        asked = "; ".join(dict.fromkeys(c.label for c in real.plan.comparisons))
        theirs = "; ".join(dict.fromkeys(c.label for c in simulated.plan.comparisons))
        raise StudyError(f"the simulated trials compare {theirs}: should be some of {asked}")


def _performance(results: StudyResults, arm: Arm, seeds: Sequence[int]) -> NDArray[np.float64]:
    """Return P of an arm at some seeds, shape (len(seeds),).

    Raises:
        StudyError: a run of them is missing or failed.
    """
    values = []
    for seed in seeds:
        outcome = results.outcomes.get(arm.condition.run(results.plan.code, seed).key)
        if outcome is None or outcome.error is not None:
            raise StudyError(f"{arm.setting}: the run of seed {seed} is missing or failed")
        values.append(outcome.delivered)
    return np.array(values, dtype=np.float64)
