"""Shapley values: what each of several causes contributes to a loss."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from math import factorial
from typing import TypeVar

from .inputs import IndicatorError

Cause = TypeVar("Cause", int, str)


def coalitions(causes: Sequence[Cause]) -> Iterator[frozenset[Cause]]:
    """Yield every set of the causes, the empty one first: 2^k of k causes."""
    for size in range(len(causes) + 1):
        yield from map(frozenset, combinations(causes, size))


def shapley_values(
    causes: Sequence[Cause], loss: Mapping[frozenset[Cause], float]
) -> dict[Cause, float]:
    """Return what each cause contributes to the loss with all of them (Shapley 1953).

    A cause's value is what it adds to the loss of the causes before it, averaged over all orders in
    which the causes may come. The values sum to the loss with all causes less that with none.

    Args:
        causes: Their names, each once.
        loss: The loss with each set of causes, all 2^k of them, in any unit.

    Raises:
        IndicatorError: A cause is named twice, or the loss of a set is missing.
    """
    if len(set(causes)) < len(causes):
        raise IndicatorError(f"causes = {list(causes)}: should name each cause once")
    for coalition in coalitions(causes):
        if coalition not in loss:
            raise IndicatorError(f"loss: should tell that of {sorted(map(str, coalition))}, too")
    count = len(causes)
    values: dict[Cause, float] = {}
    for cause in causes:
        others = [each for each in causes if each != cause]
        values[cause] = sum(
            (loss[before | {cause}] - loss[before])
            * factorial(len(before))
            * factorial(count - 1 - len(before))
            / factorial(count)
            for before in coalitions(others)
        )
    return values
