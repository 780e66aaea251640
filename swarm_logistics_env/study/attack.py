"""The search for the fault that costs most, within a budget of runs, with an estimate."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from swarm_logistics_env.core.errors import SetupError, StudyError, suggest
from swarm_logistics_env.core.progress_bar import ProgressBar
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.spi import Estimate, robustness
from swarm_logistics_env.study.questions.comparison import NO_FAULT, Arm
from swarm_logistics_env.study.runs.engines import Engine
from swarm_logistics_env.study.runs.store import Runs
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.study.verdicts.cell import Cell, same_runs
from swarm_logistics_env.world.scenario import ROLES, Scenario
from swarm_logistics_env.world.warehouse import FAILURE_MODES, Fault

# Plays pairs of a fault's index in the list and the number of its run, 0, 1, ..; returns the change
# of performance, P_F - P_o, of each: the lower, the worse the fault.
PlayRuns: TypeAlias = Callable[[Sequence[tuple[int, int]]], Sequence[float]]
Matrix: TypeAlias = NDArray[np.float64]

# Of the budget: faults at random, so that the model has something to learn from.
_FIRST_SHARE = 0.25
_ROUNDS = 8  # in which the rest is spent; the runs of one round are played side by side
# Shares of the variance between faults: by mode; by mode and role; by mode, onset and duration; by
# all of them.
_SHARES = (0.4, 0.2, 0.2, 0.2)
_NOISES = (0.1, 0.3, 1.0, 3.0)  # candidates for the variance between seeds over that between faults


def search(
    faults: Sequence[Fault], play: PlayRuns, budget: int, seed: int
) -> tuple[int, list[int]]:
    """Search by Thompson sampling from a Gaussian process over the faults.

    Faults that are alike (in mode, role, onset, duration) are expected to cost alike, so that a run
    of one tells of the others; the next faults are those that are worst in a draw from the
    posterior (Thompson 1933).

    Args:
        faults: to search among.
        budget: runs of faults, at least 1.
        seed: of the search's own choices.

    Returns:
        The index of the fault that is believed to be worst, and that of every run's fault.
    """
    rng = generator(seed, "fault search")
    covariance = _covariance(faults)
    tried: list[int] = []
    changes: list[float] = []

    def add(indices: NDArray[np.int64]) -> tuple[Matrix, Matrix]:
        """Play one more run of each of these faults; return the posterior after all runs."""
        pairs = []
        for index in indices.tolist():
            pairs.append((index, tried.count(index)))
            tried.append(index)
        changes.extend(play(pairs))
        return _posterior(covariance, np.array(tried), np.array(changes))

    first = max(1, round(budget * _FIRST_SHARE))
    mean, spread = add(rng.choice(len(faults), first, replace=first > len(faults)))
    sizes = np.diff(np.linspace(first, budget, _ROUNDS + 1).round().astype(int))
    for size in sizes[sizes > 0]:
        root = np.linalg.cholesky(spread + 1e-9 * np.eye(len(faults)))
        draws = mean[:, None] + root @ rng.standard_normal((len(faults), size))
        mean, spread = add(draws.argmin(axis=0))
    return min(set(tried), key=lambda index: float(mean[index])), tried


def _covariance(faults: Sequence[Fault]) -> Matrix:
    """Return how alike the faults are expected to be, (faults, faults), 1 on the diagonal."""

    def nearness(values: list[float]) -> Matrix:
        steps = np.searchsorted(np.unique(values), values)
        return np.asarray(np.exp(-0.5 * (steps[:, None] - steps) ** 2))

    mode, role = (np.array([str(getattr(f, name)) for f in faults]) for name in ("mode", "role"))
    durations = [np.inf if fault.duration is None else fault.duration for fault in faults]
    near_in_time = nearness([fault.onset for fault in faults]) * nearness(durations)
    equal_mode: Matrix = mode[:, None] == mode
    equal_role: Matrix = equal_mode & (role[:, None] == role)
    by_mode, by_role, by_time, by_all = _SHARES
    return (
        by_mode * equal_mode
        + by_role * equal_role
        + by_time * equal_mode * near_in_time
        + by_all * equal_role * near_in_time
    )


def _posterior(
    covariance: Matrix, tried: NDArray[np.int64], changes: Matrix
) -> tuple[Matrix, Matrix]:
    """Return mean (faults,) and covariance (faults, faults) of the changes, given the runs'.

    The noise is that under which the runs are likeliest; scale and mean are those of the runs.
    """
    centre = changes.mean()
    scale = max(float(changes.std()), 1e-6)
    normal = (changes - centre) / scale
    prior = covariance[np.ix_(tried, tried)]
    across = covariance[:, tried]

    roots = {
        noise: cho_factor((prior + noise * np.eye(len(tried))) / (1.0 + noise), lower=True)
        for noise in _NOISES
    }

    def likelihood(noise: float) -> float:
        fit = normal @ cho_solve(roots[noise], normal)
        return float(-0.5 * fit - np.log(np.diag(roots[noise][0])).sum())

    noise = max(_NOISES, key=likelihood)
    root = roots[noise]
    share = 1.0 / (1.0 + noise)
    mean = centre + scale * share * across @ cho_solve(root, normal)
    spread = share * covariance - share**2 * across @ cho_solve(root, across.T)
    return mean, scale**2 * spread


STORE = "runs.sqlite"
# A removed robot is the reference of the others, and one that is away is it for a while; motor_wear
# leaves more speed than motor_slow, and a late robot stands as a dead one does; only few
# controllers send messages, and few robots have batteries.
_NOT_TRIED = (
    "removed", "away", "motor_wear", "late", "message_frozen", "message_random", "message_lying",
    "cell_fades",
)  # fmt: skip
MODES = tuple(mode for mode in FAILURE_MODES if mode not in _NOT_TRIED)
_ONSETS = (0.0, 0.2, 0.4, 0.6)  # shares of an episode
_DURATIONS = (None, 0.2, 0.4)  # shares of an episode; None: for good
_NAMED_SEEDS = 5  # runs of each named mode, from which the worst is chosen


@dataclass(frozen=True)
class Attack:
    """What to search, and how long.

    Attributes:
        policy: as `policies.load` knows it, or a policy.
        scenario: conditions of every episode.
        robots: how many fail.
        modes: failure modes to search among.
        budget: runs of faults in the search.
        fresh: seeds of the estimates, none of which the search has met; at least 3.
        seed: of the search's own choices.
    """

    policy: object
    scenario: Scenario
    robots: int = 2
    modes: tuple[str, ...] = MODES
    budget: int = 200
    fresh: int = 30
    seed: int = 0

    def faults(self) -> list[Fault]:
        """Return all faults that are searched: every mode, role, onset and duration.

        Raises:
            SetupError: a mode is unknown, or there are fewer robots.
        """
        for mode in self.modes:
            if mode not in MODES:
                raise SetupError(f"modes: no mode {mode!r} to search{suggest(mode, MODES)}")
        if not 1 <= self.robots < self.scenario.n_robots:
            raise SetupError(f"robots = {self.robots}: should be 1 to {self.scenario.n_robots - 1}")
        end = self.scenario.duration
        return [
            Fault(
                mode,
                self.robots,
                onset=round(onset * end, 1),
                duration=None if lasts is None else round(lasts * end, 1),
                role=role,
            )
            for mode, role, onset, lasts in product(self.modes, (None, *ROLES), _ONSETS, _DURATIONS)
            # At the start nobody carries anything, and nobody stands in the delivery area.
            if onset > 0.0 or role in (None, "searching")
        ]


class WorstFault(NamedTuple):
    """A fault, how it was found, and its robustness on fresh seeds.

    Attributes:
        by: "search" or "named modes".
        runs: how many runs of faults it took.
    """

    by: str
    fault: Fault
    robustness: Estimate
    runs: int


class AttackResult(NamedTuple):
    """The worst faults found, the search's first.

    Attributes:
        tried: how many different faults the search has tried.
        searched: how many there were to search.
        is_capped: whether every item was delivered in a run without a fault on a fresh seed, so
            that the faults may cost more than R tells.
    """

    found: tuple[WorstFault, ...]
    tried: int
    searched: int
    is_capped: bool


def attack(settings: Attack, engine: Engine, out: Path) -> AttackResult:
    """Search for the worst fault, and estimate its robustness on fresh seeds.

    What it finds bounds the worst fault from one side: there may be worse ones. Every run is kept
    in `out` at once, and the same call goes on from there.

    Raises:
        SetupError: as `Attack.faults`; or the policy delivers nothing without faults.
        PolicyError: there is no such policy.
        StudyError: the directory cannot be used, or a run failed.
    """
    faults = settings.faults()
    policy = PolicySpec.of(settings.policy)
    base = Case(policy, policy.identity(), settings.scenario, task=WAREHOUSE)
    n_named = len(settings.modes) * _NAMED_SEEDS
    # Without a fault at most as many as with one; the estimates are of three conditions.
    n_runs = 2 * settings.budget + n_named + 3 * settings.fresh
    with (
        Runs(out / STORE) as store,
        ProgressBar("attack", n_runs, "runs at most", done=len(store.succeeded())) as progress,
    ):
        if damage := store.discard_damaged():
            warnings.warn(f"{damage}: what is asked is played again", stacklevel=2)

        def count_deliveries(pairs: Sequence[tuple[Fault | None, int]]) -> Matrix:
            outcomes = _outcomes(base, engine, store, pairs, progress)
            return np.array([outcome.delivered for outcome in outcomes], np.float64)

        def play(pairs: Sequence[tuple[int, int]]) -> Sequence[float]:
            """Play a fault's k-th run with seed k, beside the run without a fault."""
            seeds = [seed for _, seed in pairs]
            n_seeds = max(*seeds, _NAMED_SEEDS - 1) + 1
            sound = count_deliveries([(None, seed) for seed in range(n_seeds)])
            if not sound.any():
                raise SetupError(
                    f"{policy.title} delivers nothing without faults, so no fault can cost "
                    "anything: should be another policy, a longer duration or more robots"
                )
            failed = count_deliveries([(faults[index], seed) for index, seed in pairs])
            return list(failed - sound[seeds])

        worst, tried = search(faults, play, settings.budget, settings.seed)
        named = [Fault(mode, settings.robots) for mode in settings.modes]
        tries = count_deliveries([*product(named, range(_NAMED_SEEDS))]).reshape(len(named), -1)
        worst_named = named[int(tries.mean(axis=1).argmin())]
        conditions = (None, faults[worst], worst_named)
        # Seeds that neither the search can have met, nor the choice among the named modes.
        first = max(settings.budget, _NAMED_SEEDS)
        fresh = range(first, first + settings.fresh)
        outcomes = iter(_outcomes(base, engine, store, [*product(conditions, fresh)], progress))
        arm = Arm(NO_FAULT, base)
        without_fault, with_worst, with_named = [
            Cell.of("", "", arm, [*islice(outcomes, len(fresh))]) for _ in conditions
        ]
    by_search = _robustness(settings, without_fault, with_worst)
    by_name = _robustness(settings, without_fault, with_named)
    faults_found = (
        WorstFault("search", faults[worst], by_search, settings.budget),
        WorstFault("named modes", worst_named, by_name, tries.size),
    )
    return AttackResult(faults_found, len(set(tried)), len(faults), without_fault.saturated)


