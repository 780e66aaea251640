"""What is not shared of a swarm's work: the Karp-Flatt serial fraction."""

from __future__ import annotations

from .inputs import IndicatorError, finite


def karp_flatt(p_1: float, p_2: float, *, n_1: float, n_2: float) -> float:
    """Serial fraction e = (1/X - 1/n) / (1 - 1/n), X = P(N2)/P(N1), n = N2/N1 (Karp, Flatt 1990).

    0 where performance grows as the swarm does, 1 where it does not grow, negative where it grows
    faster.

    Raises:
        IndicatorError: Sizes not positive or not n_2 > n_1, performance not positive or not finite.
    """
    for name, value in (("p_1", p_1), ("n_1", n_1), ("p_2", p_2), ("n_2", n_2)):
        if finite(name, value) <= 0:
            raise IndicatorError(f"{name} = {value:g}: should be positive")
    if n_2 <= n_1:
        raise IndicatorError(f"n_2 = {n_2}: should be larger than n_1 = {n_1}")
    growth, speed_up = n_2 / n_1, p_2 / p_1
    return (1.0 / speed_up - 1.0 / growth) / (1.0 - 1.0 / growth)
