from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env import observations as row
from swarm_logistics_env.observations import N_COLUMNS, bounds, columns, unflatten


@pytest.mark.parametrize("scenario", [Scenario(), Scenario(view_range=7.0, timer_limit=3.0)])
def test_the_named_columns_cover_a_row_without_gap_or_overlap(scenario: Scenario) -> None:
    covered = [
        place for column in columns(scenario) for place in range(*column.columns.indices(N_COLUMNS))
    ]
    assert sorted(covered) == list(range(N_COLUMNS))
    names = [column.name for column in columns(scenario)]
    assert len(set(names)) == len(names)
    assert all(column.unit and column.meaning for column in columns(scenario))


def test_bounds_follow_the_scenario() -> None:
    scenario = Scenario(ranger_range=3.0, view_range=6.0, timer_limit=20.0, max_speed=1.5)
    low, high = bounds(scenario)
    assert low.shape == high.shape == (N_COLUMNS,)
    assert (low < high).all()
    parts = unflatten(high, scenario)
    assert (parts["range_walls"] == 3.0).all()
    assert (parts["item_x"] == 6.0).all()
    assert (parts["neighbour_x"] == 6.0).all()  # seen farther than heard
    assert parts["timer"] == 20.0
    assert parts["velocity"].tolist() == [1.5, 1.5]
    assert (unflatten(low, scenario)["velocity"] == -1.5).all()


def test_block_features_are_named_as_the_kernels_index_them() -> None:
    scenario = Scenario()
    table = np.arange(N_COLUMNS, dtype=np.float32)
    parts = unflatten(table, scenario)
    for name, part in unflatten(np.vstack([table, table]), scenario).items():
        np.testing.assert_array_equal(part, [parts[name]] * 2)
        assert np.shares_memory(parts[name], table)
    for number, feature in enumerate(row.ITEM_FEATURES):
        assert parts[f"item_{feature}"][0] == row.ITEMS + number
    for number, feature in enumerate(row.NEIGHBOUR_FEATURES):
        assert parts[f"neighbour_{feature}"][0] == row.NEIGHBOURS + number
    assert parts["carrying"] == row.CARRYING
    assert parts["carrying_requested"] == row.CARRYING_REQUESTED
    assert parts["lowest_timer_present"] == row.LOWEST_TIMER
    assert parts["contact"] == row.CONTACT
