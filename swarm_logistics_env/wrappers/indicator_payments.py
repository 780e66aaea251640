"""The payments of an indicator: one for each delivery, and one for the whole episode."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.spi.definitions import DEFINITIONS

from .condition import Condition
from .reference_performances import GivenPerformances, RunningMeans

# The performances that each indicator is relative to.
PERFORMANCES = {d.symbol: d.references for d in DEFINITIONS.values() if d.compares != "policy"}
INDICATORS = tuple(PERFORMANCES)


@dataclass(frozen=True)
class Payment:
    """The parts of an episode's return: `share` for each item delivered, and `constant` once."""

    share: float = 0.0
    constant: float = 0.0


@dataclass(frozen=True)
class Comparison:
    """An indicator as one ratio, scale (P - P_against) / P_o + offset; P is the tested episode's.

    `against` is the condition of P_o itself, but for FT, where it is that of P_S.
    """

    scale: float
    offset: float
    reference: Condition
    against: Condition


@dataclass(frozen=True)
class EpisodeIndicator(Payment):
    """An episode's indicator as share and constant, and the performances in them, by name.

    The names are those of `PERFORMANCES`.
    """

    performances: Mapping[str, tuple[Condition, float]] = field(default_factory=dict)


def comparison(name: str, tested: Condition, own: Scenario) -> Comparison | None:
    """Return what the indicator compares episodes of `tested` with; None: it does not test them.

    Everything that the indicator does not vary is the same in its references.

    Args:
        name: one of `INDICATORS`, or "P".
        own: the scenario that changes are relative to, with the N of S.

    Raises:
        SetupError: the indicator is about such an episode, but undefined.
    """
    n, m = tested.n_robots, tested.n_failed
    unbroken = dataclasses.replace(tested, modes=(), n_failed=0)
    if name == "R" and m:
        return Comparison(1.0, m / n, unbroken, unbroken)
    if name == "FT" and m:
        n_removed = tested.n_removed + m
        if n_removed >= n:
            raise SetupError(
                f"FT with {m} of {n - tested.n_removed} robots faulty: should leave a robot for "
                "P_S (m < N)"
            )
        removed = dataclasses.replace(unbroken, n_removed=n_removed)
        return Comparison(1.0, 0.0, unbroken, removed)
    if name == "S" and n != own.n_robots:
        if n < own.n_robots:
            raise SetupError(
                f"S from N = {own.n_robots} to {n} robots: should be to more (m >= 1); N is the "
                "environment's own n_robots"
            )
        smaller = dataclasses.replace(tested, n_robots=own.n_robots)
        return Comparison(own.n_robots / (n - own.n_robots), 0.0, smaller, smaller)
    if name == "A" and tested.changes:
        original = dataclasses.replace(tested, changes=())
        return Comparison(1.0 / _relative_change(tested.changes, own), 1.0, original, original)
    return None


def indicator_of(
    name: str, condition: Condition, own: Scenario, references: GivenPerformances | RunningMeans
) -> EpisodeIndicator | None:
    """Return the indicator of episodes of that condition; None: it does not test them.

    Raises:
        SetupError: a reference performance is missing or 0, or the indicator is undefined.
    """
    if name == "P":
        return EpisodeIndicator(1.0)
    compared = comparison(name, condition, own)
    if compared is None:
        return None
    p_o = p_against = references.divisor(compared.reference)
    performances = {"P_N" if name == "S" else "P_o": (compared.reference, p_o)}
    if compared.against != compared.reference:
        p_against = references.performance(compared.against)
        performances["P_S"] = (compared.against, p_against)
    share = compared.scale / p_o
    return EpisodeIndicator(share, compared.offset - share * p_against, performances)


def derivative_of(name: str, condition: Condition, own: Scenario, means: RunningMeans) -> Payment:
    """Return what an episode pays for being a reference of others: the derivative, centred.

    Summed over the conditions that have it as reference, each as often as it was played, so that
    the mean return over all episodes has the gradient of the mean indicator.
    """
    slope, mean = 0.0, means.mean(condition)
    if mean is None:
        return Payment()
    for tested in means.conditions:
        try:
            compared = comparison(name, tested, own)
        except SetupError:  # it is of another environment, of another size
            continue
        if compared is not None and condition in (compared.reference, compared.against):
            by_episode = _derivative(compared, condition, means.performance(tested), means)
            slope += by_episode * means.count(tested) / means.count(condition)
    return Payment(slope, -slope * mean)


def _derivative(
    compared: Comparison, condition: Condition, p_tested: float, means: RunningMeans
) -> float:
    p_o = means.divisor(compared.reference)
    if condition != compared.reference:
        return -compared.scale / p_o
    if means.performance(condition) < means.least:
        return 0.0  # it counts as `least`, so that a change of it moves nothing
    if compared.against != compared.reference:
        p_tested -= means.performance(compared.against)
    return -compared.scale * p_tested / p_o**2


def _relative_change(changes: tuple[tuple[str, Any], ...], own: Scenario) -> float:
    if len(changes) > 1:
        names = ", ".join(name for name, _ in changes)
        raise SetupError(f"A of changes in {names}: should be in one parameter only")
    name, x_new = changes[0]
    x_o = getattr(own, name)
    if not all(isinstance(x, int | float) and not isinstance(x, bool) for x in (x_o, x_new)):
        raise SetupError(f"A of a change in {name}: should be in a parameter that is a number")
    if x_o == 0:
        raise SetupError(f"A of a change in {name} from 0: a change relative to 0 is undefined")
    return float(abs((x_new - x_o) / x_o))
