"""The indicators that a study tests: one row each.

Plan, tests, gates, wording, figures, rewards and help texts read this table. A new indicator is a
function in `indicators` and a row here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from .estimate import Estimate
from .indicators import adaptability, fault_tolerance, relative_change, robustness, scalability

Factor = Literal["size", "fault", "parameter", "policy"]


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
    """

    symbol: str
    heading: str
    compares: Factor
    performances: Mapping[str, str]
    function: Callable[..., Estimate]
    arguments: Callable[[Change], dict[str, Any]]
    adjectives: Mapping[float, str]

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
        original, changed, *removed = self.performances.values()
        if removed:
            return f"{changed} within {100 * margin:.3g} % of {original} from {removed[0]}"
        return f"{changed} within {100 * margin:.3g} % of {original}"


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
        ),
        Definition(
            symbol="FT",
            heading="fault tolerance FT",
            compares="fault",
            performances={"p_o": "P_o", "p_f": "P_F", "p_s": "P_S"},
            function=fault_tolerance,
            arguments=lambda c: {"n": c.n_robots, "m": int(c.after)},
            adjectives={0.0: "tolerant"},
        ),
        Definition(
            symbol="R",
            heading="robustness R",
            compares="fault",
            performances={"p_o": "P_o", "p_f": "P_F"},
            function=robustness,
            arguments=lambda c: {"n": c.n_robots, "m": int(c.after)},
            adjectives={0.0: "robust"},
        ),
        Definition(
            symbol="A",
            heading="adaptability A",
            compares="parameter",
            performances={"p_o": "P_o", "p_new": "P_new"},
            function=adaptability,
            arguments=lambda c: {"x_o": c.before, "x_new": c.after},
            adjectives={0.0: "adaptable", 1.0: "P has grown"},
        ),
        Definition(
            symbol="change",
            heading="change of P",
            compares="policy",
            performances={"p_o": "P_o", "p_new": "P_new"},
            function=relative_change,
            arguments=lambda _: {},
            adjectives={},
        ),
    )
}


def comparing(factor: Factor) -> tuple[Definition, ...]:
    """Return the indicators whose conditions differ in that factor, in the order of the table."""
    return tuple(d for d in DEFINITIONS.values() if d.compares == factor)
