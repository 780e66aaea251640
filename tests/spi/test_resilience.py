from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.spi import IndicatorError


def test_the_index_counts_deliveries_after_the_onset() -> None:
    faulty = [[50.0, 150, 200], [10.0, 100, 120, 130]]  # 2 and 2 after 100 s
    reference = [[50.0, 150, 200, 300, 310], [120.0, 130, 140]]  # 4 and 3
    index = spi.resilience_index(faulty, reference, onset=100.0)
    assert index.value == pytest.approx(4 / 7)
    assert (index.indicator, index.threshold, index.n_seeds) == ("resilience", 1.0, 2)


ONSET, END = 1_000.0, 2_000.0


def test_each_run_is_timed_or_censored() -> None:
    sound = np.arange(0.0, END, 5.0)
    gap = sound[(sound < 1_000) | (sound > 1_200)]
    halved = np.concatenate([sound[:200], sound[200:][::2]])
    seconds, back = spi.repair_times([sound, gap, halved], [sound] * 3, onset=ONSET, end=END)
    assert back.tolist() == [True, True, False]
    assert seconds == pytest.approx([0, 200, 900], abs=6)  # followed until the last window begins
    assert spi.kaplan_meier(seconds, back).share == pytest.approx([2 / 3, 1 / 3])


# 6-MP arm of Freireich et al. (1963), the textbook example; True: relapse seen
WEEKS = [6, 6, 6, 6, 7, 9, 10, 10, 11, 13, 16, 17, 19, 20, 22, 23, 25, 32, 32, 34, 35]
SEEN = [1, 1, 1, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0]


def test_textbook_curve() -> None:
    curve = spi.kaplan_meier(WEEKS, SEEN)
    assert curve.seconds.tolist() == [6, 7, 10, 13, 16, 22, 23]
    expected = [0.857, 0.807, 0.753, 0.690, 0.627, 0.538, 0.448]
    assert curve.share == pytest.approx(expected, abs=5e-4)
    # R survival, conf.type = "log-log"
    assert (curve.low[0], curve.high[0]) == pytest.approx((0.620, 0.952), abs=1e-3)
    assert (curve.low[-1], curve.high[-1]) == pytest.approx((0.188, 0.680), abs=1e-3)
    assert curve.median() == 23
    assert (spi.kaplan_meier(WEEKS, SEEN, confidence=0.99).low < curve.low).all()


def test_a_curve_without_censoring_and_one_without_events() -> None:
    curve = spi.kaplan_meier([3, 1, 2, 2], [True] * 4)
    assert curve.share == pytest.approx([0.75, 0.25, 0.0])
    assert (curve.low[-1], curve.high[-1], curve.median()) == (0.0, 1.0, 2)
    curve = spi.kaplan_meier([900.0, 900.0], [False, False])
    assert (curve.seconds.size, curve.median()) == (0, None)


@pytest.mark.parametrize(
    ("function", "change", "message"),
    [
        (spi.resilience_index, {"faulty": []}, "faulty is empty"),
        (spi.resilience_index, {"reference": []}, "reference is empty"),
        (spi.resilience_index, {"faulty": [[1.0]]}, "unequal seed sets"),
        (spi.resilience_index, {"faulty": [[-1.0], []]}, r"faulty\[0\]"),
        (spi.resilience_index, {"reference": [[], [float("nan")]]}, r"reference\[1\]"),
        (spi.resilience_index, {"reference": [[[1.0]], []]}, r"reference\[0\]"),
        (spi.resilience_index, {"faulty": [["late"]]}, r"= \['late'\]: should be an array of num"),
        (spi.resilience_index, {"reference": [[10.0], []]}, "mean of reference = 0"),
        (spi.resilience_index, {"onset": float("nan")}, "onset = nan"),
        (spi.repair_times, {"faulty": [[1.0]]}, "unequal seed sets"),
        (spi.repair_times, {"onset": END, "end": END}, "onset = 2000"),
        (spi.repair_times, {"end": END, "window": 1_001.0}, "window = 1001"),
        (spi.repair_times, {"end": END, "window": float("nan")}, "window = nan"),
        *(
            (spi.kaplan_meier, {"seconds": seconds, "happened": happened}, "seconds")
            for seconds, happened in (
                ([], []), ([1.0], [True, False]), ([-1.0], [True]), ([float("nan")], [True]),
                ([float("inf")], [False]), (["late"], [True]),
            )
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_named(function: Any, change: dict[str, Any], message: str) -> None:
    usual: dict[str, Any] = {"faulty": [[1.0], [2.0]], "reference": [[1.0], [2.0]], "onset": ONSET}
    if function is spi.repair_times:
        usual["end"] = END
    with pytest.raises(IndicatorError, match=message):
        function(**({} if function is spi.kaplan_meier else usual) | change)
