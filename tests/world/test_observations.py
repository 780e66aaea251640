from __future__ import annotations

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.observations import N_COLUMNS, bounds, columns, unflatten


@pytest.mark.parametrize("scenario", [Scenario(), Scenario(view_range=7.0, timer_limit=3.0)])
def test_the_named_columns_cover_a_row_without_gap_or_overlap(scenario: Scenario) -> None:
    named = columns(scenario)
    covered = [index for part in named for index in range(*part.columns.indices(N_COLUMNS))]
    assert sorted(covered) == list(range(N_COLUMNS))
    assert len({column.name for column in named}) == len(named)
    assert all(column.unit and column.meaning for column in named)


def test_bounds_follow_the_scenario() -> None:
    scenario = Scenario(ranger_range=3.0, view_range=6.0, timer_limit=20.0, max_speed=1.5)
    low, high = bounds(scenario)
    assert (low < high).all()
    parts = unflatten(high, scenario)
    for name, limit in {"range_walls": 3.0, "item_x": 6.0, "timer": 20.0, "velocity": 1.5}.items():
        assert (parts[name] == limit).all(), name
    assert (parts["neighbour_x"] == 6.0).all()  # seen farther than heard
    assert (unflatten(low, scenario)["velocity"] == -1.5).all()


def test_block_features_are_named_as_the_kernels_index_them() -> None:
    table = np.arange(N_COLUMNS, dtype=np.float32)
    parts = unflatten(table, Scenario())
    for name, part in unflatten(np.vstack([table, table]), Scenario()).items():
        np.testing.assert_array_equal(part, [parts[name]] * 2)
        assert np.shares_memory(parts[name], table)
    for number, feature in enumerate(row.ITEM_FEATURES):
        assert parts[f"item_{feature}"][0] == row.ITEMS + number
    for number, feature in enumerate(row.NEIGHBOUR_FEATURES):
        assert parts[f"neighbour_{feature}"][0] == row.NEIGHBOURS + number
    for name in ("carrying", "carrying_requested", "contact"):
        assert parts[name] == getattr(row, name.upper())
    assert parts["lowest_timer_present"] == row.LOWEST_TIMER
