"""How often verdicts are wrong, over simulated studies: `python -m verification.verdict_errors`.

It prints the errors of studies of so many seeds, and of those that run until they are clear, and of
equivalence at the edge of its margin, also where some runs stall; and how often intervals over
trainings and seeds hold the true value.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import stdtr

from swarm_logistics_env import spi
from swarm_logistics_env.questions.specification import looks_up_to
from swarm_logistics_env.spi.ratio import RatioTest, paired_ratio
from swarm_logistics_env.spi.summaries import at_stake
from swarm_logistics_env.verdicts.until_clear import SPENDING

STUDIES, TRAINED_STUDIES = 3_000, 1_000
P_O, P_F, LEARNED_P = 39.0, 34.0, 300.0  # true means [items]
EDGE = 0.1
REMOVED = 3
_CHUNK = 300  # studies whose resamples fit into memory at once

Floats = NDArray[Any]
Rng = np.random.Generator
Shape = tuple[int, ...]
Pair = tuple[Floats, Floats]
Row = dict[str, object]


class Model(NamedTuple):
    """How counts without and with a fault scatter (the mean with one is given); true means."""

    draw: Callable[[Rng, Shape, float], Pair]
    p_o: float
    p_f: float


def _poisson(rng: Rng, shape: Shape, p_f: float) -> Pair:
    return rng.poisson(P_O, shape) * 1.0, rng.poisson(p_f, shape) * 1.0


def _overdispersed(rng: Rng, shape: Shape, p_f: float) -> Pair:
    """Return Poisson counts around a gamma rate that a seed shares: variance 3 times the mean."""
    rate = rng.gamma(20.0, 1 / 20.0, shape)
    return rng.poisson(P_O * rate) * 1.0, rng.poisson(p_f * rate) * 1.0


def _geometric(rng: Rng, shape: Shape, p_f: float) -> Pair:
    """Return counts as under FM4, where a deadlock ends all deliveries at a random time."""
    return rng.binomial(60, P_O / 60, shape) * 1.0, rng.geometric(1 / (1 + p_f), shape) - 1.0


def _stalling(share: float) -> Model:
    """Return counts of a policy that learned, of which a share of the runs with faults stalls.

    A stall costs some ten standard deviations of the other differences, as in the shipped networks.
    """

    def draw(rng: Rng, shape: Shape, p_f: float) -> Pair:
        near_nothing = rng.integers(0, 4, shape)
        working = (p_f - share * 1.5) / (1.0 - share)
        p_o, p_new = (rng.normal(mean, 20.0, shape).round() for mean in (LEARNED_P, working))
        return p_o, np.where(rng.random(shape) < share, near_nothing, p_new)

    return Model(draw, LEARNED_P, 0.9 * LEARNED_P)


MODELS: Mapping[str, Model] = {
    "poisson": Model(_poisson, P_O, P_F),
    "overdispersed": Model(_overdispersed, P_O, P_F),
    "geometric": Model(_geometric, P_O, 10.0),
}
STALLS = {f"{share:.0%} stall": _stalling(share) for share in (0.0, 0.03, 0.05, 0.1)}
_ALL = {**MODELS, **STALLS}
# Counts around the mean of each training and seed.
_AROUND: Mapping[str, Callable[[Rng, Floats], Floats]] = {
    "poisson": lambda rng, mean: rng.poisson(mean),
    "overdispersed": lambda rng, mean: rng.poisson(mean * rng.gamma(20.0, 1 / 20.0, mean.shape)),
    "geometric": lambda rng, mean: rng.geometric(1 / (1 + mean)) - 1,
}


def judged(
    p_o: Floats, p_new: Floats, threshold: float, confidence: float = 0.95
) -> RatioTest[Any]:
    """Return the test of the relative change of P, as studies make it."""
    stakes = at_stake([(1.0, p_new), (-1.0 - threshold, p_o)])
    return paired_ratio(
        p_new - p_o, p_o, at_stake=stakes, threshold=threshold, confidence=confidence
    )


def _p_values(
    p_o: Floats, p_new: Floats, threshold: float, only_seen: bool, confidence: float = 0.95
) -> Floats:
    found = []
    for some in np.split(np.arange(len(p_o)), range(_CHUNK, len(p_o), _CHUNK)):
        test = judged(p_o[some], p_new[some], threshold, confidence)
        found.append(test.p_seen if only_seen else test.p_value)
    return np.concatenate(found)


def _t_statistic(p_o: Floats, p_new: Floats, threshold: float) -> Floats:
    difference = p_new - p_o - threshold * p_o
    spread = difference.std(axis=1, ddof=1) / math.sqrt(difference.shape[1])
    return np.asarray(difference.mean(axis=1) / spread)


class Wrong(NamedTuple):
    """Share of studies whose verdict was wrong: on both sides, above and below the truth."""

    share: float
    above: float
    below: float


def wrong_verdicts(
    model: str,
    looks: Sequence[int],
    studies: int = STUDIES,
    alpha: float = 0.05,
    *,
    only_seen: bool = False,
) -> Wrong:
    """Return how often a study that runs until it is clear decides at the true value.

    It may stop at each look, a number of seeds; one look: a study of so many. `alpha` is over all
    looks; with `only_seen` stalls that no run showed are left out of account.
    """
    draw, mean_o, mean_f = _ALL[model]
    truth = mean_f / mean_o - 1
    p_o, p_new = draw(np.random.default_rng(len(looks)), (studies, looks[-1]), mean_f)
    running = np.ones(studies, dtype=bool)
    above = below = 0
    for n, level in zip(looks, spi.look_alphas(looks, alpha, spending=SPENDING)):
        t = _t_statistic(p_o[:, :n], p_new[:, :n], truth)
        # p is the largest of several, so that the others are asked only where the t test rejects.
        asked = np.flatnonzero(running & (2 * stdtr(n - 1, -np.abs(t)) < level))
        stopped = asked[_p_values(p_o[asked, :n], p_new[asked, :n], truth, only_seen) < level]
        running[stopped] = False
        above += int((t[stopped] > 0).sum())
        below += int((t[stopped] < 0).sum())
    return Wrong((above + below) / studies, above / studies, below / studies)


def share_equivalent(
    model: str, n: int, change: float, studies: int = STUDIES, *, only_seen: bool = False
) -> float:
    """Return the share of studies of n seeds that are called equivalent, at a true change of P."""
    draw, mean_o, _ = _ALL[model]
    p_o, p_new = draw(np.random.default_rng(n), (studies, n), mean_o * (1 + change))
    above, below = (_t_statistic(p_o, p_new, edge) for edge in (-EDGE, EDGE))
    asked = np.flatnonzero(np.maximum(stdtr(n - 1, -above), stdtr(n - 1, below)) < 0.05)
    of_edges = [_p_values(p_o[asked], p_new[asked], at, only_seen, 0.9) for at in (-EDGE, EDGE)]
    return int((np.maximum(*of_edges) < 0.1).sum()) / studies


class Coverage(NamedTuple):
    """Share of studies whose interval holds the truth, and the median of its widths."""

    share: float
    width: float


def trainings_coverage(
    model: str, trainings: int, seeds: int, spread: float, studies: int = TRAINED_STUDIES
) -> Coverage:
    """Return how often the interval of R over trainings and seeds holds the true value.

    `spread` is the standard deviation of ln P and of ln(1 + change) between trainings; .2 between
    seeds.
    """
    rng = np.random.default_rng([trainings, seeds])
    _, mean_o, mean_f = MODELS[model]
    truth = mean_f / mean_o - 1.0 + REMOVED / 25

    def factor() -> Floats:
        shapes = ((trainings, 1), spread), ((1, seeds), 0.2)
        one, other = (np.exp(sd * rng.standard_normal(of) - sd**2 / 2) for of, sd in shapes)
        return np.asarray(one * other)

    held, widths = 0, []
    for _ in range(studies):
        p_o = mean_o * factor()
        means = p_o, p_o * mean_f / mean_o * factor()
        counts = (_AROUND[model](rng, mean) for mean in means)
        found = spi.robustness(*counts, n=25, m=REMOVED, threshold=truth)
        held += found.p_value is None or found.p_value >= 0.05
        widths.append((found.high or 0.0) - (found.low or 0.0))
    return Coverage(held / studies, float(np.median(widths)))


def verdict_rows() -> Iterator[Row]:
    """Yield the errors of studies of so many seeds, or until clear, at the true value.

    What is called wrong above the truth, and equivalent though P falls by a tenth, is the harm.
    """
    fixed: list[Sequence[int]] = [[n] for n in (10, 20, 30, 50, 100)]
    for model, looks in product(_ALL, (*fixed, looks_up_to(60), looks_up_to(200))):
        until = "" if len(looks) == 1 else "until clear, "
        wrong = wrong_verdicts(model, looks)
        row: Row = {"runs": model, "seeds": f"{until}{looks[-1]}", **wrong._asdict()}
        if not until:
            row["equivalent"] = share_equivalent(model, looks[0], -EDGE)
        yield row


def trainings_rows() -> Iterator[Row]:
    """Yield the coverage and the width of intervals over trainings and seeds."""
    for model, trainings, spread in product(MODELS, (5, 10), (0.0, 0.1, 0.3)):
        told = trainings_coverage(model, trainings, 20, spread)
        yield {"counts": model, "trainings": trainings, "spread": spread, **told._asdict()}


TABLES = {
    f"Verdicts, {STUDIES:,} studies": verdict_rows,
    f"R over trainings and 20 seeds, {TRAINED_STUDIES:,} studies": trainings_rows,
}

if __name__ == "__main__":
    for title, rows in TABLES.items():
        table = pd.DataFrame(rows()).to_string(float_format="{:.3f}".format, na_rep="")
        print(f"{title}:\n\n{table}\n")
