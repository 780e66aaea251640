"""Shapley values: fair shares that sum to the whole."""

import numpy as np
import pytest

from swarm_logistics_env.spi import IndicatorError
from swarm_logistics_env.spi.shapley import coalitions, shapley_values


def test_the_glove_game() -> None:
    # One left glove and two right ones; a pair is worth 1 (Shapley's own example).
    worth = {s: float("left" in s and len(s) > 1) for s in coalitions(["left", "r1", "r2"])}
    values = shapley_values(["left", "r1", "r2"], worth)
    assert values == pytest.approx({"left": 2 / 3, "r1": 1 / 6, "r2": 1 / 6})


def test_values_sum_to_the_whole_and_are_the_parts_where_parts_add_up() -> None:
    rng = np.random.default_rng(0)
    causes = [3, 1, 7, 9]
    loss = {coalition: float(rng.normal()) for coalition in coalitions(causes)}
    whole = loss[frozenset(causes)] - loss[frozenset()]
    assert sum(shapley_values(causes, loss).values()) == pytest.approx(whole)
    parts = {3: 2.0, 1: -1.0, 7: 0.0, 9: 5.0}
    added = {
        coalition: sum(parts[cause] for cause in coalition) for coalition in coalitions(causes)
    }
    assert shapley_values(causes, added) == pytest.approx(parts)


def test_a_missing_set_and_a_cause_named_twice_are_refused() -> None:
    with pytest.raises(IndicatorError, match=r"loss: should tell that of \['a'\]"):
        shapley_values(["a"], {frozenset(): 0.0})
    with pytest.raises(IndicatorError, match="name each cause once"):
        shapley_values(["a", "a"], {})
