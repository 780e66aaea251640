"""Measures other packages' worlds beside this one, in turns, each in an environment of its own.

python benchmarks/peers.py              all of them, as ratios: `make benchmark-peers`
python benchmarks/peers.py --one NAME   one of them, by the interpreter that has it

CPU seconds of one thread, so that a busy machine changes little. The worlds are not alike: the
table says what a step of each has in it.
"""

import argparse
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SECONDS = 2.0  # CPU time of a turn
N_AGENTS = 25
Take = Callable[[], int]  # takes steps, returns how many of single agents


def ours_arrays() -> tuple[str, Take]:
    """Return this package's world by its arrays, as its own learner steps it."""
    import numpy as np

    from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv

    env = SwarmLogisticsEnv(n_robots=N_AGENTS, restock=True)
    commands = np.random.default_rng(0).uniform(-1.0, 1.0, (100, N_AGENTS, 4))

    def take() -> int:
        env.reset_arrays(seed=0)
        for row in commands:
            env.step_arrays(row)
        return len(commands) * N_AGENTS

    return "swarm-logistics-env", take


def ours_dicts() -> tuple[str, Take]:
    """Return this package's world by PettingZoo's parallel interface."""
    from swarm_logistics_env import swarm_logistics_v0

    env = swarm_logistics_v0.parallel_env(n_robots=N_AGENTS, restock=True)
    return "swarm-logistics-env", parallel_steps(env)


def mpe2() -> tuple[str, Take]:
    """Return simple_spread, particles in a plane."""
    from mpe2 import simple_spread_v3

    env = simple_spread_v3.parallel_env(continuous_actions=True, max_cycles=100)
    return "mpe2", parallel_steps(env)


def parallel_steps(env: Any) -> Take:
    """Return 100 steps of an environment with PettingZoo's parallel interface."""
    env.reset(seed=0)
    for agent in env.possible_agents:
        env.action_space(agent).seed(0)
    actions = {agent: env.action_space(agent).sample() for agent in env.possible_agents}

    def take() -> int:
        env.reset(seed=0)
        n_steps = 0
        while env.agents and n_steps < 100:
            env.step({agent: actions[agent] for agent in env.agents})
            n_steps += 1
        return n_steps * len(actions)

    return take


def rware() -> tuple[str, Take]:
    """Return the large warehouse with as many agents as it registers, 19."""
    import gymnasium

    __import__("rware")
    env: Any = gymnasium.make("rware-large-19ag-v2").unwrapped
    env.reset(seed=0)
    actions = [env.action_space.sample() for _ in range(50)]
    n_agents: int = env.n_agents

    def take() -> int:
        env.reset(seed=0)
        for action in actions:
            env.step(action)
        return len(actions) * n_agents

    return "rware", take


def pogema() -> tuple[str, Take]:
    """Return lifelong path finding with random obstacles."""
    from pogema import GridConfig, pogema_v0

    config = GridConfig(
        num_agents=N_AGENTS, size=32, density=0.3, seed=0, on_target="restart",
        max_episode_steps=1000,
    )  # fmt: skip
    env = pogema_v0(grid_config=config)
    env.reset()
    actions = [env.sample_actions() for _ in range(100)]

    def take() -> int:
        env.reset()
        for action in actions:
            env.step(action)
        return len(actions) * N_AGENTS

    return "pogema", take


def vmas(n_worlds: int) -> tuple[str, Take]:
    """Return navigation with lidar, in so many worlds at once, on the CPU."""
    import torch
    from vmas import make_env

    torch.set_num_threads(1)
    env = make_env("navigation", num_envs=n_worlds, n_agents=5, seed=0, max_steps=None)
    env.reset()
    actions = [env.get_random_action(agent) for agent in env.agents]

    def take() -> int:
        for _ in range(10):
            env.step(actions)
        return 10 * len(actions) * n_worlds

    return "vmas", take


# Name -> the folder of its environment, what makes it, and what a step has in it.
PEERS: dict[str, tuple[str, Callable[[], tuple[str, Take]], str]] = {
    "ours, arrays": (
        "dev",
        ours_arrays,
        "25 robots with bodies, contacts, ranges, cameras and radio; 5 substeps",
    ),
    "ours, PettingZoo": ("dev", ours_dicts, "the same, as dicts"),
    "RWARE": ("peer-rware", rware, "19 agents on the grid of the large warehouse"),
    "POGEMA": ("peer-pogema", pogema, "25 agents on a grid of 32 x 32, lifelong"),
    "MPE2": ("peer-mpe2", mpe2, "simple_spread, 3 particles as by default, as PettingZoo's dicts"),
    "VMAS, 1 world": ("peer-vmas", lambda: vmas(1), "navigation, 5 agents with lidar"),
    "VMAS, 1,024 worlds": ("peer-vmas", lambda: vmas(1024), "the same, side by side on the CPU"),
}


def measure(name: str) -> dict[str, Any]:
    """Return a package's version and its agent-steps per CPU second."""
    package, take = PEERS[name][1]()
    take()  # compiles and warms
    n_steps = 0
    began = time.process_time()
    while (elapsed := time.process_time() - began) < SECONDS:
        n_steps += take()
    return {"version": version(package), "rate": n_steps / elapsed}


def interpreter(folder: str) -> Path:
    """Return the Python of an environment; this package's is the one that runs."""
    return Path(sys.executable) if folder == "dev" else ROOT / ".venvs" / folder / "bin" / "python"


def compare(turns: int) -> list[tuple[str, ...]]:
    """Return a row for each peer: its version, its world, its rate, and that over ours."""
    results: dict[str, list[dict[str, Any]]] = {name: [] for name in PEERS}
    for _ in range(turns):
        for name, (folder, _, _) in PEERS.items():
            command = [str(interpreter(folder)), __file__, "--one", name]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            results[name].append(json.loads(done.stdout.splitlines()[-1]))
    ours = [result["rate"] for result in results["ours, arrays"]]
    rows: list[tuple[str, ...]] = []
    for name, (_, _, world) in PEERS.items():
        rates = [result["rate"] for result in results[name]]
        ratio = statistics.median(rate / base for rate, base in zip(rates, ours))
        rate_text = f"{statistics.median(rates):,.0f}"
        rows.append((name, results[name][0]["version"], world, rate_text, f"{ratio:.3g}"))
    return rows


def main() -> None:
    """Measure one, or all of them, and write the table into the page of comparison."""
    parser = argparse.ArgumentParser(prog="benchmarks/peers.py", description=__doc__)
    parser.add_argument("--one", choices=PEERS)
    parser.add_argument("--turns", type=int, default=5)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure(arguments.one)))
        return
    sys.path.insert(0, str(ROOT))
    from research.tables import rewrite, table

    rows = compare(arguments.turns)
    head = ("package", "version", "a step", "agent-steps a CPU second", "times ours")
    text = table(head, rows, f"Medians of {arguments.turns} turns of {SECONDS:g} s each.")
    rewrite(ROOT / "docs" / "comparison.md", {"speed": text})
    print(text)


if __name__ == "__main__":
    main()
