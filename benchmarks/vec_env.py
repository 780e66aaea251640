"""Print what SwarmVecEnv costs inside `PPO.learn`, beside SuperSuit's on the same world.

Needs the extra `train`, and SuperSuit for its rows. Both learn with stable-baselines3's defaults
but for the length of a rollout; times are of the processor, medians of interleaved repeats. Before
that: whether what a seed learns is the same a second time, and with two threads.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
import statistics
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from rich.console import Console
from rich.table import Table
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnvWrapper

from swarm_logistics_env import Scenario, swarm_logistics_v0
from swarm_logistics_env.adapters import SwarmVecEnv

_ROLLOUT = 128  # steps


class Timed(VecEnvWrapper):  # type: ignore[misc]  # not in the environment of the type check
    """Adds up the processor and wall time of the steps of an environment."""

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        self.processor = self.wall = 0.0
        self.rows = 0

    def reset(self) -> Any:
        """Begin, untimed."""
        return self.venv.reset()

    def step_async(self, actions: Any) -> None:
        """Begin the time of a step."""
        self._began = time.process_time(), time.perf_counter()
        self.venv.step_async(actions)

    def step_wait(self) -> Any:
        """End the time of a step."""
        outcome = self.venv.step_wait()
        self.processor += time.process_time() - self._began[0]
        self.wall += time.perf_counter() - self._began[1]
        self.rows += self.num_envs
        return outcome


def ours(scenario: Scenario, n_worlds: int, threads: int) -> Callable[[], Any]:
    """Return a maker of our VecEnv."""
    return lambda: SwarmVecEnv(scenario, n_worlds=n_worlds, threads=threads)


def supersuits(scenario: Scenario, n_worlds: int) -> Callable[[], Any]:
    """Return a maker of SuperSuit's VecEnv of the same worlds, in this process."""
    import supersuit

    def make() -> Any:
        env = supersuit.pettingzoo_env_to_vec_env_v1(swarm_logistics_v0.parallel_env(scenario))
        return supersuit.concat_vec_envs_v1(env, n_worlds, base_class="stable_baselines3")

    return make


def learned(make: Callable[[], Any], rollouts: int) -> dict[str, float]:
    """Learn for some rollouts; returns agent-steps per second and microseconds per agent-step."""
    env = Timed(make())
    # No seed: with one, PPO fails on SuperSuit's VecEnv, which has no `seed`.
    model = PPO("MlpPolicy", env, n_steps=_ROLLOUT, batch_size=env.num_envs * 16, device="cpu")
    processor, wall = time.process_time(), time.perf_counter()
    model.learn(rollouts * _ROLLOUT * env.num_envs)
    processor, wall = time.process_time() - processor, time.perf_counter() - wall
    env.close()
    return {
        "step_processor": 1e6 * env.processor / env.rows,
        "step_wall": 1e6 * env.wall / env.rows,
        "learn_processor": 1e6 * processor / env.rows,
        "learn_rate": env.rows / wall,
    }


def parameters(scenario: Scenario, n_worlds: int, threads: int) -> list[Any]:
    """Return all parameters after some 20,000 agent-steps with seed 0."""
    env = SwarmVecEnv(scenario, n_worlds=n_worlds, threads=threads)
    model = PPO("MlpPolicy", env, n_steps=_ROLLOUT, batch_size=1600, seed=0, device="cpu")
    tensors = model.learn(20_000).policy.state_dict().values()
    env.close()
    return [tensor.numpy() for tensor in tensors]


def say_whether_equal(scenario: Scenario, n_worlds: int) -> None:
    """Print whether learning gives the same again, whatever the threads."""
    first = parameters(scenario, n_worlds, 1)
    for threads in (1, 2):
        other = parameters(scenario, n_worlds, threads)
        equal = all(np.array_equal(one, two) for one, two in zip(first, other, strict=True))
        told = "equal" if equal else "DIFFERENT"
        print(f"PPO(seed=0), 20,000 steps, 1 thread and again with {threads}: {told} parameters")


def main() -> None:
    """Print all of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, default=25)
    parser.add_argument("--worlds", type=int, default=8)
    parser.add_argument("--rollouts", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    torch.set_num_threads(1)
    scenario = Scenario(n_robots=given.robots)
    makers = {
        "SwarmVecEnv": ours(scenario, given.worlds, 1),
        "SwarmVecEnv, 2 threads": ours(scenario, given.worlds, 2),
    }
    try:
        makers["SuperSuit"] = supersuits(scenario, given.worlds)
    except ModuleNotFoundError:
        print("SuperSuit is not installed: no row of it")
    say_whether_equal(scenario, given.worlds)
    for make in makers.values():
        learned(make, 1)  # kernels are compiled, pages touched
    runs: dict[str, list[dict[str, float]]] = {name: [] for name in makers}
    for _ in range(given.repeats):
        for name, make in makers.items():
            runs[name].append(learned(make, given.rollouts))
    packages = ("stable-baselines3", "torch", "supersuit", "numpy")
    table = Table(
        title=f"PPO.learn, {given.worlds} worlds of {given.robots} robots, per agent-step; "
        f"median of {given.repeats} repeats",
        caption=f"{os.cpu_count()} processors, Python {platform.python_version()}, "
        + ", ".join(f"{name} {_version(name)}" for name in packages),
    )
    table.add_column("VecEnv")
    for header in (
        "step (us CPU)",
        "step (us wall)",
        "learn (us CPU)",
        "learn (1/s)",
    ):
        table.add_column(header, justify="right")
    for name, measured in runs.items():
        medians = [statistics.median(run[part] for run in measured) for part in measured[0]]
        table.add_row(name, *(f"{median:,.2f}" for median in medians[:3]), f"{medians[3]:,.0f}")
    Console().print(table)


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "-"


if __name__ == "__main__":
    main()
