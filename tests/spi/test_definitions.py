"""What the table says of each indicator, and the sizes that indicators take."""

from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi.definitions import DEFINITIONS, comparing

P = [30.0, 40.0, 35.0, 38.0]


@pytest.mark.parametrize(
    ("symbol", "factor", "references", "names", "unchanged"),
    [
        ("S", "size", ("P_N",), ("scalable", "superlinear", "S > -0.333"), None),
        (
            "FT", "fault", ("P_o", "P_S"), ("tolerant", "FT > 1", "FT > -0.333"),
            "P_F and P_S differ by less than 12.5 % of P_o",
        ),
        ("R", "fault", ("P_o",), ("robust", "R > 1", "R > -0.333"), "P_F within 12.5 % of P_o"),
        (
            "A", "parameter", ("P_o",), ("adaptable", "P has grown", "A > -0.333"),
            "P_new within 12.5 % of P_o",
        ),
        (
            "change", "policy", ("P_o",), ("change > 0", "change > 1", "change > -0.333"),
            "P_new within 12.5 % of P_o",
        ),
    ],
)  # fmt: skip
def test_an_indicator_says_what_a_verdict_is_about(
    symbol: str, factor: Any, references: Any, names: Any, unchanged: str | None
) -> None:
    row = DEFINITIONS[symbol]
    assert row in comparing(factor)
    assert (row.compares, row.references, row.needs_removed) == (
        factor, references, len(references) > 1
    )  # fmt: skip
    thresholds = (0.0, 1.0, -1 / 3)
    assert tuple(row.property_name(threshold) for threshold in thresholds) == names
    below = [row.property_name(threshold, claimed_below=True) for threshold in thresholds[::2]]
    if symbol == "change":
        assert below == ["P falls", "P falls by more than 33 %"]
    else:
        assert below == [names[0], names[2]]
    assert row.unchanged(0.125) == unchanged


def test_the_indicators_of_a_factor_come_in_the_order_of_the_table() -> None:
    assert [row.symbol for row in comparing("fault")] == ["FT", "R"]
    assert [row.symbol for row in comparing("policy")] == ["change"]


def test_sizes_may_be_as_large_as_an_indicator_is_defined_for() -> None:
    assert spi.robustness(P, P, n=25, m=25).value == 1.0
    assert spi.robustness(P, P, n=1, m=1).value == 1.0
    assert spi.scalability(P, P, n=1, m=9).value == 0.0
    assert spi.fault_tolerance(P, P, P, n=2, m=1).value == 0.0
    for sizes in ({"n": 25}, {"m": 2}):
        with pytest.raises(spi.IndicatorError, match="should be given together or not at all"):
            spi.fault_tolerance(P, P, P, **sizes)  # type: ignore[arg-type]
    for n, m, message in ((0, 1, "n = 0: should be at least 1"), (3, 0, "m = 0: should be at l")):
        with pytest.raises(spi.IndicatorError, match=message):
            spi.scalability(P, P, n=n, m=m)


@pytest.mark.parametrize(
    ("estimate", "text"),
    [
        (spi.robustness([40.0], [36.0], n=25, m=3), "R = 0.020; above 0: open (1 paired seed)"),
        (
            spi.robustness([40.0], [36.0], n=25, m=3, paired=False),
            "R = 0.020; above 0: open (1 run a condition)",
        ),
        (
            spi.robustness(P, P, n=25, m=3, identical=True),
            "R = 0.120; above 0: unaffected (4 paired seeds)",
        ),
        (
            spi.adaptability(P, P, x_o=1.0, x_new=2.0),
            "A = 1.000; above 0: untestable (4 paired seeds)",
        ),
        (
            spi.relative_change([40.0, 44, 36, 41], [18.0, 22, 25, 20], threshold=-1 / 3),
            "change = -0.472 [-0.617, -0.274]; above -0.333333: open (4 paired seeds, p = 0.104)",
        ),
    ],
)
def test_an_estimate_is_told_in_a_line(estimate: spi.Estimate, text: str) -> None:
    assert str(estimate) == text
