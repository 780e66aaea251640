"""How often verdicts are wrong, and how often they tell: `python -m verification.verdict_errors`.

It simulates studies in worlds whose truth is known: paired and not, until they are clear, with runs
that stall, and over trainings. The runs come from two halves of `generators`: the constants of the
test were chosen on the one, and the documents quote the other. It prints tables and writes
`docs/results/verdict_errors.csv`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from swarm_logistics_env import spi
from swarm_logistics_env.spi.hidden import hidden_of
from swarm_logistics_env.spi.ratio import Balance, Design, RatioTest, Term, ratio_test
from swarm_logistics_env.study.questions.specification import looks_up_to

from .generators import CHOSEN_ON, HELD_OUT, LEARNED_P, OF_POLICIES, P_O, Floats, Rng, Shape

STUDIES = 4_000
TRAINED_STUDIES = 1_000
EDGE = 0.1
REMOVED, ROBOTS = 3, 25
LEFT = 0.02  # of P, by a training that collapsed
FILE = Path(__file__).parents[1] / "docs" / "results" / "verdict_errors.csv"

Row = dict[str, object]


HALVES = {"chosen on": CHOSEN_ON, "held out": HELD_OUT}
_ALL = {**CHOSEN_ON, **HELD_OUT, **OF_POLICIES}


class World(NamedTuple):
    """How trainings differ: P, and what is left of it under the fault, and how many collapse.

    Attributes:
        spread: Standard deviation of ln P between trainings.
        of_ratio: The same of ln(P_F / P_o).
        counts: Counts around the mean of each training and seed.
        collapse: Share of trainings that deliver next to nothing under the fault.
        p_o: True mean without faults [items].
    """

    spread: float
    of_ratio: float
    counts: Callable[[Rng, Floats], Floats]
    collapse: float = 0.0
    p_o: float = LEARNED_P


def _by_poisson(rng: Rng, mean: Floats) -> Floats:
    return rng.poisson(mean) * 1.0


def _by_gamma(rng: Rng, mean: Floats) -> Floats:
    return rng.poisson(mean * rng.gamma(4.0, 0.25, mean.shape)) * 1.0


def _by_geometric(rng: Rng, mean: Floats) -> Floats:
    return rng.geometric(1 / (1 + mean)) - 1.0


WORLDS: Mapping[str, World] = {
    "sd .1, Poisson": World(0.1, 0.0, _by_poisson),
    "sd .1, R sd .1": World(0.1, 0.1, _by_poisson),
    "sd .3, R sd .05": World(0.3, 0.05, _by_poisson),
    "sd .1, R sd .05, overdispersed": World(0.1, 0.05, _by_gamma),
    "low P 20, sd .2, overdispersed": World(0.2, 0.0, _by_gamma, p_o=20.0),
    "1 in 5 collapses": World(0.1, 0.0, _by_poisson, 0.2),
    "1 in 10 collapses": World(0.1, 0.0, _by_poisson, 0.1),
    "1 in 5 collapses, R sd .1": World(0.1, 0.1, _by_poisson, 0.2),
    "1 in 3 collapses": World(0.1, 0.05, _by_poisson, 1 / 3),
    "sd .1, geometric": World(0.1, 0.1, _by_geometric, p_o=P_O),
}


def judged(
    p_o: Floats, p_new: Floats, threshold: float, confidence: float = 0.95, *, paired: bool = True
) -> RatioTest[Any]:
    """Return the test of the relative change of P, as studies make it; samples (studies, n)."""
    terms = [Term(p_new, 1.0, 0.0), Term(p_o, -1.0, 1.0)]
    hidden = hidden_of([p_new, p_o], trainings=False)
    return ratio_test(
        terms, Design(paired), hidden, offset=0.0, threshold=threshold, confidence=confidence
    )


def _p_values(
    p_o: Floats, p_new: Floats, threshold: float, most: float, *, paired: bool, only_seen: bool
) -> tuple[Floats, Floats]:
    """Return p of each study, where it may be below `most`, and on which side it leans (1, -1)."""
    terms = [Term(p_new, 1.0, 0.0), Term(p_o, -1.0, 1.0)]
    balance = Balance.at(threshold, terms, Design(paired))
    p = np.minimum(1.0, 2.0 * np.minimum(balance.p(1), balance.p(-1)))
    side = np.sign(balance.above - balance.below)
    # Where the interval of P_o reaches 0 nothing is tested.
    n = p_o.shape[-1]
    half = stdtrit(n - 1, 0.975) * p_o.std(axis=-1, ddof=1) / np.sqrt(n)
    p[p_o.mean(axis=-1) <= half] = 1.0
    if not only_seen:
        # p with what may be hidden is larger still, so that only these are asked for it.
        unclear = np.flatnonzero(p < most)
        p[unclear] = judged(p_o[unclear], p_new[unclear], threshold, paired=paired).p_value
    return p, side


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
    paired: bool = True,
    only_seen: bool = False,
    is_equal: bool = False,
) -> Wrong:
    """Return how often a study that runs until it is clear decides at the true value.

    It may stop at each look, a number of seeds; one look: a study of so many. `alpha` is over all
    looks; with `only_seen` stalls that no run showed are left out of account; with `is_equal` P is
    the same in both conditions, as of two policies of which neither delivers more.
    """
    draw, mean_o, mean_f = _ALL[model]
    if is_equal:
        mean_f = mean_o
    rng = np.random.default_rng(looks)
    p_o, p_new = draw(rng, (studies, looks[-1]), mean_f)
    if not paired:  # other seeds, so that nothing hangs together
        _, p_new = draw(rng, (studies, looks[-1]), mean_f)
    running = np.arange(studies)
    above = below = 0
    for n, level in zip(looks, spi.look_alphas(looks, alpha)):
        samples = p_o[running, :n], p_new[running, :n]
        truth = mean_f / mean_o - 1
        p, side = _p_values(*samples, truth, level, paired=paired, only_seen=only_seen)
        above += int((side[p < level] > 0.0).sum())
        below += int((side[p < level] < 0.0).sum())
        running = running[p >= level]
    return Wrong((above + below) / studies, above / studies, below / studies)


def share_equivalent(
    model: str,
    n: int,
    change: float,
    studies: int = STUDIES,
    *,
    paired: bool = True,
    only_seen: bool = False,
) -> float:
    """Return the share of studies of n seeds that are called equivalent, at a true change of P."""
    draw, mean_o, _ = _ALL[model]
    p_o, p_new = draw(np.random.default_rng(n), (studies, n), mean_o * (1 + change))
    rejected = np.ones(studies, bool)
    for edge in (-EDGE, EDGE):
        p, side = _p_values(p_o, p_new, edge, 0.1, paired=paired, only_seen=only_seen)
        rejected &= (p < 0.1) & (side * edge < 0.0)
    return float(rejected.mean())


def share_supported(
    p: float, robustness: float, n: int, studies: int = STUDIES, *, paired: bool = True
) -> float:
    """Return the share of studies that support R > 0, at a true R and Poisson counts of mean P."""
    rng, left = np.random.default_rng(n), 1.0 - REMOVED / ROBOTS
    p_o, p_f = (rng.poisson(mean, (studies, n)) * 1.0 for mean in (p, p * (robustness + left)))
    p_values, side = _p_values(p_o, p_f, left - 1.0, 0.05, paired=paired, only_seen=False)
    return float(((p_values < 0.05) & (side > 0.0)).mean())


class OverTrainings(NamedTuple):
    """Shares of studies whose verdict is "supported" or "refuted", and whose interval holds R."""

    supported: float
    refuted: float
    coverage: float
    width: float


def over_trainings(
    name: str,
    trainings: int,
    seeds: int,
    studies: int = TRAINED_STUDIES,
    *,
    robustness: float = 0.0,
    threshold: float | None = None,
) -> OverTrainings:
    """Judge R over trainings and seeds in a world of that name; .2 is the spread between seeds.

    Args:
        robustness: The true R, with the trainings that collapse.
        threshold: That R is tested against; None: the true R, where each verdict is wrong.
    """
    world, rng = WORLDS[name], np.random.default_rng([trainings, seeds])
    ratio = 1.0 + robustness - REMOVED / ROBOTS
    working = ratio / (1.0 - world.collapse * (1.0 - LEFT))

    def factor(shape: Shape, sd: float) -> Floats:
        return np.asarray(np.exp(sd * rng.standard_normal(shape) - sd**2 / 2))

    by_training, by_seed = (studies, trainings, 1), (studies, 1, seeds)
    mean = world.p_o * factor(by_training, world.spread) * factor(by_seed, 0.2)
    has_collapsed = rng.random(by_training) < world.collapse
    left = working * np.where(has_collapsed, LEFT, factor(by_training, world.of_ratio))
    p_o, p_f = (world.counts(rng, m) for m in (mean, mean * left * factor(by_seed, 0.05)))
    terms = [Term(p_f, 1.0, 0.0), Term(p_o, -1.0, 1.0)]
    test = ratio_test(
        terms,
        Design(trainings=True),
        hidden_of([p_f, p_o], trainings=True),
        offset=REMOVED / ROBOTS,
        threshold=robustness if threshold is None else threshold,
        confidence=0.95,
    )
    decided = test.p_value < 0.05
    return OverTrainings(
        float((decided & (test.mean_difference > 0.0)).mean()),
        float((decided & (test.mean_difference < 0.0)).mean()),
        float(((test.low <= robustness) & (robustness <= test.high)).mean()),
        float(np.median(test.high - test.low)),
    )


def verdict_rows() -> Iterator[Row]:
    """Yield the errors of studies of so many seeds at the true value, paired and not."""
    for half, models in HALVES.items():
        for model, paired, n in product(models, (True, False), (5, 6, 10, 20, 30, 60)):
            wrong = wrong_verdicts(model, [n], paired=paired)
            row: Row = {"half": half, "runs": model, "paired": paired, "seeds": n}
            yield {**row, "supported": wrong.above, "refuted": wrong.below}


def looks_rows() -> Iterator[Row]:
    """Yield the errors of studies that run until they are clear."""
    for half, models in HALVES.items():
        for model, most in product(models, (60, 200)):
            wrong = wrong_verdicts(model, looks_up_to(most))
            row: Row = {"half": half, "runs": model, "most": most}
            yield {**row, "supported": wrong.above, "refuted": wrong.below}


def policies_rows() -> Iterator[Row]:
    """Yield how often one of two policies is said to deliver more where both deliver as much."""
    for model, paired, n in product(_ALL, (True, False), (3, 5, 10, 20, 60)):
        wrong = wrong_verdicts(model, [n], paired=paired, is_equal=True)
        row: Row = {"runs": model, "paired": paired, "seeds": n}
        yield {**row, "supported": wrong.above, "refuted": wrong.below}


def equivalence_rows() -> Iterator[Row]:
    """Yield how often P that falls by a tenth is called equivalent, and P that does not change."""
    beyond = "10% stall: beyond the assumption"
    models = ("poisson", "overdispersed", "0% stall", "5% stall", "5% stall, P 39", beyond)
    for model, paired, n in product(models, (True, False), (5, 6, 10, 20, 60)):
        at = {"at_the_edge": -EDGE, "unchanged": 0.0}
        shares = {name: share_equivalent(model, n, by, paired=paired) for name, by in at.items()}
        yield {"runs": model, "paired": paired, "seeds": n, **shares}


def power_rows() -> Iterator[Row]:
    """Yield how often R > 0 is supported."""
    for p, robustness, paired in product((39, 150, 400), (0.04, 0.08, 0.12), (True, False)):
        row: Row = {"p": p, "true_r": robustness, "paired": paired}
        for n in (5, 6, 10, 20, 30, 60):
            row[f"seeds_{n}"] = share_supported(p, robustness, n, paired=paired)
        yield row


def trainings_rows() -> Iterator[Row]:
    """Yield the errors over trainings, and how often a true R of 0.3 is supported."""
    for world, trainings, seeds in product(WORLDS, (5, 7, 10, 20), (6, 20)):
        row: Row = {"world": world, "trainings": trainings, "seeds": seeds}
        row |= over_trainings(world, trainings, seeds)._asdict()
        shares = over_trainings(world, trainings, seeds, robustness=0.3, threshold=0.0)
        yield {**row, "supported_at_r_0.3": shares.supported}


TABLES = {
    "wrong verdicts": verdict_rows,
    "wrong verdicts until clear": looks_rows,
    "two policies": policies_rows,
    "equivalent": equivalence_rows,
    "supported": power_rows,
    "over trainings": trainings_rows,
}

if __name__ == "__main__":
    tables = []
    for title, rows in TABLES.items():
        table = pd.DataFrame(rows())
        text = table.to_string(float_format="{:.3f}".format, na_rep="", index=False)
        print(f"{title}:\n\n{text}\n", flush=True)
        tables.append(table.assign(table=title))
    together = pd.concat(tables)
    columns = ["table", *together.columns.drop("table")]
    together.to_csv(FILE, columns=columns, index=False, float_format="%.3f")
