from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env.world.warehouse.grid import blank_grid, fill


@given(
    width=st.floats(0.3, 60.0),
    height=st.floats(0.3, 60.0),
    cell=st.floats(0.1, 3.0),
    n=st.integers(1, 60),
    seed=st.integers(0, 10**6),
)
@settings(max_examples=60)
def test_every_included_point_stands_once_in_the_cell_that_holds_it(
    width: float, height: float, cell: float, n: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    # Some outside, as bodies are that were just pushed into a wall: the edge counts.
    position = rng.uniform([-1.0, -1.0], [width + 1.0, height + 1.0], (n, 2))
    included = rng.random(n) < 0.7
    grid = blank_grid(width, height, cell, n)
    assert len(blank_grid(1000.0, 1000.0, 1.0, 10).start) < 200  # huge and empty stays small
    assert grid.cell >= cell
    fill(grid, position, ~included)  # is forgotten
    fill(grid, position, included)
    listed = grid.members[: grid.start[-1]]
    assert sorted(listed) == np.flatnonzero(included).tolist()
    np.testing.assert_array_equal(grid.position[:, : len(listed)], position[listed].T)
    for index, (first, last) in enumerate(zip(grid.start[:-1], grid.start[1:])):
        members = grid.members[first:last]
        assert (np.diff(members) > 0).all()  # so that ties never depend on memory
        low = np.array([index % grid.n_columns, index // grid.n_columns]) * grid.cell
        inside = np.clip(position[members], 0.0, [width, height])
        assert (inside >= low - 1e-9).all()
        assert (inside <= low + grid.cell + 1e-9).all()
