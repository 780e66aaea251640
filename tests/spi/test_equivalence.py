"""Equivalence: errors at the edge of the margin, power at the planned n, and what it refuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from verification.generators import MODELS
from verification.verdict_errors import share_equivalent


def poisson(seed: int, change: float, n: int = 80) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.poisson(39.0, n) * 1.0, rng.poisson(39.0 * (1 + change), n) * 1.0


# `python -m verification.verdict_errors` simulates 2,000 studies of each.
@pytest.mark.parametrize(("model", "change"), [("poisson", -0.1), ("overdispersed", 0.1)])
def test_at_the_edge_of_the_margin_at_most_5_percent_are_wrong(model: str, change: float) -> None:
    assert 0.02 < share_equivalent(model, 30, change, 1_500, only_seen=True) <= 0.055
    assert share_equivalent(model, 30, change, 1_500) <= 0.055


def test_the_planned_seeds_have_the_promised_power() -> None:
    draw, mean_o, _ = MODELS["overdispersed"]
    pilot = spi.equivalence(*draw(np.random.default_rng(0), (1_000,), mean_o))
    n = spi.seeds_for_equivalence(pilot) or 0
    assert 30 <= n <= 60
    assert 0.74 <= share_equivalent("overdispersed", n, 0.0, 400) <= 0.9


def test_it_is_the_two_tests_of_the_indicators() -> None:
    # Of so many seeds no share of hidden stalls matters, so that verdict and interval agree.
    p_o, p_f = poisson(3, -0.02, 400)
    equivalence: Any = spi.equivalence(p_o, p_f)
    for test, edge in ((equivalence.above, -0.1), (equivalence.below, 0.1)):
        assert test == spi.relative_change(p_o, p_f, threshold=edge, confidence=0.9)
    assert equivalence.p_value == max(
        1 - equivalence.above.probability, equivalence.below.probability
    )
    assert equivalence.verdict == "equivalent"
    assert -0.1 < equivalence.change.low < equivalence.change.high < 0.1


# Where P is capped: of equal P either may truly be larger, so that the change may lie beyond the
# margin. P_new that truly is larger still would only lie further above it.
@pytest.mark.parametrize(
    ("change", "options", "verdict"),
    [
        (0.0, {}, "equivalent"),
        (0.0, {"paired": False}, "equivalent"),
        (-0.3, {}, "refuted"),
        (0.3, {"paired": False}, "refuted"),
        (0.0, {"saturated": ["p_o"]}, "open"),
        (0.0, {"saturated": ["p_new"]}, "open"),
        (0.5, {"saturated": ["p_new"]}, "refuted"),
        (0.5, {"saturated": ["p_o"]}, "open"),
    ],
)
def test_clear_changes_have_their_verdict_unless_a_cap_could_turn_it(
    change: float, options: dict[str, Any], verdict: str
) -> None:
    equivalence = spi.equivalence(*poisson(1, change), **options)
    assert (equivalence.verdict, "capped" in equivalence.flags) == (verdict, verdict == "open")


def test_a_p_counts_below_alpha_and_that_of_a_clear_change_is_of_the_nearer_end() -> None:
    unchanged, more, less = (spi.equivalence(*poisson(1, change)) for change in (0.0, 0.3, -0.3))
    assert [unchanged.verdict_for(p) for p in (None, 0.05, 0.0499)] == [
        "open",
        "open",
        "equivalent",
    ]
    assert [more.verdict_for(p) for p in (None, 0.05, 0.0499)] == ["open", "open", "refuted"]
    assert (more.p_value, less.p_value) == (more.below.p_value, less.above.p_value)
    assert unchanged.confidence == pytest.approx(0.9)


def test_fault_tolerance_compares_with_the_robots_removed() -> None:
    (p_o, p_f), (_, p_s) = poisson(4, -0.5), poisson(5, -0.5)
    equivalence = spi.equivalence(p_o, p_f, p_s)
    assert (equivalence.verdict, spi.equivalence(p_o, p_f).verdict) == ("equivalent", "refuted")
    assert equivalence.change.value == pytest.approx(spi.fault_tolerance(p_o, p_f, p_s).value)


def test_equal_runs_are_equivalent_exactly_and_equal_counts_or_one_seed_are_not() -> None:
    p = [30.0, 41.0, 36.0]
    exact, by_chance = spi.equivalence(p, p, identical=True), spi.equivalence(p, p)
    assert (exact.verdict, exact.p_value) == ("equivalent", None)
    assert by_chance.verdict == "open"
    assert "degenerate" in by_chance.flags
    of_one_seed = spi.equivalence([39], [38])
    assert (of_one_seed.p_value, of_one_seed.verdict) == (None, "open")
    assert spi.seeds_for_equivalence(of_one_seed) is None


@pytest.mark.parametrize("field", [{"margin": 0.0}, {"margin": 1.0}, {"alpha": 0.5}])
def test_margin_or_alpha_out_of_range(field: dict[str, Any]) -> None:
    with pytest.raises(spi.IndicatorError, match=next(iter(field))):
        spi.equivalence([39, 40], [38, 41], **field)
