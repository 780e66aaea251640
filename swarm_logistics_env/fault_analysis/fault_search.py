"""Search for the fault that costs most, among many that could strike, within a budget of runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from swarm_logistics_env.streams import generator
from swarm_logistics_env.warehouse import Fault

# Plays pairs of a fault's place in the list and the number of its run, 0, 1, ..; returns the change
# of performance, P_F - P_o, of each: the lower, the worse the fault.
Play: TypeAlias = Callable[[Sequence[tuple[int, int]]], Sequence[float]]

_FIRST_SHARE = (
    0.25  # of the budget: faults at random, so that the model has something to learn from
)
_ROUNDS = 8  # in which the rest is spent; the runs of one round are played side by side
_SEEDS_AT_RANDOM = 2  # runs of each fault in a random search, to tell faults from luck
# Shares of the variance between faults: by mode; by mode and role; by mode, onset and duration; by
# all of them.
_SHARES = (0.4, 0.2, 0.2, 0.2)
_NOISES = (0.1, 0.3, 1.0, 3.0)  # candidates for the variance between seeds over that between faults


@dataclass
class Trials:
    """The runs of a search so far.

    Attributes:
        tried: place of the fault of each run in the list of faults.
        change: P_F - P_o of each run [items].
    """

    tried: list[int] = field(default_factory=list)
    change: list[float] = field(default_factory=list)

    def add(self, places: Sequence[int], play: Play) -> None:
        """Play one more run of each of these faults."""
        pairs: list[tuple[int, int]] = []
        for place in places:
            earlier = [place_before for place_before, _ in pairs]
            pairs.append((place, self.tried.count(place) + earlier.count(place)))
        self.change += [float(change) for change in play(pairs)]
        self.tried += [place for place, _ in pairs]


def search(faults: Sequence[Fault], play: Play, budget: int, seed: int) -> tuple[int, Trials]:
    """Search by Thompson sampling from a Gaussian process over the faults.

    Faults that are alike (in mode, role, onset, duration) are expected to cost alike, so that a run
    of one tells of the others; the next faults are those that are worst in a draw from what is
    believed (Thompson 1933).

    Args:
        faults: to search among.
        budget: runs of faults, at least 1.
        seed: of the search's own choices.

    Returns:
        The place of the fault that is believed to be worst, and all runs.
    """
    rng = generator(seed, "fault search")
    trials, covariance = Trials(), _covariance(faults)
    first = max(1, round(budget * _FIRST_SHARE))
    trials.add([int(p) for p in rng.choice(len(faults), first, replace=first > len(faults))], play)
    sizes = np.diff(np.linspace(first, budget, _ROUNDS + 1).round().astype(int))
    for size in sizes[sizes > 0]:
        mean, spread = _posterior(covariance, trials)
        root = np.linalg.cholesky(spread + 1e-9 * np.eye(len(faults)))
        draws = mean[:, None] + root @ rng.standard_normal((len(faults), size))
        trials.add([int(place) for place in draws.argmin(axis=0)], play)
    mean, _ = _posterior(covariance, trials)
    return min(set(trials.tried), key=lambda place: float(mean[place])), trials


def random_search(
    faults: Sequence[Fault], play: Play, budget: int, seed: int
) -> tuple[int, Trials]:
    """Try faults at random, each over some seeds, within the same budget; for comparison.

    Returns:
        The place of the fault with the lowest mean, and all runs.
    """
    rng, trials = generator(seed, "random fault search"), Trials()
    count = min(len(faults), max(1, budget // _SEEDS_AT_RANDOM))
    chosen = [int(place) for place in rng.choice(len(faults), count, replace=False)]
    trials.add([chosen[number % count] for number in range(budget)], play)
    tried, change = np.array(trials.tried), np.array(trials.change)
    return min(chosen, key=lambda place: float(change[tried == place].mean())), trials


def _covariance(faults: Sequence[Fault]) -> NDArray[np.float64]:
    """Return how alike the faults are expected to be, (faults, faults), 1 on the diagonal."""

    def are_equal(values: Sequence[object]) -> NDArray[np.bool_]:
        return np.array([[one == other for other in values] for one in values])

    def near(values: Sequence[float]) -> NDArray[np.float64]:
        steps = np.searchsorted(np.unique(values), values)
        alike: NDArray[np.float64] = np.exp(-0.5 * (steps[:, None] - steps[None, :]) ** 2)
        return alike

    mode, role = (are_equal([getattr(f, name) for f in faults]) for name in ("mode", "role"))
    lasting = near([np.inf if fault.duration is None else fault.duration for fault in faults])
    time = near([fault.onset for fault in faults]) * lasting
    both = mode & role
    by_mode, by_role, by_time, by_all = _SHARES
    return by_mode * mode + by_role * both + by_time * mode * time + by_all * both * time


def _posterior(
    covariance: NDArray[np.float64], trials: Trials
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean (faults,) and covariance (faults, faults) of what the runs let one believe.

    The noise is that under which the runs are likeliest; scale and mean are those of the runs.
    """
    tried, change = np.array(trials.tried), np.array(trials.change)
    centre, scale = change.mean(), max(float(change.std()), 1e-6)
    normal = (change - centre) / scale
    prior, across = covariance[np.ix_(tried, tried)], covariance[:, tried]

    def factor(noise: float) -> tuple[NDArray[np.float64], bool]:
        made: tuple[NDArray[np.float64], bool] = cho_factor(
            (prior + noise * np.eye(len(tried))) / (1.0 + noise), lower=True
        )
        return made

    def likelihood(noise: float) -> float:
        root = factor(noise)
        fit = normal @ cho_solve(root, normal)
        return float(-0.5 * fit - np.log(np.diag(root[0])).sum())

    noise = max(_NOISES, key=likelihood)
    root, share = factor(noise), 1.0 / (1.0 + noise)
    mean = centre + scale * share * across @ cho_solve(root, normal)
    spread = share * covariance - share**2 * across @ cho_solve(root, across.T)
    return mean, scale**2 * spread
