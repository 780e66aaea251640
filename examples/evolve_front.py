"""Evolve the constants of Swarm D-T for deliveries P and robustness R: a front of both.

CMA-ES (pip install cma) maximises P / P_start + price * R, once for each price of robustness. What
a search ends with looks better than it is, so every point is measured on seeds that no search met.
"""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import cma
import matplotlib.pyplot as plt
import numpy as np

from swarm_logistics_env import Scenario, policies, run_episode, spi

# Constant -> its start, and the range in which it is searched, by its logarithm.
CONSTANTS = {
    "diffusion": (0.07, 0.01, 3.0),
    "avoidance_gain": (0.86, 0.1, 5.0),
    "taxis_gain": (0.30, 0.05, 3.0),
    "drop_rate": (0.78, 0.05, 10.0),
}
START, LOW, HIGH = np.log(list(CONSTANTS.values())).T
SCENARIO = Scenario(n_robots=10, warehouse_width=8.0, warehouse_height=7.0, n_items=22,
                    duration=250.0, restock=True)  # fmt: skip
MODE, M = "FM4", 2  # two robots that lift items, and cannot deliver them


def deliveries(logarithms, seed, faults):
    constants = dict(zip(CONSTANTS, np.exp(logarithms).tolist()))
    return run_episode(SCENARIO, policies.load("swarm-dt", **constants), seed, faults).delivered


def measure(logarithms, seeds):
    """Return P without faults (seeds,), and R with its interval."""
    with ThreadPoolExecutor() as pool:
        p_o = list(pool.map(lambda seed: deliveries(logarithms, seed, []), seeds))
        p_f = list(pool.map(lambda seed: deliveries(logarithms, seed, [f"{MODE}:{M}"]), seeds))
    return p_o, spi.robustness(p_o, p_f, n=SCENARIO.n_robots, m=M)


def cost(logarithms, price, seeds, p_start):
    p_o, robustness = measure(logarithms, seeds)
    return -(np.mean(p_o) / p_start + price * robustness.value)


def main(prices=(0.0, 1.0, 4.0), evaluations=100, seeds=6, fresh=30, out="front.png"):
    searched, new = range(1000, 1000 + seeds), range(5000, 5000 + fresh)
    p_start = np.mean(measure(START, searched)[0])
    points = {"start": START}
    for price in prices:
        options = {"bounds": [LOW, HIGH], "maxfevals": evaluations, "seed": 1, "verbose": -9}
        search = cma.CMAEvolutionStrategy(START, 0.5, options)
        search.optimize(partial(cost, price=price, seeds=searched, p_start=p_start))
        points[f"price of R {price:g}"] = search.result.xfavorite
    figure, axes = plt.subplots(figsize=(5.0, 3.5), layout="constrained")
    front = {}
    for name, logarithms in points.items():
        p_o, robustness = front[name] = measure(logarithms, new)
        mean = spi.mean_interval(p_o)
        # Where there is no limit it is NaN, which no line is drawn to.
        p, p_low, p_high = np.array([mean.value, mean.low, mean.high], float)
        r, r_low, r_high = np.array([robustness.value, robustness.low, robustness.high], float)
        axes.plot([r_low, r_high], [p, p], "-", [r, r], [p_low, p_high], "-", color="grey")
        axes.plot(r, p, "o", label=name)
        constants = dict(zip(CONSTANTS, np.exp(logarithms).round(2).tolist()))
        print(f"{name}: P {p:.1f} [{p_low:.1f}, {p_high:.1f}], "
              f"R {r:.2f} [{r_low:.2f}, {r_high:.2f}], {constants}")  # fmt: skip
    axes.set(xlabel=f"robustness R, {MODE}, m = {M}", ylabel="P [items]")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))  # beside the axes, over no interval
    figure.savefig(Path(out), dpi=200, bbox_inches="tight")
    return front


if __name__ == "__main__":
    main()
