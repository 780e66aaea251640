from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.pilot import expected_seconds


class Broken:
    """Fails at once."""

    identity = "broken"

    def reset(self, n_robots: int, seed: int) -> None:
        raise RuntimeError("a wheel came off")

    def act(self, observations: Any) -> Any: ...


def test_more_seeds_take_more_time(small: dict[str, Any]) -> None:
    few, many = (expected_seconds(Study(**{**small, "seeds": seeds}).plan()) for seeds in (2, 200))
    assert 0 < few < many


def test_policy_that_fails_is_named(small: dict[str, Any]) -> None:
    with pytest.raises(StudyError, match=r"'Broken' fails .*a wheel came off"):
        expected_seconds(Study(**{**small, "policies": [Broken()]}).plan())
