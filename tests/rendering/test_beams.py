from __future__ import annotations

import numpy as np

from swarm_logistics_env import Fault, Scenario, Warehouse, observations
from swarm_logistics_env.rendering.readings import N_BEAMS, ranges


def test_beams_end_where_the_robot_itself_sees_them_end() -> None:
    assert N_BEAMS == observations.N_BEAMS
    scenario = Scenario(n_robots=20, n_obstacles=4)
    world = Warehouse(scenario)
    rows = world.reset(2, [Fault("removed", [3], onset=0.5)])
    for _ in range(20):
        rows = world.step(np.tile([1.0, 0.0, 0.2, 1.0], (20, 1)))
    seen = observations.unflatten(rows, scenario)
    for robot in np.flatnonzero(world.state.robot_present):
        scans = ranges(world.state, scenario, int(robot))
        for scan, name in zip(scans, ("range_robots", "range_walls", "range_items"), strict=True):
            np.testing.assert_allclose(scan, seen[name][robot], atol=1e-5)


def test_blind_robot_has_no_beams() -> None:
    world = Warehouse(Scenario(n_robots=2))
    world.reset(0, [Fault("rangers_blind", [1])])
    assert (ranges(world.state, world.scenario, 1) == 0.0).all()
