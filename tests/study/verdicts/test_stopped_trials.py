"""Trials that were stopped: an estimate holds at both ends of what they may have delivered."""

from __future__ import annotations

from dataclasses import replace

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import Estimate
from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Arm
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.stopped_trials import (
    equivalence_over_ends,
    estimate_over_ends,
    samples_at_ends,
)
from tests.made_up import delivered

P_O = [40, 42, 39, 41, 43, 40, 38, 41, 44, 40, 42, 39]


def at(change: float) -> Estimate:
    """Return robustness where a robot of 25 fails and P changes by so much, with some scatter."""
    p_f = [(1.0 + change) * p + k % 3 for k, p in enumerate(P_O)]
    return spi.robustness(P_O, p_f, n=25, m=1)


@pytest.mark.parametrize(
    ("changes", "base"),
    [((-0.2, -0.4), 0), ((0.2, 0.1), 1), ((-0.3, -0.4, -0.2), 2), ((0.3, 0.1, 0.2), 1)],
)
def test_the_test_is_made_at_the_end_that_speaks_most_against_it(
    changes: tuple[float, ...], base: int
) -> None:
    ends = [at(change) for change in changes]
    values = [end.value for end in ends]
    smallest = ends[values.index(min(values))]
    largest = ends[values.index(max(values))]
    combined = estimate_over_ends(ends)
    assert combined == replace(ends[base], value=ends[0].value, low=smallest.low, high=largest.high)
    for end, limit in ((smallest, "low"), (largest, "high")):
        without = [replace(e, **{limit: None}) if e is end else e for e in ends]  # type: ignore[arg-type]
        assert estimate_over_ends(without) == replace(combined, low=None, high=None)


def test_ends_on_two_sides_of_the_threshold_decide_nothing() -> None:
    above, below = at(0.2), at(-0.3)
    for ends in ((above, below), (below, above), (above, replace(below, value=0.0))):
        combined = estimate_over_ends(ends)
        assert (combined.p_value, combined.p_seen, combined.probability) == (1.0, 1.0, 0.5)
        assert combined.value == ends[0].value
    no_p = replace(below, p_value=None)
    assert estimate_over_ends([above, no_p]).p_value is None
    assert estimate_over_ends([above]) is above
    untestable = replace(above, flags=("cannot_fail",))
    assert untestable.untestable
    assert estimate_over_ends([untestable, below]) is untestable


def test_equivalence_holds_at_all_ends() -> None:
    tests = [spi.equivalence(P_O, [p + shift for p in P_O[1:] + P_O[:1]]) for shift in (0, -2)]
    combined = equivalence_over_ends(tests)
    for part in ("change", "above", "below"):
        ends = [getattr(test, part) for test in tests]
        assert getattr(combined, part) == estimate_over_ends(ends)


def test_samples_are_taken_at_every_choice_of_ends_the_largest_first() -> None:
    arms = [arm for _, _, arm in Study(seeds=2, sizes=[{"values": [2, 4, 8]}]).plan().cells]
    outcomes = [
        [delivered(5, least=1), delivered(7)],
        [delivered(3), delivered(4)],
        [delivered(8), delivered(9, least=6)],
    ]
    cells = {arm: Cell.of("", "", arm, runs) for arm, runs in zip(arms, outcomes)}

    def in_short(sample: dict[Arm, Numbers]) -> list[list[float]]:
        return [sample[arm].tolist() for arm in arms]

    assert [in_short(sample) for sample in samples_at_ends(cells, arms)] == [
        [[5, 7], [3, 4], [8, 9]],
        [[5, 7], [3, 4], [8, 6]],
        [[1, 7], [3, 4], [8, 9]],
        [[1, 7], [3, 4], [8, 6]],
    ]
