from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, observations

BEAMS = slice(observations.RANGE_WALLS, observations.RANGE_ITEMS + observations.N_BEAMS)


def beams(faults: list[Fault] | None = None, **fields: Any) -> NDArray[np.float32]:
    scenario = Scenario(n_robots=4, n_items=3, ranger_range=1.4, sensing_mix=(1.0, 0.5), **fields)
    return Warehouse(scenario).reset(seed=0, faults=faults or [])[:, BEAMS]


def test_a_dropped_beam_reports_how_far_the_robot_itself_can_see() -> None:
    own = np.array([0.7, 0.7, 1.4, 1.4], np.float32)
    seen = beams(sensor_dropout=1.0)
    np.testing.assert_array_equal(np.sort(seen[:, 0]), own)
    assert (seen == seen[:, :1]).all()


@pytest.mark.parametrize("faults", [[], [Fault("rangers_blind", 2)]])
def test_noise_leaves_beams_that_meet_nothing_as_they_are(faults: list[Fault]) -> None:
    true, noisy = beams(faults), beams(faults, ranger_noise=0.05)
    meets_nothing = true == true.max(axis=1, keepdims=True)
    np.testing.assert_array_equal(noisy[meets_nothing], true[meets_nothing])
    assert (noisy[~meets_nothing] != true[~meets_nothing]).any()
    assert (noisy <= true.max(axis=1, keepdims=True)).all()
    assert (noisy >= 0.0).all()
