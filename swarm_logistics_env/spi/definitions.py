"""The four Swarm Performance Indicators, the relative change, and a table with a row of each.

Plan, tests, gates, wording, figures and help texts read the table. A new indicator is a function
and a row; what `IndicatorReward` pays for is in `wrappers.indicator_payments.comparison`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, SupportsIndex, Unpack

from numpy.typing import ArrayLike

from .estimate import Estimate, Options, estimate_ratio
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
    return estimate_ratio("S", {"p_nm": (p_nm, gain), "p_n": (p_n, -gain)}, **options)


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
    return estimate_ratio(
        "FT", {"p_f": (p_f, 1.0), "p_s": (p_s, -1.0), "p_o": (p_o, 0.0)}, **options
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
    robots = count("n", n)
    faulty = count("m", m)
    if faulty > robots:
        raise IndicatorError(f"m = {faulty}: should be at most n = {robots} robots")
    return estimate_ratio(
        "R", {"p_f": (p_f, 1.0), "p_o": (p_o, -1.0)}, offset=faulty / robots, **options
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
    return estimate_ratio("A", {"p_new": (p_new, gain), "p_o": (p_o, -gain)}, offset=1.0, **options)


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
    terms = {"p_new": (p_new, 1.0), "p_o": (p_o, -1.0)}
    return estimate_ratio("change", terms, two_recipes=True, **options)


FactorKind = Literal["size", "fault", "parameter", "policy"]


class Change(NamedTuple):
    """What differs between the two conditions that an indicator compares.

    Attributes:
        before, after: the factor's values: robots, faulty robots, or the parameter in its unit.
        n_robots: swarm size N of the original condition.
    """

    before: float
    after: float
    n_robots: int


@dataclass(frozen=True)
class Definition:
    """One indicator.

    Attributes:
        symbol: as in the paper, e.g. "FT".
        heading: its name and symbol, for headings and axes, e.g. "fault tolerance FT".
        compares: the factor that differs between the conditions compared.
        performances: argument of `function` to the paper's symbol: P of the original condition, of
            the changed one and, where there is a third, of the one with the robots removed.
        function: from performances over seeds to an `Estimate`.
        arguments: the function's further arguments, from what differs.
        adjectives: threshold to what a swarm above it is called.
        at_zero: what the indicator is, and what 0 means, for a reader who knows none of them.
        above: what it means in words that the indicator is above 0; empty: there are no such words.
        below: that it is below 0.
    """

    symbol: str
    heading: str
    compares: FactorKind
    performances: Mapping[str, str]
    function: Callable[..., Estimate]
    arguments: Callable[[Change], dict[str, Any]]
    adjectives: Mapping[float, str]
    at_zero: str
    above: str = ""
    below: str = ""

    @property
    def needs_removed(self) -> bool:
        """Whether it compares with the robots removed as well."""
        return len(self.performances) == 3

    @property
    def references(self) -> tuple[str, ...]:
        """The paper's symbols of all performances but the changed condition's."""
        original, _, *removed = self.performances.values()
        return (original, *removed)

    def property_name(self, threshold: float, *, claimed_below: bool = False) -> str:
        """Return what a verdict is about, e.g. "scalable", "S > 0.5" or "P falls".

        Args:
            threshold: that the indicator is tested against.
            claimed_below: whether the study claims that it lies below the threshold.
        """
        if self.compares == "policy" and claimed_below:
            return f"P falls by more than {-100 * threshold:.0f} %" if threshold else "P falls"
        return self.adjectives.get(threshold) or f"{self.symbol} > {threshold:.3g}"

    def unchanged(self, margin: float) -> str | None:
        """Return what equivalence says, e.g. "P_F within 10 % of P_o"; None for S.

        Robots are added so that P grows, and a share of P means more for 5 robots than for 50: no
        one margin fits the steps of S.
        """
        if self.compares == "size":
            return None
        _, changed, *_ = self.performances.values()
        share = f"{100 * margin:.3g} %"
        reference, *compared = self.references
        if compared:
            return f"{changed} and {compared[0]} differ by less than {share} of {reference}"
        return f"{changed} within {share} of {reference}"


DEFINITIONS: dict[str, Definition] = {
    definition.symbol: definition
    for definition in (
        Definition(
            symbol="S",
            heading="scalability S",
            compares="size",
            performances={"p_n": "P_N", "p_nm": "P_N+m"},
            function=scalability,
            arguments=lambda c: {"n": int(c.before), "m": int(c.after - c.before)},
            adjectives={0.0: "scalable", 1.0: "superlinear"},
            at_zero="S = growth of P / growth of N; 0: more robots bring no more, 1: in proportion",
            above="more robots raise P",
            below="more robots lower P",
        ),
        Definition(
            symbol="FT",
            heading="fault tolerance FT",
            compares="fault",
            performances={"p_o": "P_o", "p_f": "P_F", "p_s": "P_S"},
            function=fault_tolerance,
            arguments=lambda c: {"n": c.n_robots, "m": int(c.after)},
            adjectives={0.0: "tolerant"},
            at_zero="FT = (P with the faulty robots - P with them removed) / P of all sound; "
            "0: as if they were removed",
            above="faulty robots are better than none",
            below="P would be higher without the faulty robots",
        ),
        Definition(
            symbol="R",
            heading="robustness R",
            compares="fault",
            performances={"p_o": "P_o", "p_f": "P_F"},
            function=robustness,
            arguments=lambda c: {"n": c.n_robots, "m": int(c.after)},
            adjectives={0.0: "robust"},
            at_zero="R = P with m of N faulty / P of all sound - (1 - m/N); 0: P falls by the "
            "share m/N, m/N: not at all",
            above="faulty robots cost less than their share",
            below="faulty robots cost more than their share",
        ),
        Definition(
            symbol="A",
            heading="adaptability A",
            compares="parameter",
            performances={"p_o": "P_o", "p_new": "P_new"},
            function=adaptability,
            arguments=lambda c: {"x_o": c.before, "x_new": c.after},
            adjectives={0.0: "adaptable", 1.0: "P has grown"},
            at_zero="A = 1 - fall of P / change of the parameter, as shares; 0: P falls by as "
            "large a share, 1: not at all",
            above="P falls by a smaller share than the surroundings change",
            below="P falls by a larger share than the surroundings change",
        ),
        Definition(
            symbol="change",
            heading="change of P",
            compares="policy",
            performances={"p_o": "P_o", "p_new": "P_new"},
            function=relative_change,
            arguments=lambda _: {},
            adjectives={},
            at_zero="change = 0: P is the same, -0.5: half",
        ),
    )
}


def comparing(factor: FactorKind) -> tuple[Definition, ...]:
    """Return the indicators whose conditions differ in that factor, in the order of the table."""
    return tuple(d for d in DEFINITIONS.values() if d.compares == factor)
