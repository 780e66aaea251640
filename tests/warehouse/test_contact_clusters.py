"""Who touches whom, and how many the largest cluster has."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from swarm_logistics_env import Fault, Warehouse
from swarm_logistics_env.warehouse.contact_clusters import join, largest, leader_of

Build = Callable[..., Warehouse]


@pytest.mark.parametrize("seed", range(20))
def test_the_largest_cluster_is_the_largest_connected_component(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, pairs = 40, rng.integers(0, 40, (3 * seed, 2))
    leader = np.arange(n)
    for robot, other in pairs:
        join(leader, robot, other)
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(n, n))
    _, labels = connected_components(graph, directed=False)
    assert largest(leader) == np.bincount(labels).max()
    leaders = np.array([leader_of(leader, robot) for robot in range(n)])
    np.testing.assert_array_equal(leaders[:, None] == leaders, labels[:, None] == labels)


def test_robots_that_touch_are_a_cluster_and_others_are_not(build: Build) -> None:
    row = [(2.0, 5.0), (2.25, 5.0), (2.5, 5.0), (0.125, 1.0), (6.0, 5.0), (6.3, 5.0)]
    world = build(row, [(1.0, 9.0)])
    assert largest(world.state.robot_cluster) == 3  # the fourth touches a wall alone
    assert world.state.robot_contact.tolist() == [True, True, True, True, False, False]


def test_a_removed_robot_is_in_no_cluster(build: Build) -> None:
    row = [(2.0, 5.0), (2.25, 5.0), (2.5, 5.0)]
    world = build(row, [(1.0, 9.0)], [Fault("removed", (1,))])
    assert largest(world.state.robot_cluster) == 1
