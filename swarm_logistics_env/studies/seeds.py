"""Seeds in words."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise


def seeds_in_words(seeds: Sequence[int]) -> str:
    """Return ascending seeds as ranges, e.g. "0 to 3, 8"; at least one."""
    breaks = [place for place, (a, b) in enumerate(pairwise(seeds), start=1) if b != a + 1]
    parts = [seeds[a:b] for a, b in pairwise([0, *breaks, len(seeds)])]
    return ", ".join(f"{p[0]}" if len(p) == 1 else f"{p[0]} to {p[-1]}" for p in parts)
