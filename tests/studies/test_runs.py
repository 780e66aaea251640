from __future__ import annotations

from collections.abc import Sequence

import pytest

from swarm_logistics_env.studies.runs import seeds_in_words


@pytest.mark.parametrize(
    ("seeds", "words"),
    [
        (range(20), "0 to 19"),
        (range(1000, 1001), "1000"),
        ([0, 1, 2, 3, 8], "0 to 3, 8"),
        ((1, 3, 4, 9), "1, 3 to 4, 9"),
    ],
)
def test_seeds_are_told_as_ranges(seeds: Sequence[int], words: str) -> None:
    assert seeds_in_words(seeds) == words
