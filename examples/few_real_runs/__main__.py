"""Few real runs with many simulated ones: how often the interval is right, and how much narrower.

The world with differential drive, noisy sensors and drifting headings (the preset `realistic`)
stands for reality, the paper's world for its simulator. Both met the same 120 set-ups, which
differ in the warehouse, the items and the delivery area; in simulation each twice. Studies
of a few real runs are drawn from them; P of 20 robots, and S from 10 to 20, are estimated from the
real runs alone and with simulation.

    python examples/few_real_runs           # from the runs that are kept beside this file
    python examples/few_real_runs --play    # play them anew: about ten minutes on two cores
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from swarm_logistics_env import Scenario, policies, run_episode, spi
from swarm_logistics_env.spi.ratio import paired_ratio
from swarm_logistics_env.spi.simulation import combined_ratio

Column = NDArray[np.float64]
FOLDER = Path(__file__).parent
SIZES = (10, 20)
SETUPS = 120
TIMES = {"realistic": 1, "paper": 2}  # how often each set-up is met
FILES = {"realistic": FOLDER / "reality.csv", "paper": FOLDER / "simulation.csv"}


def play(asked: tuple[str, int, int]) -> float:
    """Return the mean number of deliveries of a world, a set-up and a swarm size."""
    world, seed, n_robots = asked
    draw = np.random.default_rng(seed)
    scenario = Scenario.preset(world).replace(
        n_robots=n_robots,
        warehouse_width=round(draw.uniform(6, 14), 1),
        n_items=int(draw.integers(20, 80)),
        delivery_width=round(draw.uniform(1, 3), 1),
    )
    policy = policies.load("swarm-dt")
    times = range(TIMES[world])
    return float(
        np.mean([run_episode(scenario, policy, seed, (), 1000 * k + seed).delivered for k in times])
    )


def play_all() -> None:
    """Play every run and write the two files."""
    for world, file in FILES.items():
        asked = [(world, seed, n) for seed in range(SETUPS) for n in SIZES]
        with ProcessPoolExecutor() as pool:
            found = list(pool.map(play, asked, chunksize=4))
        rows = [f"{n},{seed},{p:.4g}" for (_, seed, n), p in zip(asked, found)]
        file.write_text("\n".join(["robots,seed,delivered", *rows]) + "\n")


def width_alone(num: Column, den: Column) -> Column:
    """Return the width of the interval of each study from its real runs alone, shape (studies,)."""
    if (den == 1.0).all():  # P itself, whose interval is Student's
        n = num.shape[-1]
        return np.asarray(2.0 * stdtrit(n - 1, 0.975) * num.std(axis=-1, ddof=1) / np.sqrt(n))
    alone = paired_ratio(num, den)
    return alone.high - alone.low


def main(resamples: int = 2_000, further: int = 150) -> dict[str, tuple[float, float]]:
    """Print, and return by what is estimated, coverage and median width over the real alone."""
    before, after = SIZES
    weight = before / (after - before)
    samples: dict[str, list[tuple[Column, Column]]] = {f"P of {after} robots": [], "S": []}
    for file in FILES.values():
        trials = spi.read_trials(file)
        few, many = (trials.performance(n_robots=n) for n in SIZES)
        samples[f"P of {after} robots"].append((many, np.ones_like(many)))
        samples["S"].append(((many - few) * weight, few))
    found = {}
    for name, ((num, den), (sim_num, sim_den)) in samples.items():
        truth = num.mean() / den.mean()
        for n_real in (10, 20):
            generator = np.random.default_rng(n_real)
            chosen = generator.integers(num.size, size=(resamples, n_real))
            others = generator.integers(num.size, size=(resamples, further))
            real = num[chosen], den[chosen]
            replayed, more = ((sim_num[runs], sim_den[runs]) for runs in (chosen, others))
            both = combined_ratio(real, replayed, more)
            covered = float(((both.low <= truth) & (truth <= both.high)).mean())
            width = float(np.median((both.high - both.low) / width_alone(*real)))
            found[f"{name}, {n_real} real runs"] = covered, width
            print(
                f"{name} = {truth:.2f}, {n_real} real runs and {further} further simulated ones: "
                f"the interval holds it in {covered:.3f} of {resamples} studies, and is "
                f"{1 - width:.0%} narrower than that of the real runs alone"
            )
    return found


if __name__ == "__main__":
    if "--play" in sys.argv[1:]:
        play_all()
    main()
