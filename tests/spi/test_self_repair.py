from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError

# The package's function hides its module.
module = sys.modules["swarm_logistics_env.spi.self_repair"]

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


NULL = (regular(8), regular(8))
BIN = 2.5  # s: 1,000 s in 400 bins


def test_an_outage_lasts_until_its_end_and_not_a_window_longer() -> None:
    result = repair(without(regular(8), 1_000, 1_200), regular(8), NULL)
    assert result.seconds == pytest.approx(200, abs=2 * BIN)
    assert result.low <= 200 <= result.high
    assert result.high - result.low < 8 * BIN
    assert result.p_value < 0.01
    assert result.distinguishable
    assert not result.censored
    assert result.followed == 1_000.0


def test_no_loss_takes_no_time_and_is_not_distinguishable() -> None:
    result = repair(regular(8), regular(8), NULL)
    assert result.seconds == 0.0
    assert result.null_seconds == 0.0
    assert not result.distinguishable
    assert result.p_value == 1.0


def test_a_lasting_loss_is_censored() -> None:
    halved = [np.concatenate([run[run < ONSET], run[run >= ONSET][::2]]) for run in regular(8)]
    result = repair(halved, regular(8), NULL)
    assert result.seconds is None
    assert result.censored
    assert result.high == math.inf
    assert result.low > 900.0
    assert result.distinguishable


def test_a_short_return_is_not_a_repair() -> None:
    twice = without(without(regular(8), 1_000, 1_100), 1_150, 1_500)
    assert repair(twice, regular(8), NULL).seconds == pytest.approx(500, abs=2 * BIN)


def test_deliveries_before_the_onset_do_not_matter() -> None:
    earlier = without(regular(8), 100, 1_000)
    assert repair(earlier, regular(8), NULL).seconds == 0.0


def test_what_scatters_more_than_poisson_counts_has_a_wider_interval() -> None:
    rng = np.random.default_rng(5)
    reference = noisy(rng, 10)
    faulty = [np.sort(rng.choice(run, run.size, replace=False)) for run in reference]
    faulty = without(faulty, 1_000, 1_250)
    calm = repair(faulty, reference, (noisy(rng, 10), noisy(rng, 10)))
    # Deliveries in bursts of eight: an eighth of the information.
    bursts = tuple([np.repeat(run[::8], 8) for run in noisy(rng, 10)] for _ in range(2))
    wild = repair(faulty, reference, (bursts[0], bursts[1]))
    assert wild.high - wild.low > calm.high - calm.low
    assert wild.seconds == calm.seconds


def test_few_seeds_cannot_tell() -> None:
    # Four pairs can be swapped in 16 ways: p is 1/16 at the least.
    result = repair(without(regular(4), 1_000, 1_500), regular(4), (regular(4), regular(4)))
    assert result.p_value == pytest.approx(1 / 16, abs=0.02)
    assert not result.distinguishable


def test_equal_generators_give_equal_results() -> None:
    rng = np.random.default_rng(5)
    reference, null = noisy(rng, 10), (noisy(rng, 10), noisy(rng, 10))
    faulty = [
        run[(run < 1_000) | (run > 1_250) | (rng.random(run.size) < 0.6)] for run in reference
    ]
    one, same, other = (
        repair(faulty, reference, null, generator=np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert one == same
    assert (one.low, one.high) != (other.low, other.high)
    assert one.seconds == other.seconds


@pytest.mark.parametrize("n_seeds", [10, 20])
@pytest.mark.parametrize("outage", [100.0, 200.0, 500.0])
def test_the_interval_holds_the_true_time_of_a_full_outage(n_seeds: int, outage: float) -> None:
    rng = np.random.default_rng(n_seeds)
    studies, held = 40, 0
    for _ in range(studies):
        faulty = without(noisy(rng, n_seeds), ONSET, ONSET + outage)
        null = noisy(rng, n_seeds), noisy(rng, n_seeds)
        result = repair(faulty, noisy(rng, n_seeds), null, generator=rng)
        held += result.low <= outage <= result.high
        assert result.distinguishable
    assert held / studies >= 0.9


def distinguished(loss: float, n_seeds: int, studies: int, seed: int) -> float:
    """Share of studies in which a loss over the first 100 s is told from none."""
    rng = np.random.default_rng(seed)
    found = 0
    for _ in range(studies):
        faulty = [
            run[(run < ONSET) | (run > ONSET + 100) | (rng.random(run.size) >= loss)]
            for run in noisy(rng, n_seeds)
        ]
        null = noisy(rng, n_seeds), noisy(rng, n_seeds)
        found += repair(faulty, noisy(rng, n_seeds), null, generator=rng).distinguishable
    return found / studies


def test_false_alarms_and_small_losses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SIMULATIONS", 20)  # the interval is not looked at
    monkeypatch.setattr(module, "SWAPS", 199)
    assert distinguished(0.0, 10, studies=500, seed=1) <= 0.06
    # A fifth less over 100 s is 1.7 standard deviations at 20 seeds: mostly not to be told.
    assert distinguished(0.2, 20, studies=60, seed=2) < 0.5


def test_each_run_on_its_own_is_timed_or_censored() -> None:
    reference = regular(3)
    halved = np.concatenate([reference[2][reference[2] < ONSET], reference[2][400:][::2]])
    faulty = [*without(reference[:2], 1_000, 1_200), halved]
    faulty[0] = reference[0]
    seconds, back = spi.repair_times(faulty, reference, onset=ONSET, end=END)
    assert back.tolist() == [True, True, False]
    assert seconds == pytest.approx([0, 200, 1_000], abs=2 * BIN)
    curve = spi.kaplan_meier(seconds, back)
    assert curve.share == pytest.approx([2 / 3, 1 / 3])
    with pytest.raises(IndicatorError, match="unequal seed sets"):
        spi.repair_times(faulty, reference[:2], onset=ONSET, end=END)


def test_faults_may_begin_with_the_run() -> None:
    reference = regular(2)
    seconds, back = spi.repair_times(without(reference, 0, 300), reference, onset=0.0, end=END)
    assert back.all()
    assert seconds == pytest.approx([300, 300], abs=10)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"faulty": regular(3)}, "unequal seed sets"),
        ({"null": (regular(2), regular(3))}, "null_pair"),
        ({"faulty": []}, "faulty is empty"),
        ({"reference": [np.array([5.0])] * 4}, "reference: should deliver something"),
        ({"end": 1_000.0}, "should be 0 <= onset < end"),
        ({"end": math.inf}, "should be 0 <= onset < end"),
        ({"onset": -1.0}, "onset = -1"),
        ({"end": 1_500.0}, "should not be after end = 1500 s"),
        ({"confidence": 95}, "confidence = 95"),
    ],
)
def test_bad_input_is_named(changes: dict[str, Any], message: str) -> None:
    quiet = regular(), regular()
    arguments: dict[str, Any] = {"faulty": regular(), "reference": regular(), "null": quiet}
    with pytest.raises(IndicatorError, match=message):
        repair(**{**arguments, **changes})
