from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.pilot import expect
from swarm_logistics_env.studies.store import FILE_NAME


class Broken:
    """Fails at once."""

    identity = "broken"

    def reset(self, n_robots: int, seed: int) -> None:
        raise RuntimeError("a wheel came off")

    def act(self, observations: Any) -> Any: ...


def test_more_seeds_take_more_time_and_space(small: dict[str, Any]) -> None:
    few, many = (expect(Study(**{**small, "seeds": seeds}).plan()) for seeds in (2, 200))
    assert 0 < few.seconds < many.seconds
    assert few.size < many.size


def test_size_bounds_that_of_the_store(small: dict[str, Any], tmp_path: Path) -> None:
    study = Study(out=tmp_path, **{**small, "seeds": 5})
    study.run()
    actual = (tmp_path / FILE_NAME).stat().st_size
    assert actual <= expect(study.plan()).size + 4 * 4096  # a page for each table and index


def test_policy_that_fails_is_named(small: dict[str, Any]) -> None:
    with pytest.raises(StudyError, match=r"'Broken' fails .*a wheel came off"):
        expect(Study(**{**small, "policies": [Broken()]}).plan())
