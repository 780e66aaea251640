"""The four Swarm Performance Indicators, the relative change, and the fault budget."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, SupportsIndex, Unpack

from numpy.typing import ArrayLike

from .estimate import Estimate, Options, judge
from .inputs import IndicatorError, count, finite


def scalability(
    p_n: ArrayLike,
    p_nm: ArrayLike,
    *,
    n: SupportsIndex,
    m: SupportsIndex,
    **options: Unpack[Options],
) -> Estimate:
    """Scalability S = ((P_{N+m} - P_N) / P_N) / (m/N), from N to N + m robots (paper, eq. S).

    S > 0 is scalable, S > 1 (`threshold=1`) superlinearly scalable.

    Args:
        p_n: Performance P_N over seeds [items], shape (n_seeds,).
        p_nm: Performance P_{N+m} over the same seeds [items].
        n: Swarm size N, at least 1.
        m: Robots added, at least 1; may exceed N.
        options: Threshold, confidence, pairing and the like: see `Options`.

    Raises:
        IndicatorError: Input from which S is undefined: n or m below 1, performance empty, negative
            or not finite, mean P_N = 0, unequal seed sets where paired.
    """
    gain = count("n", n) / count("m", m)
    return judge(
        "S",
        {"p_nm": (p_nm, gain, 0.0), "p_n": (p_n, -gain, 1.0)},
        offset=0.0,
        **options,
    )


def fault_tolerance(
    p_o: ArrayLike,
    p_f: ArrayLike,
    p_s: ArrayLike,
    *,
    n: SupportsIndex | None = None,
    m: SupportsIndex | None = None,
    **options: Unpack[Options],
) -> Estimate:
    """Fault tolerance FT = (P_F - P_S) / P_o: m faulty robots against m removed (paper, eq. FT).

    FT > 0 is fault tolerant; FT = 0 is not.

    Args:
        p_o: Performance P_o without faults over seeds [items], shape (n_seeds,).
        p_f: Performance P_F with m faulty robots [items].
        p_s: Performance P_S with the same m robots removed [items].
        n: Swarm size N; FT does not depend on it, given together with m it is checked.
        m: Faulty robots, 1 <= m < N: some robot has to be left in P_S.
        options: Threshold, confidence, pairing and the like: see `Options`.

    Raises:
        IndicatorError: Input from which FT is undefined: only one of n and m, m < 1, m >= N,
            performance empty, negative or not finite, mean P_o = 0, unequal seed sets where paired.
    """
    if (n is None) != (m is None):
        raise IndicatorError(f"n = {n!r}, m = {m!r}: should be given together or not at all")
    if n is not None and m is not None and count("m", m) >= count("n", n):
        raise IndicatorError(f"m = {m} of n = {n} robots: should leave a robot for P_S (m < n)")
    return judge(
        "FT",
        {"p_f": (p_f, 1.0, 0.0), "p_s": (p_s, -1.0, 0.0), "p_o": (p_o, 0.0, 1.0)},
        offset=0.0,
        **options,
    )


def robustness(
    p_o: ArrayLike,
    p_f: ArrayLike,
    *,
    n: SupportsIndex,
    m: SupportsIndex,
    **options: Unpack[Options],
) -> Estimate:
    """Robustness R = (P_F - P_o) / P_o + m/N (paper, eq. R).

    R > 0 is robust: m faulty robots cost less than their own share of the performance.

    Args:
        p_o: Performance P_o without faults over seeds [items], shape (n_seeds,).
        p_f: Performance P_F with m faulty robots [items].
        n: Swarm size N, at least 1.
        m: Faulty robots, 1 <= m <= N.
        options: Threshold, confidence, pairing and the like: see `Options`.

    Raises:
        IndicatorError: Input from which R is undefined: m < 1, m > N, performance empty, negative
            or not finite, mean P_o = 0, unequal seed sets where paired.
    """
    robots, faulty = count("n", n), count("m", m)
    if faulty > robots:
        raise IndicatorError(f"m = {faulty}: should be at most n = {robots} robots")
    return judge(
        "R",
        {
            "p_f": (p_f, 1.0, 0.0),
            "p_o": (p_o, -1.0, 1.0),
        },
        offset=faulty / robots,
        **options,
    )


def adaptability(
    p_o: ArrayLike, p_new: ArrayLike, *, x_o: float, x_new: float, **options: Unpack[Options]
) -> Estimate:
    """Adaptability A = ((P_new - P_o) / P_o) / |(x_new - x_o) / x_o| + 1 (paper, eq. A).

    A > 0 is adaptable: performance falls by less than x changes. A > 1 (`threshold=1`) gains.

    Args:
        p_o: Performance P_o at x_o over seeds [items], shape (n_seeds,).
        p_new: Performance P_new at x_new over the same seeds [items].
        x_o: Original value of the parameter, not 0, in any unit.
        x_new: New value, not equal to x_o, in the same unit.
        options: Threshold, confidence, pairing and the like: see `Options`.

    Raises:
        IndicatorError: Input from which A is undefined: x_o = 0, x_new = x_o, performance empty,
            negative or not finite, mean P_o = 0, unequal seed sets where paired.
    """
    if finite("x_o", x_o) == 0:
        raise IndicatorError("x_o = 0: a change relative to 0 is undefined")
    if finite("x_new", x_new) == x_o:
        raise IndicatorError(f"x_new = {x_new:g} = x_o: should differ from x_o")
    gain = 1.0 / abs((x_new - x_o) / x_o)
    return judge(
        "A",
        {"p_new": (p_new, gain, 0.0), "p_o": (p_o, -gain, 1.0)},
        offset=1.0,
        **options,
    )


def relative_change(p_o: ArrayLike, p_new: ArrayLike, **options: Unpack[Options]) -> Estimate:
    """Relative change (P_new - P_o) / P_o, for ablations and regressions (paper, eq. SdP).

    "P falls by at least a third" is the change against `threshold=-1/3`, refuted.

    Args:
        p_o: Performance P_o of the reference over seeds [items], shape (n_seeds,).
        p_new: Performance P_new over the same seeds [items].
        options: Threshold, confidence, pairing and the like: see `Options`.

    Raises:
        IndicatorError: Performance empty, negative or not finite, mean P_o = 0, unequal seed sets
            where paired.
    """
    return judge(
        "change",
        {"p_new": (p_new, 1.0, 0.0), "p_o": (p_o, -1.0, 1.0)},
        offset=0.0,
        **options,
    )


class FaultBudget(NamedTuple):
    """Robots that may fail by one mode, and the m that ended the search.

    `limit` is None where every m tested was supported: the budget is then a lower bound.
    """

    robots: int
    limit: int | None


def fault_budget(robustness_by_m: Mapping[int, Estimate]) -> FaultBudget:
    """Largest m with R > 0 supported at every m' <= m, for one failure mode.

    Tested in the order m = 1, 2, 3, ... and stopped at the first that is not supported, or not
    there: a fixed sequence, so the unadjusted verdicts keep the family's error. A swarm that a
    fault does not reach (identical runs) is robust to it exactly: R = m/N.

    Args:
        robustness_by_m: Number of faulty robots m to its estimate of R.

    Raises:
        IndicatorError: No estimates, m below 1, or an estimate of another indicator.
    """
    if not robustness_by_m:
        raise IndicatorError("robustness_by_m is empty: should hold R at m = 1 at least")
    for m, estimate in robustness_by_m.items():
        if m < 1:
            raise IndicatorError(f"m = {m}: should be at least 1")
        if estimate.indicator != "R":
            raise IndicatorError(f"indicator at m = {m} is {estimate.indicator}: should be R")
    robots = 0
    while robots + 1 in robustness_by_m:
        if robustness_by_m[robots + 1].answer != "supported":
            return FaultBudget(robots, robots + 1)
        robots += 1
    untested = robots < max(robustness_by_m)
    return FaultBudget(robots, robots + 1 if untested else None)
