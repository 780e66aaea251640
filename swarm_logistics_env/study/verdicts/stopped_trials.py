"""Trials that were stopped before they finished, and not counted: their P lies between two ends.

As P counts more the one way and less the other, an indicator is largest, and smallest, at ends of
the conditions. A one-sided test errs no more than its level if it is made at the end that speaks
most against it: that the indicator is below its threshold where it is largest, and above where it
is smallest (partial identification: Manski 2003).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product

from swarm_logistics_env.spi import Equivalence, Estimate
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study.questions.comparison import Arm

from .cell import Cell


def samples_at_ends(cells: Mapping[Arm, Cell], arms: Sequence[Arm]) -> Iterator[dict[Arm, Numbers]]:
    """Yield P of each arm, shape (n_seeds,), at every choice of ends, the largest P first."""
    ends = [
        [cells[arm].by_seed, cells[arm].least_by_seed]
        if cells[arm].has_stopped
        else [cells[arm].by_seed]
        for arm in arms
    ]
    for samples in product(*ends):
        yield dict(zip(arms, samples))


def estimate_over_ends(estimates: Sequence[Estimate]) -> Estimate:
    """Return the first estimate with the limits and the test that hold at all ends.

    Where the ends lie on two sides of the threshold, p is 1.
    """
    first = estimates[0]
    smallest = min(estimates, key=lambda estimate: estimate.value)
    largest = max(estimates, key=lambda estimate: estimate.value)
    if len(estimates) == 1 or first.untestable:
        return first
    base = largest if largest.value < first.threshold else smallest
    has_limits = smallest.low is not None and largest.high is not None
    combined = replace(
        base,
        value=first.value,
        low=smallest.low if has_limits else None,
        high=largest.high if has_limits else None,
    )
    if smallest.value <= first.threshold <= largest.value and base.p_value is not None:
        return replace(combined, p_value=1.0, p_seen=1.0, probability=0.5)
    return combined


def equivalence_over_ends(tests: Sequence[Equivalence]) -> Equivalence:
    """Return the tests of equivalence that hold at all ends."""
    return replace(
        tests[0],
        change=estimate_over_ends([test.change for test in tests]),
        above=estimate_over_ends([test.above for test in tests]),
        below=estimate_over_ends([test.below for test in tests]),
    )
