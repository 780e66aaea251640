from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError

ONSET, END = 1_000.0, 2_000.0
Runs = list[np.ndarray]


def regular(seeds: int = 4, every: float = 5.0) -> Runs:
    return [np.arange(seed / 7, END, every) for seed in range(seeds)]


def without(runs: Runs, start: float, stop: float) -> Runs:
    return [run[(run < start) | (run > stop)] for run in runs]


def noisy(rng: np.random.Generator, seeds: int, rate: float = 0.08) -> Runs:
    return [np.sort(rng.uniform(0, END, rng.poisson(rate * END))) for _ in range(seeds)]


def repair(faulty: Runs, reference: Runs, null: tuple[Runs, Runs], **more: Any) -> spi.SelfRepair:
    options = {"onset": ONSET, "end": END, "generator": np.random.default_rng(0), **more}
    return spi.self_repair(faulty, reference, null, **options)


QUIET = (regular(), regular())


def test_an_outage_is_repaired_when_the_trailing_window_is_full_again() -> None:
    # Nothing for 200 s after the onset, then as before: 90 of the window's 100 s must be new.
    result = repair(without(regular(), 1_000, 1_200), regular(), QUIET)
    assert result.seconds == pytest.approx(290, abs=6)
    assert (result.low, result.high) == pytest.approx((290, 290), abs=6)
    assert (result.null_seconds, result.null_limit) == (0.0, 0.0)
    assert result.distinguishable
    assert not result.censored
    longer = repair(without(regular(), 1_000, 1_200), regular(), QUIET, window=200.0)
    assert longer.seconds == pytest.approx(380, abs=6)


def test_no_dip_is_repaired_at_once_and_not_distinguishable() -> None:
    result = repair(regular(), regular(), QUIET)
    assert result.seconds == 0.0
    assert not result.distinguishable


def test_a_lasting_loss_is_censored() -> None:
    halved = [np.concatenate([run[run < ONSET], run[run >= ONSET][::2]]) for run in regular()]
    result = repair(halved, regular(), QUIET)
    assert result.seconds is None
    assert result.censored
    assert result.followed == 900.0
    assert (result.low, result.high) == (math.inf, math.inf)
    assert result.distinguishable


def test_a_loss_that_begins_late_counts() -> None:
    # The rate holds for 300 s after the onset, three windows long, then half of it is gone.
    late = [np.concatenate([run[run < 1_300], run[run >= 1_300][::2]]) for run in regular()]
    assert repair(late, regular(), QUIET).censored
    passing = without(regular(), 1_300, 1_500)
    assert repair(passing, regular(), QUIET).seconds == pytest.approx(590, abs=6)


def test_a_short_dip_long_before_the_end_does_not_outweigh_the_rest() -> None:
    # Behind for 30 s in mid-run, ahead at all other times: nothing is lost.
    ahead = [np.sort(np.concatenate([run, run[run > ONSET][::2] + 1.0])) for run in regular()]
    dip = [run[(run < 1_500) | (run > 1_530)] for run in ahead]
    assert repair([run[run <= END] for run in dip], regular(), QUIET).seconds == 0.0


def test_a_short_return_is_not_a_repair() -> None:
    twice = without(without(regular(), 1_000, 1_100), 1_250, 1_500)
    result = repair(twice, regular(), QUIET)
    assert result.seconds == pytest.approx(590, abs=6)


def test_deliveries_before_the_onset_matter_through_the_window_only() -> None:
    reference = regular()
    earlier = without(reference, 100, 800)
    assert repair(earlier, reference, QUIET).seconds == 0.0


def test_without_a_fault_the_statistic_is_noise_and_said_to_be() -> None:
    rng = np.random.default_rng(3)
    result = repair(noisy(rng, 6), noisy(rng, 6), (noisy(rng, 6), noisy(rng, 6)))
    assert result.null_limit > 100.0
    assert not result.distinguishable


def test_pooling_seeds_brings_the_null_down() -> None:
    rng = np.random.default_rng(3)
    limits = [
        repair(regular(n), regular(n), (noisy(rng, n), noisy(rng, n))).null_limit for n in (5, 80)
    ]
    assert limits[1] < limits[0]


def test_equal_generators_give_equal_results() -> None:
    rng = np.random.default_rng(5)
    reference, null = noisy(rng, 10), (noisy(rng, 10), noisy(rng, 10))
    faulty = without(reference, 1_000, 1_250)
    one, same, other = (
        repair(faulty, reference, null, generator=np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert one == same
    assert (one.low, one.high, one.null_limit) != (other.low, other.high, other.null_limit)
    assert one.seconds == other.seconds


def test_each_run_on_its_own_is_timed_or_censored() -> None:
    reference = regular(3)
    halved = np.concatenate([reference[2][reference[2] < ONSET], reference[2][400:][::2]])
    faulty = [*without(reference[:2], 1_000, 1_200), halved]
    faulty[0] = reference[0]
    seconds, back = spi.repair_times(faulty, reference, onset=ONSET, end=END)
    assert back.tolist() == [True, True, False]
    assert seconds == pytest.approx([0, 290, 900], abs=6)
    curve = spi.kaplan_meier(seconds, back)
    assert curve.share == pytest.approx([2 / 3, 1 / 3])
    with pytest.raises(IndicatorError, match="unequal seed sets"):
        spi.repair_times(faulty, reference[:2], onset=ONSET, end=END)


def test_faults_may_begin_with_the_run() -> None:
    reference = regular(2)
    seconds, back = spi.repair_times(
        without(reference, 0, 300), reference, onset=0.0, end=END, window=100.0
    )
    assert back.all()
    assert seconds == pytest.approx([390, 390], abs=6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"faulty": regular(3)}, "unequal seed sets"),
        ({"null": (regular(2), regular(3))}, "null_pair"),
        ({"faulty": []}, "faulty is empty"),
        ({"reference": [np.array([5.0])] * 4}, "reference: should deliver something"),
        ({"end": 1_100.0}, "should leave more than one window"),
        ({"end": math.inf}, "should leave more than one window"),
        ({"window": 0.0}, "window = 0"),
        ({"onset": -1.0}, "onset = -1"),
        ({"end": 1_500.0}, "should not be after end = 1500 s"),
        ({"level": 95}, "level = 95"),
    ],
)
def test_bad_input_is_named(changes: dict[str, Any], message: str) -> None:
    arguments: dict[str, Any] = {"faulty": regular(), "reference": regular(), "null": QUIET}
    with pytest.raises(IndicatorError, match=message):
        repair(**{**arguments, **changes})
