"""Evaluation of the policy in training, by the same episodes as any other policy."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import deepcopy
from typing import NamedTuple

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


class Evaluated(NamedTuple):
    """What was delivered on the evaluation's seeds.

    Attributes:
        n_robots: the swarm size N.
        faults: mode -> number m of faulty robots.
        p_o: P_o of each seed, without faults (seeds,) [items].
        p_f: mode -> P_F of each seed (seeds,) [items].
    """

    n_robots: int
    faults: dict[str, int]
    p_o: NDArray[np.float64]
    p_f: dict[str, NDArray[np.float64]]

    def robustness(self, mode: str) -> float:
        """Return R; nan where nothing was delivered without faults."""
        if not self.p_o.any():
            return float("nan")
        return spi.robustness(self.p_o, self.p_f[mode], n=self.n_robots, m=self.faults[mode]).value

    def fault_tolerance(self, mode: str) -> float:
        """Return FT, by the same robots "removed"; nan where nothing was delivered without."""
        if not self.p_o.any():
            return float("nan")
        return spi.fault_tolerance(self.p_o, self.p_f[mode], self.p_f["removed"]).value

    def means(self) -> dict[str, float]:
        """Return the mean P, and for each mode the mean P_F and R: "P", "P_FM1", "R_FM1"."""
        means = {"P": float(self.p_o.mean())}
        for mode, p_f in self.p_f.items():
            means |= {f"P_{mode}": float(p_f.mean()), f"R_{mode}": self.robustness(mode)}
        return means


def evaluate(policy: Policy, scenario: Scenario, asked: Evaluation, threads: int = 1) -> Evaluated:
    """Play `policy` on the evaluation's seeds, without faults and with each of its faults."""
    scenario = scenario.replace(n_robots=asked.n_robots)
    kinds: list[Sequence[Fault]] = [(), *((Fault(m, k),) for m, k in asked.faults.items())]
    seeds = range(FIRST_SEED, FIRST_SEED + asked.seeds)
    p_o, *p_f = performances(policy, scenario, kinds, seeds, threads)
    return Evaluated(asked.n_robots, asked.faults, p_o, dict(zip(asked.faults, p_f)))


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
