"""Results that several tests of the report read."""

from __future__ import annotations

import pytest

from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.made_up import looked_at, paper, published

NARROW = Setting("parameter", "warehouse_width", 5.0)


@pytest.fixture(scope="session")
def few() -> StudyResults:
    """The paper's study over four seeds; at the narrow warehouse every item was delivered."""
    return paper(seeds=4, noise=2.0, full=NARROW)


@pytest.fixture(scope="session")
def compared() -> StudyResults:
    """Two policies: the second delivers half as much, and collapses under FM1."""

    def p(policy: str, setting: Setting) -> float:
        share = 1.0 if policy == "swarm-dt" else 0.1 if setting.name == "FM1" else 0.5
        return share * published(policy, setting)

    return paper(p, policies=["swarm-dt", "swarm-dt-follow"])


@pytest.fixture(scope="session")
def stopped() -> StudyResults:
    """A study until it is clear, whose questions stopped at looks of three levels."""
    return looked_at()
