"""A worker that steps another project's environment; run by an interpreter that has it.

    python benchmarks/peers.py rware 15

It ends with a line of JSON: agent-steps and control steps per run, what a step includes, and the
seconds of processor time that each of 15 runs took. It imports nothing of this package, which need
not be installed beside the peers.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

N_AGENTS = 25
Steps = tuple[Callable[[], Any], int, int, str]  # a run, its steps, agents per step, what it does


def rware() -> Steps:
    """Make RWARE's warehouse: a grid with shelves, 25 robots."""
    from rware.warehouse import RewardType, Warehouse

    env = Warehouse(
        shelf_columns=3, column_height=8, shelf_rows=3, n_agents=N_AGENTS, msg_bits=0,
        sensor_range=1, request_queue_size=N_AGENTS, max_inactivity_steps=None, max_steps=None,
        reward_type=RewardType.INDIVIDUAL,
    )  # fmt: skip
    env.reset(seed=0)
    actions = np.random.default_rng(0).integers(0, 5, (200, N_AGENTS)).tolist()

    def run() -> None:
        for action in actions:
            env.step(action)

    return run, len(actions), N_AGENTS, "grid moves, 3 x 3 cells seen, rewards"


def mpe2() -> Steps:
    """Make MPE2's simple_spread with 25 agents."""
    from mpe2 import simple_spread_v3

    env = simple_spread_v3.parallel_env(N=N_AGENTS, max_cycles=10**9, continuous_actions=True)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = [
        {agent: rng.uniform(0.0, 1.0, 5).astype(np.float32) for agent in env.possible_agents}
        for _ in range(20)
    ]

    def run() -> None:
        for action in actions:
            env.step(action)

    return run, len(actions), N_AGENTS, "point masses, all positions told, rewards, dicts"


def vmas(n_worlds: int) -> Steps:
    """Make VMAS's navigation with lidar: 25 agents in each of `n_worlds`."""
    import torch
    from vmas import make_env

    torch.set_num_threads(1)
    env = make_env(
        scenario="navigation", num_envs=n_worlds, device="cpu", continuous_actions=True, seed=0,
        n_agents=N_AGENTS, world_spawning_x=4.0, world_spawning_y=4.0,
    )  # fmt: skip
    env.reset()
    steps = max(2, 20 // n_worlds)
    actions = [[torch.rand(n_worlds, 2) * 2.0 - 1.0 for _ in range(N_AGENTS)] for _ in range(steps)]

    def run() -> None:
        for action in actions:
            env.step(action)

    return run, steps, N_AGENTS * n_worlds, "disc physics, lidar to agents, rewards"


PEERS: dict[str, tuple[str, Callable[[], Steps]]] = {
    "rware": ("RWARE", rware),
    "mpe2": ("MPE2 simple_spread", mpe2),
    "vmas-1": ("VMAS navigation, 1 world", lambda: vmas(1)),
    "vmas-32": ("VMAS navigation, 32 worlds", lambda: vmas(32)),
    "vmas-256": ("VMAS navigation, 256 worlds", lambda: vmas(256)),
}


def main() -> None:
    """Measure the peer named on the command line."""
    run, steps, agents, includes = PEERS[sys.argv[1]][1]()
    run()
    seconds = []
    for _ in range(int(sys.argv[2])):
        began = time.process_time()
        run()
        seconds.append(time.process_time() - began)
    print(json.dumps([steps * agents, steps, includes, seconds]), flush=True)


if __name__ == "__main__":
    main()
