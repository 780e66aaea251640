"""The conditions that every client is tried in: faults from 0 s, and sizes that change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.wrappers import FaultInjection, FixedAgents, SwarmSize, Wrapper

N_ROBOTS = 5
MAX_CYCLES = 20


def plain(**arguments: Any) -> SwarmLogisticsEnv:
    """Return a small environment with short episodes."""
    return swarm_logistics_v0.parallel_env(
        **{"n_robots": N_ROBOTS, "max_cycles": MAX_CYCLES, **arguments}
    )


class Noted(Wrapper):
    """Notes what episodes were played: their swarm sizes, and how many robots failed at 0 s."""

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        self.sizes: set[int] = set()
        self.failed: set[int] = set()

    def begun(self, seed: int) -> None:
        """Note the episode that has begun."""
        state = self.warehouse.state
        self.sizes.add(state.n_robots)
        self.failed.add(int(state.failed.sum()))


Wrap = Callable[[SwarmLogisticsEnv], Any]


def with_faults(inner: Wrap = lambda env: env) -> Wrapper:
    """Return an environment in which 2 of 5 robots have failed from the start.

    Args:
        inner: what is put around the plain environment first, inside of everything else.
    """
    return Noted(FaultInjection(inner(plain()), "FM1", robots=2, onset=0.0))


def with_sizes(inner: Wrap = lambda env: env) -> Wrapper:
    """Return one of 3 or 5 robots, by the episode, of whom 1 leaves at 1 s."""
    return FixedAgents(Noted(SwarmSize(inner(plain()), [3, N_ROBOTS], leave=[(1, 1.0)])))


def with_both(inner: Wrap = lambda env: env) -> Wrapper:
    """Return one with both."""
    sizes = SwarmSize(inner(plain()), [3, N_ROBOTS], leave=[(1, 1.0)])
    return FixedAgents(Noted(FaultInjection(sizes, "FM1", robots=2, onset=0.0)))


def without_fixed_agents(first: int) -> Wrapper:
    """Return one of 3 or 5 robots, by the episode, whose next episode has `first`."""
    env = SwarmSize(plain(), [3, N_ROBOTS])
    seed = 0
    while len(env.reset_arrays(seed)) != first:
        seed += 1
    env.unwrapped.next_seed = seed
    return env


CONDITIONS: dict[str, Callable[..., Any]] = {
    "2 of 5 robots fail at 0 s": with_faults,
    "FixedAgents, 3 or 5 robots, 1 leaves": with_sizes,
    "FixedAgents, 3 or 5 robots, 1 leaves, 2 fail at 0 s": with_both,
}


def played(name: str, *envs: Any) -> str:
    """Return in words what was played, after a check that it was what the condition says."""
    sizes = {size for env in envs for size in env.sizes}
    failed = {count for env in envs for count in env.failed}
    assert sizes == ({3, N_ROBOTS} if "FixedAgents" in name else {N_ROBOTS}), sizes
    assert failed == ({2} if "fail" in name else {0}), failed
    return f"{name}: sizes {sorted(sizes)}, {max(failed)} failed at 0 s"
