"""Contact clusters: robots that touch each other, directly or through others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.kernels import inlined_kernel


@inlined_kernel
def join(leader: NDArray[np.int64], robot: int, other: int) -> None:
    """Put the clusters of two robots that touch together; `leader` (N,) leads to one of each."""
    first, second = leader_of(leader, robot), leader_of(leader, other)
    leader[max(first, second)] = min(first, second)


@inlined_kernel
def leader_of(leader: NDArray[np.int64], robot: int) -> int:
    """Return the robot that stands for the cluster of this one, and shorten the way to it."""
    while leader[robot] != robot:
        leader[robot] = leader[leader[robot]]
        robot = leader[robot]
    return robot


@inlined_kernel
def largest(leader: NDArray[np.int64]) -> int:
    """Return how many robots the largest cluster has; 1 if no robots touch."""
    sizes = np.zeros(len(leader), np.int64)
    most = 1
    for robot in range(len(leader)):
        found = leader_of(leader, robot)
        sizes[found] += 1
        most = max(most, sizes[found])
    return most
