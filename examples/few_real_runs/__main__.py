"""Few real runs with many simulated ones: how often the interval is right, and how much narrower.

The world with differential drive, noisy sensors and drifting headings (the preset `realistic`)
stands for reality, the paper's world for its simulator. Both met the same 200 set-ups, which
differ in the warehouse, the items and the delivery area; in simulation each three times. Studies
of a few real runs are drawn from them, and S from 10 to 20 robots is estimated from the real runs
alone and with simulation.

    python examples/few_real_runs           # from the runs that are kept beside this file
    python examples/few_real_runs --play    # play them anew: about ten minutes on two cores
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from swarm_logistics_env import Scenario, policies, run_episode, spi
from swarm_logistics_env.spi.ratio import paired_ratio
from swarm_logistics_env.spi.simulation import combined_ratio

FOLDER = Path(__file__).parent
SIZES = (10, 20)
SETUPS = 200
TIMES = {"realistic": 1, "paper": 3}  # how often each set-up is met
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


def main(resamples: int = 2_000, further: int = 150) -> dict[int, tuple[float, float]]:
    """Print, and return by number of real runs, coverage and median width over the real alone."""
    before, after = SIZES
    weight = before / (after - before)
    samples = []
    for file in FILES.values():
        trials = spi.read_trials(file)
        few, many = (trials.performance(n_robots=n) for n in SIZES)
        samples.append(((many - few) * weight, few))
    (num, den), (sim_num, sim_den) = samples
    truth = num.mean() / den.mean()
    print(f"S from {before} to {after} robots in {num.size} real set-ups: {truth:.3f}")
    found = {}
    for n_real in (10, 20):
        generator = np.random.default_rng(n_real)
        chosen = generator.integers(num.size, size=(resamples, n_real))
        others = generator.integers(num.size, size=(resamples, further))
        real = num[chosen], den[chosen]
        replayed, more = ((sim_num[runs], sim_den[runs]) for runs in (chosen, others))
        both = combined_ratio(real, replayed, more)
        alone = paired_ratio(*real)
        covered = float(((both.low <= truth) & (truth <= both.high)).mean())
        width = float(np.median((both.high - both.low) / (alone.high - alone.low)))
        found[n_real] = covered, width
        print(
            f"{n_real} real runs and {further} further simulated ones: the interval holds it in "
            f"{covered:.3f} of {resamples} studies, and is {1 - width:.0%} narrower than that of "
            "the real runs alone"
        )
    return found


if __name__ == "__main__":
    if "--play" in sys.argv[1:]:
        play_all()
    main()
