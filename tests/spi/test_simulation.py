"""Few real runs with many simulated ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi.ratio import paired_ratio
from swarm_logistics_env.spi.simulation import combined_ratio

RESAMPLES = 2_000
M_OVER_N = 0.25
Sample = tuple[np.ndarray, np.ndarray]


def worlds(rng: np.random.Generator, shape: tuple[int, int], alike: float) -> tuple[Sample, Sample]:
    """Numerators and denominators of R in reality and in a simulator that delivers more.

    Set-ups differ in how much they allow and in what a fault costs there; `alike` is the share of
    the latter that the simulator has right.
    """
    ease, cost = rng.gamma(16.0, 1 / 16.0, shape), rng.uniform(0.1, 0.9, shape)
    found = []
    for scale, right in ((1.0, 1.0), (1.4, alike)):
        p_o = rng.poisson(40 * scale * ease).astype(float)
        p_f = rng.poisson(40 * scale * ease * (1 - right * cost - (1 - right) * 0.3)).astype(float)
        found.append((p_f - p_o, p_o))
    return found[0], found[1]


TRUTH = M_OVER_N - 0.5


@pytest.mark.parametrize("alike", [0.0, 0.5, 1.0])
@pytest.mark.parametrize(("real_runs", "further"), [(10, 90), (20, 40)])
def test_the_combined_interval_holds_the_truth_in_95_of_100(
    alike: float, real_runs: int, further: int
) -> None:
    rng = np.random.default_rng([real_runs, round(2 * alike)])
    real, replayed = worlds(rng, (RESAMPLES, real_runs), alike)
    _, others = worlds(rng, (RESAMPLES, further), alike)
    test = combined_ratio(real, replayed, others, offset=M_OVER_N, threshold=TRUTH)
    assert 0.93 <= ((test.low <= TRUTH) & (test.high >= TRUTH)).mean() <= 0.97
    assert 0.03 <= (test.p_value < 0.05).mean() <= 0.07
    alone = paired_ratio(*real, offset=M_OVER_N, threshold=TRUTH)
    narrowing = np.median((test.high - test.low) / (alone.high - alone.low))
    # A simulator that has the costs right narrows; one that has nothing right hardly widens.
    assert narrowing < {1.0: 0.8, 0.5: 0.95, 0.0: 1.1}[alike]


P_O = np.array([40.0, 44, 37, 41, 36, 45, 39, 42, 38, 43])
COST = np.array([0.2, 0.5, 0.7, 0.3, 0.6, 0.4, 0.8, 0.1, 0.5, 0.3])
REAL = {"p_o": P_O, "p_f": (P_O * (1 - COST)).round()}
MODEL = spi.Simulation(
    {"p_o": P_O + 9, "p_f": (P_O + 9) * (1 - COST)},
    {"p_o": np.tile(P_O, 3) + 9, "p_f": (np.tile(P_O, 3) + 9) * (1 - np.repeat(COST, 3))},
)


def width(estimate: spi.Estimate) -> float:
    assert estimate.low is not None
    assert estimate.high is not None
    return estimate.high - estimate.low


def combined(
    real: dict[str, Any] = REAL, model: spi.Simulation = MODEL, **options: Any
) -> spi.Estimate:
    return spi.robustness(real["p_o"], real["p_f"], n=8, m=2, simulation=model, **options)


def test_verdict_and_interval_agree() -> None:
    estimate = combined()
    assert estimate.verdict == "refuted"
    assert estimate.high is not None
    assert estimate.high < 0
    for limit in (estimate.low, estimate.high):
        assert combined(threshold=limit).p_value == pytest.approx(0.05, rel=1e-6)
    assert {"with_simulation", "assumes_normal"} <= set(estimate.flags)
    assert estimate.degrees_of_freedom == 8
    alone = spi.robustness(REAL["p_o"], REAL["p_f"], n=8, m=2)
    assert width(estimate) < 0.6 * width(alone)


def test_a_simulator_that_is_the_same_everywhere_controls_nothing() -> None:
    flat = {"p_o": np.full(10, 50.0), "p_f": np.full(10, 30.0)}
    estimate = combined(model=spi.Simulation(flat, flat))
    alone = spi.robustness(REAL["p_o"], REAL["p_f"], n=8, m=2)
    assert estimate.value == pytest.approx(alone.value)
    assert 0.8 < width(estimate) / width(alone) < 1.2


def test_real_runs_without_spread_give_no_verdict() -> None:
    estimate = combined({"p_o": np.full(10, 40.0), "p_f": np.full(10, 20.0)})
    assert estimate.flags[:2] == ("with_simulation", "degenerate")
    assert estimate.verdict == "inconclusive"
    assert estimate.low is None


def cut(samples: Any, n: int) -> dict[str, Any]:
    return {name: values[:n] for name, values in samples.items()}


@pytest.mark.parametrize(
    ("real", "model", "options", "words"),
    [
        (cut(REAL, 9), MODEL, {}, "9 real runs: should be at least 10"),
        (REAL, MODEL._replace(replayed=cut(MODEL.replayed, 9)), {}, "9 replayed runs of 10 real"),
        (REAL, MODEL._replace(further=cut(MODEL.further, 1)), {}, "1 further simulated runs"),
        (REAL, MODEL._replace(further={"p_o": P_O}), {}, "further has p_o: should have p_f, p_o"),
        (REAL, MODEL._replace(replayed={**MODEL.replayed, "p_f": P_O[:9]}), {}, "unequal seed"),
        (REAL, MODEL, {"paired": False}, "simulation needs paired = True"),
        (
            REAL,
            spi.Simulation({"p_o": 0 * P_O, "p_f": P_O}, {"p_o": 0 * P_O, "p_f": P_O}),
            {},
            "the mean of the reference = 0",
        ),
    ],
)
def test_a_simulation_that_does_not_fit_is_refused(
    real: dict[str, Any], model: spi.Simulation, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(spi.IndicatorError, match=words):
        combined(real, model, **options)
