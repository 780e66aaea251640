"""Minari: a data set of episodes of the swarm as one agent, written, read and played again."""

from __future__ import annotations

import os
import tempfile
from typing import Any

import gymnasium
import numpy as np
from minari import DataCollector, load_dataset

from interop.conditions import MAX_CYCLES, N_ROBOTS, plain
from interop.results import passes, runs_with
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.environment.registration import GYMNASIUM_ID
from swarm_logistics_env.wrappers import FaultInjection, SwarmSize

EPISODES = 4
FAULTS = [{"mode": "FM1", "robots": 2}]


def main() -> None:
    """Record episodes with faults from 0 s, by name, and with sizes that change."""
    runs_with("minari", "gymnasium")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MINARI_DATASETS_PATH"] = folder
        fields: dict[str, Any] = {"n_robots": N_ROBOTS, "max_cycles": MAX_CYCLES, "flat": True}
        named = gymnasium.make(GYMNASIUM_ID, faults=FAULTS, **fields)
        recorded("2 of 5 robots fail at 0 s", "swarm/faults-v0", named, n_failed={2})
        again = load_dataset("swarm/faults-v0").recover_environment()
        first, info = again.reset(seed=0)
        assert info["failed"].sum() == 2, info
        assert first.tobytes() == named.reset(seed=0)[0].tobytes()
        passes("recover_environment: the same first rows, 2 failed at 0 s")

        sizes = SwarmSize(plain(), [3, N_ROBOTS], leave=[(1, 1.0)])
        both = CentralEnv(FaultInjection(sizes, "FM1", robots=2), flat=True)
        name = "3 or 5 robots, 1 leaves, 2 fail at 0 s"
        recorded(name, "swarm/sizes-v0", both, n_failed={2}, eval_env=GYMNASIUM_ID)


def recorded(name: str, dataset: str, env: Any, n_failed: set[int], **arguments: Any) -> None:
    """Record episodes and check that what is read is what was played."""
    collector = DataCollector(env, record_infos=True)
    rng = np.random.default_rng(0)
    paid = []
    for seed in range(EPISODES):
        collector.reset(seed=seed)
        is_over = is_cut = False
        while not (is_over or is_cut):
            action = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
            _, reward, is_over, is_cut, _ = collector.step(action)
            paid.append(reward)
    collector.create_dataset(dataset, algorithm_name="random", **arguments)
    read = load_dataset(dataset)
    assert read.total_episodes == EPISODES, read.total_episodes
    assert read.total_steps == EPISODES * MAX_CYCLES, read.total_steps
    rows, told = 0, []
    for episode in read.iterate_episodes():
        assert episode.observations.shape == (MAX_CYCLES + 1, *env.observation_space.shape)
        assert set(episode.infos["failed"].sum(axis=1).tolist()) == n_failed
        rows += len(episode.observations)
        told += episode.rewards.tolist()
    assert told == paid
    passes(f"CentralEnv, flat, DataCollector, {EPISODES} episodes, {rows} rows read again: {name}")


if __name__ == "__main__":
    main()
