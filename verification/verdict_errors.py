"""How often verdicts are wrong, over simulated studies: `python -m verification.verdict_errors`.

It prints the errors of studies that run until they are clear, of a family of twelve of them, and of
equivalence at the edge of its margin, with the power at the planned seeds; then the same where some
runs stall, with the errors that only the runs seen would make; and how often intervals over
trainings and seeds hold the true value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import stdtr

from swarm_logistics_env import spi
from swarm_logistics_env.spi.ratio import RatioTest, paired_ratio
from swarm_logistics_env.spi.summaries import at_stake
from swarm_logistics_env.studies.specification import looks_up_to
from swarm_logistics_env.studies.until_clear import SPENDING

STUDIES = 10_000
STALL_STUDIES = 3_000
TRAINED_STUDIES = 1_000
P_O, P_F = 39.0, 34.0  # true means [items]
FAMILY = 12
EDGE = 0.1
STALL_SHARES = (0.0, 0.03, 0.05, 0.1)
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


def stalling(share: float) -> Draw:
    """Return counts of a policy that learned, of which a share of the runs with faults stalls.

    A stall costs some ten standard deviations of the other differences, as in the shipped networks.
    `p_f` is the mean over all runs.
    """

    def draw(rng: np.random.Generator, shape: tuple[int, ...], p_f: float) -> tuple[Floats, Floats]:
        near_nothing = rng.integers(0, 4, shape)
        working = (p_f - share * 1.5) / (1.0 - share)
        p_o, p_new = (rng.normal(mean, 20.0, shape).round() for mean in (_LEARNED_P, working))
        return p_o, np.where(rng.random(shape) < share, near_nothing, p_new)

    return draw


class Model(NamedTuple):
    """Counts without and with a fault, and their true means [items]."""

    draw: Draw
    p_o: float
    p_f: float


_LEARNED_P = 300.0
MODELS: Mapping[str, Model] = {
    "poisson": Model(poisson, P_O, P_F),
    "overdispersed": Model(overdispersed, P_O, P_F),
    "geometric": Model(geometric, P_O, 10.0),
}
STALLS: Mapping[str, Model] = {
    f"{share:.0%} stall": Model(stalling(share), _LEARNED_P, 0.9 * _LEARNED_P)
    for share in STALL_SHARES
}
_ALL = {**MODELS, **STALLS}


def judged(p_o: Floats, p_new: Floats, threshold: float, confidence: float = 0.95) -> RatioTest:
    """Return the test of the relative change of P, as studies make it."""
    stakes = at_stake([(1.0, p_new), (-1.0 - threshold, p_o)])
    return paired_ratio(
        p_new - p_o, p_o, threshold=threshold, confidence=confidence, at_stake=stakes
    )


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
    """Return how often a study that runs until it is clear decides, where nothing is to decide.

    Args:
        model: a name in `MODELS` or `STALLS`; the threshold is the true value.
        looks: numbers of seeds at which it may stop; one: a study of so many seeds.
        studies: number of simulated studies.
        alpha: of the comparison, over all looks.
        only_seen: whether stalls that no run showed are left out of account.
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
        for some in np.split(asked, range(_CHUNK, asked.size, _CHUNK)):
            test = judged(p_o[some, :n], p_new[some, :n], truth)
            stopped = some[(test.p_seen if only_seen else test.p_value) < level]
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
    found = 0
    for some in np.split(asked, range(_CHUNK, asked.size, _CHUNK)):
        tests = [judged(p_o[some], p_new[some], edge, confidence=0.9) for edge in (-EDGE, EDGE)]
        p_values = [test.p_seen if only_seen else test.p_value for test in tests]
        found += int((np.maximum(*p_values) < 0.1).sum())
    return found / studies


class Coverage(NamedTuple):
    """Share of studies whose interval holds the truth, and the median of its widths."""

    share: float
    width: float


def trainings_coverage(
    model: str, trainings: int, seeds: int, spread: float, studies: int = TRAINED_STUDIES
) -> Coverage:
    """Return how often the interval of R over trainings and seeds holds the true value.

    Args:
        model: a name in `MODELS`: how counts scatter around the mean of their training and seed.
        trainings, seeds: of each study.
        spread: standard deviation of ln P and of ln(1 + change) between trainings; .2 between
            seeds.
    """
    rng = np.random.default_rng([trainings, seeds])
    _, mean_o, mean_f = MODELS[model]
    truth = mean_f / mean_o - 1.0 + _REMOVED / 25

    def factor(shape: tuple[int, int], sd: float) -> Floats:
        return np.exp(sd * rng.standard_normal(shape) - sd**2 / 2)

    held, widths = 0, []
    for _ in range(studies):
        p_o = mean_o * factor((trainings, 1), spread) * factor((1, seeds), 0.2)
        change = factor((trainings, 1), spread) * factor((1, seeds), 0.2)
        means = p_o, p_o * mean_f / mean_o * change
        found = spi.robustness(
            *(_AROUND[model](rng, mean) for mean in means), n=25, m=_REMOVED, threshold=truth
        )
        held += found.p_value is None or found.p_value >= 0.05
        widths.append((found.high or 0.0) - (found.low or 0.0))
    return Coverage(held / studies, float(np.median(widths)))