def _robustness(settings: Attack, sound: Cell, failed: Cell) -> Estimate:
    return robustness(
        sound.by_seed,
        failed.by_seed,
        n=settings.scenario.n_robots,
        m=settings.robots,
        saturated=[name for name, runs in (("p_o", sound), ("p_f", failed)) if runs.saturated],
        identical=same_runs(sound.outcomes, failed.outcomes),
    )


def _outcomes(
    base: Case,
    engine: Engine,
    store: Runs,
    pairs: Sequence[tuple[Fault | None, int]],
    progress: ProgressBar,
) -> list[Outcome]:
    """Return the outcomes of faults (None: without one) at seeds; play what is not in the store."""
    code = WAREHOUSE.code()
    runs = [
        Run(replace(base, faults=() if fault is None else (fault,)), code, seed)
        for fault, seed in pairs
    ]
    finished = store.succeeded()
    missing = {run.key: run for run in runs if run.key not in finished}
    for n_played, (run, outcome) in enumerate(engine(missing.values()), start=1):
        store.add([(run, outcome)])
        progress.reach(len(finished) + n_played)
        if outcome.error is not None:
            raise StudyError(f"a run failed: {outcome.error.strip().splitlines()[-1]}")
    outcomes = store.outcomes(runs)
    return [outcomes[run.case.key, run.seed] for run in runs]
