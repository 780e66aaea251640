"""A study small enough for a test: 4 robots, 3 x 3 m, 20 s of simulated time."""

from __future__ import annotations

from typing import Any

import pytest


@pytest.fixture
def small() -> dict[str, Any]:
    """Fields of a study with all four kinds of factor."""
    return {
        "name": "small",
        "seeds": 2,
        "scenario": {
            "n_robots": 4,
            "n_items": 8,
            "warehouse_width": 3.0,
            "warehouse_height": 3.0,
            "delivery_width": 1.0,
            "duration": 20.0,
        },
        "sizes": [{"values": [2, 4, 6]}],
        "faults": [{"modes": ["FM1", "FM4"], "robots": [1]}],
        "parameters": [{"name": "delivery_width", "values": [1.0, 0.5]}],
        "ablations": [{"policy": "random-walk"}],
    }
