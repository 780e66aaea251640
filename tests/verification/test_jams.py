"""Swarms that press together keep their bodies apart."""

from __future__ import annotations

import pytest

from swarm_logistics_env import Scenario
from verification.soak import SIZES, TARGETS, Overlaps, overlaps


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("n_robots", SIZES)
def test_a_jam_keeps_bodies_apart(n_robots: int, target: str) -> None:
    assert overlaps(n_robots, target, seed=0).problem(Scenario()) is None


@pytest.mark.parametrize("name", ["median", "lasting", "robots", "walls"])
def test_every_bound_is_checked(name: str) -> None:
    depths = {"median": 0.001, "lasting": 0.0, "robots": 0.079, "walls": 0.039}
    assert Overlaps(**depths).problem(Scenario()) is None
    problem = Overlaps(**{**depths, name: 0.1}).problem(Scenario())
    assert problem is not None
    assert problem.startswith(f"{name} overlap 100.0 mm")
