from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env.compiler.kernels import uniform
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.core.streams import generator, key, row_keys


def test_a_stream_is_the_same_whenever_it_is_asked_for_and_others_differ() -> None:
    first = generator(3, "places", 7).random(5)
    other_keys = (4, "places", 7), (3, "place", 7), (3, "places", 8), (3, "places"), (37, "places")
    for other_key in other_keys:
        assert first[0] != generator(*other_key).random()
    np.testing.assert_array_equal(first, generator(3, "places", 7).random(5))
    seeds = (0, 1, -1, 2**63, 2**64, 2**200)
    assert len({key(seed, "a") for seed in seeds}) == len(seeds)


def test_what_is_no_integer_is_no_seed() -> None:
    for seed in (1.0, "1", None):
        with pytest.raises(SetupError, match=f"seed = {seed!r}: should be an integer"):
            key(seed, "places")  # type: ignore[arg-type]


@given(st.integers(0, 2**63), st.integers(1, 50), st.integers(1, 50))
def test_a_rows_key_does_not_depend_on_how_many_rows_there_are(seed: int, n: int, m: int) -> None:
    shared = min(n, m)
    np.testing.assert_array_equal(row_keys(seed, "a", n)[:shared], row_keys(seed, "a", m)[:shared])
    assert len(set(row_keys(seed, "a", n))) == n


def test_numbers_of_a_kernel_stream_are_uniform_and_independent() -> None:
    keys = row_keys(0, "test", 200)
    numbers = np.array([[uniform(each, count) for count in range(200)] for each in keys])
    assert 0.0 <= numbers.min() < numbers.max() < 1.0
    n = numbers.size
    counts = np.histogram(numbers, 20, (0.0, 1.0))[0]
    assert ((counts - n / 20) ** 2 / (n / 20)).sum() < 50.0  # chi square, 19 degrees of freedom
    for part, shifted in ((numbers[:, :-1], numbers[:, 1:]), (numbers[:-1], numbers[1:])):
        assert abs(np.corrcoef(part.ravel(), shifted.ravel())[0, 1]) < 5 / np.sqrt(n)
