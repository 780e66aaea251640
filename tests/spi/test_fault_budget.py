from __future__ import annotations

import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError

P_O = [40.0, 38, 41, 39, 42]
ROBUST = spi.robustness(P_O, [40.0, 39, 41, 38, 42], n=25, m=2)
BROKEN = spi.robustness(P_O, [12.0, 15, 10, 11, 14], n=25, m=2)
SAME = spi.robustness(P_O, P_O, n=25, m=1, identical=True)
UNCLEAR = spi.robustness(P_O, [45.0, 20, 38, 50, 30], n=25, m=2)


@pytest.mark.parametrize(
    ("by_m", "robots", "limit"),
    [
        ({1: ROBUST, 2: ROBUST, 3: BROKEN}, 2, 3),
        ({1: ROBUST, 2: BROKEN, 3: ROBUST}, 1, 2),  # supported again at 3 does not count
        ({1: UNCLEAR, 2: ROBUST}, 0, 1),  # nor does a verdict that is only not refuted
        ({3: ROBUST, 1: ROBUST, 2: ROBUST}, 3, None),  # all supported: a lower bound
        ({1: ROBUST, 3: ROBUST}, 1, 2),  # untested in between
        ({2: ROBUST}, 0, 1),
        ({1: SAME, 2: ROBUST, 3: BROKEN}, 2, 3),  # the same runs: exactly within it
    ],
)
def test_the_first_unsupported_number_ends_the_budget(
    by_m: dict[int, spi.Estimate], robots: int, limit: int | None
) -> None:
    assert (ROBUST.verdict, BROKEN.verdict, UNCLEAR.verdict) == (
        "supported", "refuted", "inconclusive",
    )  # fmt: skip
    assert spi.fault_budget(by_m) == (robots, limit)


def test_bad_input_is_named() -> None:
    change = spi.relative_change(P_O, P_O)
    for by_m, words in (
        ({}, "is empty"), ({0: ROBUST}, "m = 0"), ({1: change}, "indicator at m = 1 is change")
    ):  # fmt: skip
        with pytest.raises(IndicatorError, match=words):
            spi.fault_budget(by_m)
