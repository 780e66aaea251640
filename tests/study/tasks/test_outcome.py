"""What a run gave, as stores and files can hold it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env.study.tasks.outcome import Outcome
from tests.made_up import delivered


@pytest.mark.parametrize(
    ("length", "kept_length"), [(19_999, 19_999), (20_000, 20_000), (99_999, 20_006)]
)
def test_of_an_endless_error_beginning_and_end_are_kept(length: int, kept_length: int) -> None:
    error = "begins" + "." * (length - 10) + "ends"
    text = str(delivered(0, error=error).error)
    assert (len(text), text[:6], text[-4:]) == (kept_length, "begins", "ends")
    assert (text == error) == (" [..] " not in text)


@pytest.mark.parametrize(
    ("times", "standstill", "stands_still"),
    [
        ([], 100.0, True),
        ([20.0, 80.0], 60.0, True),
        ([20.0, 80.5], 60.5, False),
        ([45.0, 46.0, 90.0], 45.0, False),
        ([10.0, 20.0], 80.0, True),
    ],
)
def test_a_swarm_stands_still_that_delivers_nothing_in_the_last_fifth_of_a_run(
    times: list[float], standstill: float, stands_still: bool
) -> None:
    run = Outcome(delivery_times=np.array(times), ended_at=100.0)
    assert (run.delivered, run.longest_standstill) == (len(times), standstill)
    assert run.stands_still == stands_still
    done = Outcome(delivery_times=np.array(times), ended_at=100.0, all_delivered=True)
    assert not done.stands_still
    assert (run.time_to_clear, done.time_to_clear) == (math.inf, 100.0)


def test_p_without_times_tells_of_no_standstill() -> None:
    measured = Outcome(untimed=2.5, ended_at=100.0)
    assert (measured.delivered, measured.longest_standstill, measured.stands_still) == (
        2.5, None, None,
    )  # fmt: skip
    # A rate has the times of its deliveries.
    rate = Outcome(untimed=2.5, delivery_times=np.array([40.0, 90.0]), ended_at=100.0)
    assert (rate.delivered, rate.longest_standstill, rate.stands_still) == (2.5, 50.0, False)


def test_p_is_capped_where_nothing_was_left_to_deliver() -> None:
    assert not Outcome().capped
    assert not Outcome(all_served=False).capped
    assert Outcome(all_served=True).capped
    assert Outcome(all_delivered=True).capped
    assert not Outcome(all_delivered=True, untimed=3.0).capped  # a rate