_REMOVED = 3
_AROUND: Mapping[str, Callable[[np.random.Generator, Floats], Floats]] = {
    "poisson": lambda rng, mean: rng.poisson(mean),
    "overdispersed": lambda rng, mean: rng.poisson(mean * rng.gamma(20.0, 1 / 20.0, mean.shape)),
    "geometric": lambda rng, mean: rng.geometric(1 / (1 + mean)) - 1,
}


def _t_statistic(p_o: Floats, p_new: Floats, threshold: float) -> Floats:
    difference = p_new - p_o - threshold * p_o
    spread = difference.std(axis=1, ddof=1) / math.sqrt(difference.shape[1])
    return np.asarray(difference.mean(axis=1) / spread)


def planned_seeds(model: str) -> int:
    """Return the seeds planned for a power of 80 % at no change, from a pilot of 1,000."""
    draw, mean_o, _ = _ALL[model]
    pilot = draw(np.random.default_rng(0), (1_000,), mean_o)
    return spi.seeds_for_equivalence(spi.equivalence(*pilot)) or 0


def planned_power(
    model: str, distance: float, pilot_seeds: int, pilots: int
) -> tuple[float, float]:
    """Return the seeds that pilots plan for a verdict on the change, and the power of these.

    Args:
        model: a name in `MODELS` or `STALLS`.
        distance: from the threshold to the true change; below 0: the verdict is "refuted".
        pilot_seeds: seeds of each pilot.
        pilots: number of pilots; 25 studies follow each.
    """
    draw, mean_o, mean_f = _ALL[model]
    rng, truth = np.random.default_rng(pilot_seeds), mean_f / mean_o - 1
    threshold = truth - distance
    planned, found = [], []
    for _ in range(pilots):
        pilot = spi.relative_change(*draw(rng, (pilot_seeds,), mean_f), threshold=threshold)
        n = spi.seeds_for_power(pilot, truth) or 0
        test = judged(*draw(rng, (25, n), mean_f), threshold)
        planned.append(n)
        is_right = (test.probability > 0.5) == (distance > 0.0)
        found.append(float(((test.p_value < 0.05) & is_right).mean()))
    return float(np.median(planned)), float(np.mean(found))


Row = dict[str, object]


def until_clear_rows() -> Iterator[Row]:
    """Yield the errors of studies that run until they are clear, alone and in a family."""
    for model in MODELS:
        for most in (60, 200):
            looks = looks_up_to(most)
            one = wrong_verdicts(model, looks)
            each = wrong_verdicts(model, looks, FAMILY * STUDIES, 0.05 / FAMILY).share
            family = {f"in a family of {FAMILY}": 1 - (1 - each) ** FAMILY}
            yield {"counts": model, "most seeds": most, **one._asdict(), **family}


def equivalence_rows() -> Iterator[Row]:
    """Yield the errors and the power of equivalence at a margin of 0.1."""
    for model in ("poisson", "overdispersed"):
        wrong = {
            f"wrong at {at}, 30 seeds": share_equivalent(model, 30, at) for at in (-EDGE, EDGE)
        }
        seeds = planned_seeds(model)
        power = share_equivalent(model, seeds, 0.0)
        yield {"counts": model, **wrong, "planned seeds": seeds, "their power": power}


def stall_rows() -> Iterator[Row]:
    """Yield the errors at the true value where some runs stall, until clear as well.

    Also those that the runs seen alone would make. What is called wrong above the truth, and
    equivalent though P falls by a tenth, is the harm that stalls do.
    """
    fixed: list[Sequence[int]] = [[n] for n in (10, 20, 30, 50, 100)]
    for model in STALLS:
        for looks in (*fixed, looks_up_to(60), looks_up_to(200)):
            until = "" if len(looks) == 1 else "until clear, "
            row: Row = {"runs": model, "seeds": f"{until}{looks[-1]}"}
            for seen, words in ((False, ""), (True, ", only seen")):
                wrong = wrong_verdicts(model, looks, STALL_STUDIES, only_seen=seen)
                row |= {f"above{words}": wrong.above, f"below{words}": wrong.below}
                if len(looks) == 1:
                    row[f"equivalent{words}"] = share_equivalent(
                        model, looks[0], -EDGE, STALL_STUDIES, only_seen=seen
                    )
            yield row


def trainings_rows() -> Iterator[Row]:
    """Yield the coverage and the width of intervals over trainings and seeds."""
    for model, trainings, spread in product(MODELS, (5, 10), (0.0, 0.1, 0.3)):
        told = trainings_coverage(model, trainings, 20, spread)
        yield {"counts": model, "trainings": trainings, "spread": spread, **told._asdict()}


TABLES: Mapping[str, Callable[[], Iterator[Row]]] = {
    f"Until clear, {STUDIES:,} studies": until_clear_rows,
    f"Equivalence, {STUDIES:,} studies": equivalence_rows,
    f"Where runs stall, {STALL_STUDIES:,} studies": stall_rows,
    f"R over trainings and 20 seeds, {TRAINED_STUDIES:,} studies": trainings_rows,
}

if __name__ == "__main__":
    for title, rows in TABLES.items():
        table = pd.DataFrame(rows()).to_string(float_format="{:.3f}".format, na_rep="")
        print(f"{title}:\n\n{table}\n")
