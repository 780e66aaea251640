"""Evaluation of the policy in training, by the same episodes as any other policy."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.episode import run_episode
from swarm_logistics_env.policies import Policy
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.train.settings import Evaluation
from swarm_logistics_env.warehouse import Fault

# Scores are measured on seeds 0, 1, .. and trainings use seeds of 63 bits: these are neither.
FIRST_SEED = 1_000_000


@dataclass(frozen=True)
class Evaluated:
    """Means over the evaluation's seeds.

    Attributes:
        performance: P without faults [items].
        under_faults: mode -> P_F [items].
        robustness: mode -> R; nan where nothing was delivered without faults.
    """

    performance: float
    under_faults: dict[str, float]
    robustness: dict[str, float]

    def __str__(self) -> str:
        shown = [f"R({mode}) = {value:+.2f}" for mode, value in self.robustness.items()]
        return ", ".join([f"P = {self.performance:.1f}", *shown])


def evaluate(policy: Policy, scenario: Scenario, asked: Evaluation, threads: int = 1) -> Evaluated:
    """Play `policy` on the evaluation's seeds, without faults and with each of its faults."""
    scenario = scenario.replace(n_robots=asked.n_robots)
    kinds: list[Sequence[Fault]] = [(), *((Fault(m, k),) for m, k in asked.faults.items())]
    seeds = range(FIRST_SEED, FIRST_SEED + asked.seeds)
    p_o, *p_f = performances(policy, scenario, kinds, seeds, threads)
    by_mode = dict(zip(asked.faults, p_f))
    return Evaluated(
        performance=float(p_o.mean()),
        under_faults={mode: float(p.mean()) for mode, p in by_mode.items()},
        robustness={
            mode: _robustness(p_o, p, asked.n_robots, asked.faults[mode])
            for mode, p in by_mode.items()
        },
    )


def performances(
    policy: Policy,
    scenario: Scenario,
    kinds: Sequence[Sequence[Fault]],
    seeds: Sequence[int],
    threads: int = 1,
) -> NDArray[np.float64]:
    """Return P under each kind of faults at each seed (kinds, seeds) [items]."""
    jobs = [(faults, seed) for faults in kinds for seed in seeds]

    def played(job: tuple[Sequence[Fault], int]) -> int:
        faults, seed = job
        # Each episode gets a copy of the policy, because a policy may remember robots.
        return run_episode(scenario, deepcopy(policy), seed, faults).delivered

    with ThreadPoolExecutor(threads) as pool:
        delivered = np.array(list(pool.map(played, jobs)), np.float64)
    return delivered.reshape(len(kinds), len(seeds))


def _robustness(p_o: NDArray[np.float64], p_f: NDArray[np.float64], n: int, m: int) -> float:
    return spi.robustness(p_o, p_f, n=n, m=m).value if p_o.any() else float("nan")
