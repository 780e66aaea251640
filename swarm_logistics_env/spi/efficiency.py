"""What single robots are worth: efficiency, marginal gain and the Karp-Flatt serial fraction."""

from __future__ import annotations

from .inputs import IndicatorError, finite


def per_robot_efficiency(p: float, n: float) -> float:
    """P/N: deliveries per robot [items].

    Raises:
        IndicatorError: n not positive, p negative, or not finite.
    """
    _check(p=p, n=n)
    return p / n


def marginal_gain(p_1: float, p_2: float, *, n_1: float, n_2: float) -> float:
    """P(N2) - (N2/N1) P(N1) [items], N2 > N1: positive exactly where S > 1.

    Raises:
        IndicatorError: Sizes not positive or not n_2 > n_1, performance negative or not finite.
    """
    _check_growth(p_1, p_2, n_1, n_2)
    return p_2 - n_2 * p_1 / n_1


def karp_flatt(p_1: float, p_2: float, *, n_1: float, n_2: float) -> float:
    """Serial fraction e = (1/X - 1/n) / (1 - 1/n), X = P(N2)/P(N1), n = N2/N1 (Karp, Flatt 1990).

    0 where performance grows as the swarm does, 1 where it does not grow, negative where it grows
    faster.

    Raises:
        IndicatorError: Sizes not positive or not n_2 > n_1, performance not positive or not finite.
    """
    _check_growth(p_1, p_2, n_1, n_2)
    for name, value in (("p_1", p_1), ("p_2", p_2)):
        if value == 0:
            raise IndicatorError(f"{name} = 0: the speed-up P(N2)/P(N1) should be finite, above 0")
    growth, speed_up = n_2 / n_1, p_2 / p_1
    return (1.0 / speed_up - 1.0 / growth) / (1.0 - 1.0 / growth)


def _check_growth(p_1: float, p_2: float, n_1: float, n_2: float) -> None:
    _check(p_1=p_1, n_1=n_1)
    _check(p_2=p_2, n_2=n_2)
    if n_2 <= n_1:
        raise IndicatorError(f"n_2 = {n_2}: should be larger than n_1 = {n_1}")


def _check(**fields: float) -> None:
    for name, value in fields.items():
        finite(name, value)
        if value < 0 or (name.startswith("n") and value == 0):
            raise IndicatorError(f"{name} = {value:g}: should be positive")
