"""Search the constants of Swarm D-T for deliveries and robustness at once.

Each round tries constants around the best so far, in ever smaller steps. The winner of many tries
looks better than it is, so it is measured once more, on seeds that the search has not met.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from swarm_logistics_env import Fault, Scenario, policies, run_episode, spi
from swarm_logistics_env.core import streams

# Constant -> the range in which it is searched.
RANGES = {
    "diffusion": (0.05, 3.0),
    "avoidance_gain": (0.0, 5.0),
    "avoidance_range": (0.25, 1.0),
    "wall_distance": (0.13, 0.6),
    "taxis_gain": (0.1, 3.0),
    "drop_rate": (0.1, 10.0),
}
FAULT, M = "FM2", 2


def performance(constants, scenario, seeds, faults=()):
    """Return P of each seed."""

    def deliveries(seed):
        policy = policies.load("swarm-dt", **constants)
        return run_episode(scenario, policy, seed, faults).delivered

    with ThreadPoolExecutor() as pool:
        return list(pool.map(deliveries, seeds))


def worth(constants, scenario, seeds):
    """Return what is maximised: mean P without faults and mean P with them, added."""
    p_o = performance(constants, scenario, seeds)
    p_f = performance(constants, scenario, seeds, [Fault(FAULT, M)])
    return np.mean(p_o) + np.mean(p_f)


def main(rounds=30, seeds=8, confirm=30, scenario=None):
    """Search, print the best constants, and return the change of P that they make."""
    scenario = scenario or Scenario(restock=True)
    defaults = policies.SwarmDT().parameters
    best = {name: getattr(defaults, name) for name in RANGES}
    highest = worth(best, scenario, range(1000, 1000 + seeds))
    for number in range(rounds):
        draw = streams.generator(number, "tune")
        step = 0.3 * 0.95**number  # share of each range
        candidate = {
            name: float(np.clip(best[name] + step * (high - low) * draw.normal(), low, high))
            for name, (low, high) in RANGES.items()
        }
        candidate_worth = worth(candidate, scenario, range(1000, 1000 + seeds))
        print(f"round {number}: {candidate_worth:.1f} (best so far {highest:.1f})")
        if candidate_worth > highest:
            best = candidate
            highest = candidate_worth
    before = performance({}, scenario, range(confirm))
    after = performance(best, scenario, range(confirm))
    change = spi.relative_change(before, after)
    print(best, change, sep="\n")
    return change


if __name__ == "__main__":
    main()
