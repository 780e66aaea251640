"""Ways on a grid."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.policies.routes import (
    BLOCKED,
    CELL,
    CROWDED,
    cost_to_go,
    costmap,
    lookahead,
)

NOTHING = np.zeros((0, 2))


def grid(solid: NDArray[np.float64], crowd: NDArray[np.float64] = NOTHING) -> NDArray[np.float64]:
    discs = [[*centre, 0.25, BLOCKED] for centre in solid.tolist()]
    discs += [[*centre, 0.25, CROWDED] for centre in crowd.tolist()]
    return costmap(4.0, 2.0, 0.1, np.array(discs).reshape(-1, 4))


def wall(height: float) -> NDArray[np.float64]:
    return np.array([[2.0, y] for y in np.arange(0.0, height, 0.2)])


def travelled(cost: NDArray[np.float64], x: float, y: float) -> list[tuple[float, float]]:
    """Follow the way to the right-hand edge."""
    goal = np.zeros(cost.shape, np.bool_)
    goal[:, -3:] = True
    far = cost_to_go(cost, goal)
    places = [(x, y)]
    while x < 3.6:
        assert len(places) < 400
        to_x, to_y = lookahead(cost, far, x, y)
        length = math.dist((x, y), (to_x, to_y))
        stride = min(0.05, length)
        x, y = x + stride * (to_x - x) / length, y + stride * (to_y - y) / length
        places.append((x, y))
    return places


def test_costs_mark_what_is_in_the_way() -> None:
    cost = grid(np.array([[1.0, 1.0]]), np.array([[3.0, 1.0]]))
    assert cost.shape == (16, 32)
    assert cost[8, [8, 16, 24]].tolist() == [BLOCKED, 1.0, CROWDED]
    assert cost[0, 16] == cost[15, 16] == cost[8, 0] == cost[8, 31] == BLOCKED
    marked = np.argwhere(cost[2:14, 2:16] == BLOCKED) + 2.5
    assert len(marked) > 10
    assert (np.hypot(*(marked * CELL - 1.0).T) < 0.25).all()


def test_a_way_in_the_open_is_as_long_as_it_looks() -> None:
    goal = np.zeros((20, 40), np.bool_)
    goal[10, 30] = True
    far = cost_to_go(np.ones((20, 40)), goal)
    np.testing.assert_allclose(far[[10, 15, 0], [10, 30, 18]], [20.0, 5.0, 2 + 10 * math.sqrt(2)])


def test_it_goes_straight_around_what_is_in_the_way_and_through_where_there_is_no_way() -> None:
    straight = travelled(grid(NOTHING), 0.35, 0.95)
    assert sum(math.dist(*pair) for pair in itertools.pairwise(straight)) < 3.45
    around = travelled(grid(wall(1.3)), 0.35, 0.35)
    assert min(math.dist(point, disc) for point in around for disc in wall(1.3).tolist()) > 0.2
    assert max(y for _, y in around) > 1.4
    assert travelled(grid(wall(2.1)), 0.35, 0.35)


def test_it_passes_on_the_side_where_nobody_stands() -> None:
    disc, crowd = np.array([[2.0, 1.0]]), np.array([[2.0, 1.45]])
    assert min(y for _, y in travelled(grid(disc, crowd), 0.35, 1.05)) < 0.8
    assert max(y for _, y in travelled(grid(disc, 2.0 - crowd + [2.0, 0.0]), 0.35, 0.95)) > 1.2
