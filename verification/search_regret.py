"""How near the search for the worst fault comes to it: `python -m verification.search_regret`.

Every fault of a small world is played by brute force. Half of the seeds are for the searches, the
other half tells how much worse than the fault found the worst one is. It takes about two minutes.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from swarm_logistics_env import Fault, Scenario, policies, run_episode
from swarm_logistics_env.attack import random_search, search

SCENARIO = Scenario(
    n_robots=6,
    warehouse_width=5.0,
    warehouse_height=5.0,
    delivery_width=1.5,
    n_items=8,
    restock=True,
    duration=100.0,
)
MODES = ("FM1", "FM2", "FM3", "FM4", "FM4_jam", "motor_dead", "dead")
FAULTS = [
    Fault(mode, 2, onset=onset, duration=lasts, role=role)
    for mode, role, onset, lasts in product(
        MODES, ("carrier", "searching", "in_area"), (0.0, 30.0, 60.0), (None, 20.0)
    )
    if onset > 0.0 or role == "searching"
]
SEEDS, REPETITIONS, BUDGETS = 40, 60, (40, 80, 120)


def main() -> None:
    """Print the mean regret of both searches for each budget."""
    policy = policies.load("swarm-dt")
    sound = np.array([run_episode(SCENARIO, policy, seed).delivered for seed in range(SEEDS)])
    failed = np.array(
        [
            [run_episode(SCENARIO, policy, seed, [fault]).delivered for seed in range(SEEDS)]
            for fault in FAULTS
        ]
    )
    change, half = (failed - sound) / sound.mean(), SEEDS // 2
    fresh = change[:, half:].mean(axis=1)
    print(f"{len(FAULTS)} faults; the worst changes P by {fresh.min():.3f} on fresh seeds")
    for budget in BUDGETS:
        for name, way in (("search", search), ("random search", random_search)):
            regrets = []
            for seed in range(REPETITIONS):
                order = np.random.default_rng(seed).permutation(half)

                def play(
                    pairs: Sequence[tuple[int, int]], order: np.ndarray = order
                ) -> list[float]:
                    return [float(change[place, order[k % half]]) for place, k in pairs]

                worst, _ = way(FAULTS, play, budget, seed)
                regrets.append(fresh[worst] - fresh.min())
            error = np.std(regrets, ddof=1) / np.sqrt(REPETITIONS)
            print(f"{budget:3} runs, {name}: regret {np.mean(regrets):.3f} +- {error:.3f}")


if __name__ == "__main__":
    main()
