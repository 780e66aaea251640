"""How often verdicts are wrong, over simulated studies: `python -m verification.verdict_errors`.

It prints the errors of studies that run until they are clear, of a family of twelve of them, and of
equivalence at the edge of its margin, with the power at the planned seeds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from swarm_logistics_env import spi
from swarm_logistics_env.spi.ratio import paired_ratio
from swarm_logistics_env.studies.specification import looks_up_to
from swarm_logistics_env.studies.until_clear import SPENDING

STUDIES = 10_000
P_O, P_F = 39.0, 34.0  # true means [items]
FAMILY = 12
EDGE = 0.1
_CHUNK = 300  # studies whose resamples fit into memory at once

Floats = NDArray[Any]
Draw = Callable[[np.random.Generator, tuple[int, ...], float], tuple[Floats, Floats]]


def poisson(rng: np.random.Generator, shape: tuple[int, ...], p_f: float) -> tuple[Floats, Floats]:
    """Return Poisson counts of both conditions."""
    return rng.poisson(P_O, shape) * 1.0, rng.poisson(p_f, shape) * 1.0


def overdispersed(
    rng: np.random.Generator, shape: tuple[int, ...], p_f: float
) -> tuple[Floats, Floats]:
    """Return Poisson counts around a gamma rate that a seed shares: variance 3 times the mean."""
    rate = rng.gamma(20.0, 1 / 20.0, shape)
    return rng.poisson(P_O * rate) * 1.0, rng.poisson(p_f * rate) * 1.0


def geometric(
    rng: np.random.Generator, shape: tuple[int, ...], p_f: float
) -> tuple[Floats, Floats]:
    """Return counts as under FM4, where a deadlock ends all deliveries at a random time."""
    return rng.binomial(60, P_O / 60, shape) * 1.0, rng.geometric(1 / (1 + p_f), shape) - 1.0


MODELS: Mapping[str, tuple[Draw, float]] = {
    "poisson": (poisson, P_F),
    "overdispersed": (overdispersed, P_F),
    "geometric": (geometric, 10.0),
}


class Wrong(NamedTuple):
    """Share of studies whose verdict was wrong: on both sides, above and below the truth."""

    share: float
    above: float
    below: float


def wrong_verdicts(
    model: str, looks: Sequence[int], studies: int = STUDIES, alpha: float = 0.05
) -> Wrong:
    """Return how often a study that runs until it is clear decides, where nothing is to decide.

    Args:
        model: a name in `MODELS`; the threshold is the true value.
        looks: numbers of seeds at which it may stop.
        studies: number of simulated studies.
        alpha: of the comparison, over all looks.
    """
    draw, p_f = MODELS[model]
    truth = p_f / P_O - 1
    p_o, p_new = draw(np.random.default_rng(len(looks)), (studies, looks[-1]), p_f)
    difference = p_new - p_o - truth * p_o
    running = np.ones(studies, dtype=bool)
    above = below = 0
    for n, level in zip(looks, spi.look_alphas(looks, alpha, spending=SPENDING)):
        seen = difference[:, :n]
        t = seen.mean(axis=1) / (seen.std(axis=1, ddof=1) / math.sqrt(n))
        # p is the larger of two, so the bootstrap is asked only where the t test rejects.
        asked = np.flatnonzero(running & (2 * stdtr(n - 1, -np.abs(t)) < level))
        for some in np.split(asked, range(_CHUNK, asked.size, _CHUNK)):
            old, new = p_o[some, :n], p_new[some, :n]
            p_value = paired_ratio(new - old, old, threshold=truth).p_value
            stopped = some[p_value < level]
            running[stopped] = False
            above += int((t[stopped] > 0).sum())
            below += int((t[stopped] < 0).sum())
    return Wrong((above + below) / studies, above / studies, below / studies)


def share_equivalent(model: str, n: int, change: float, studies: int = STUDIES) -> float:
    """Return the share of studies of n seeds that are called equivalent, at a true change of P."""
    draw, _ = MODELS[model]
    p_o, p_new = draw(np.random.default_rng(n), (studies, n), P_O * (1 + change))
    found = 0
    for start in range(0, studies, _CHUNK):
        old, new = p_o[start : start + _CHUNK], p_new[start : start + _CHUNK]
        above, below = (
            paired_ratio(new - old, old, threshold=edge, confidence=0.9) for edge in (-EDGE, EDGE)
        )
        found += int(((1 - above.probability < 0.05) & (below.probability < 0.05)).sum())
    return found / studies


def planned_seeds(model: str) -> int:
    """Return the seeds planned for a power of 80 % at no change, from a pilot of 4,000."""
    draw, _ = MODELS[model]
    seeds = spi.seeds_for_equivalence(
        spi.equivalence(*draw(np.random.default_rng(0), (4_000,), P_O))
    )
    assert seeds is not None
    return seeds


def until_clear_table(studies: int = STUDIES) -> str:
    """Return the errors of studies that run until they are clear, as Markdown."""
    heading = "| counts | most seeds | wrong | above, below | in a family of 12 |"
    lines = [heading, "| --- " * 5 + "|"]

    for model in MODELS:
        for most in (60, 200):
            looks = looks_up_to(most)
            one = wrong_verdicts(model, looks, studies)
            each = wrong_verdicts(model, looks, FAMILY * studies, 0.05 / FAMILY).share
            family = 1 - (1 - each) ** FAMILY
            sides = f"{one.above:.3f}, {one.below:.3f}"
            lines.append(f"| {model} | {most} | {one.share:.3f} | {sides} | {family:.3f} |")
    return "\n".join(lines)


def equivalence_table(studies: int = STUDIES) -> str:
    """Return the errors and the power of equivalence at a margin of 0.1, as Markdown."""
    heading = "wrong at a change of -0.1 and 0.1, 30 seeds"
    lines = [f"| counts | {heading} | planned seeds | their power |", "| --- " * 4 + "|"]
    for model in ("poisson", "overdispersed"):
        wrong = (share_equivalent(model, 30, change, studies) for change in (-EDGE, EDGE))
        seeds = planned_seeds(model)
        told = ", ".join(f"{share:.3f}" for share in wrong)
        power = share_equivalent(model, seeds, 0.0, studies)
        lines.append(f"| {model} | {told} | {seeds} | {power:.2f} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(f"Until clear, {STUDIES:,} studies:\n\n{until_clear_table()}\n")
    print(f"Equivalence, {STUDIES:,} studies:\n\n{equivalence_table()}")
