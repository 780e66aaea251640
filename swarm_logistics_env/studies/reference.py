"""Published results that a report sets beside ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from swarm_logistics_env.errors import StudyError, suggest
from swarm_logistics_env.spi.estimate import Estimate
from swarm_logistics_env.studies.comparisons import Comparison, Level, Question


@dataclass(frozen=True)
class Reference:
    """Performances and yes/no claims that somebody published, without a number of runs.

    Each performance is treated as one run.

    Attributes:
        source: whose they are, for the report.
        performance: P at each level [items].
        cells: the levels that count as cells of the tables; a baseline repeated under another
            name is none.
        claims: whether the text says that the indicator is above the threshold.
    """

    source: str
    performance: Mapping[Level, float]
    cells: tuple[Level, ...]
    claims: Mapping[Question, bool]

    def estimate(self, comparison: Comparison) -> Estimate | None:
        """Return the published value of an indicator, without interval, where there is one."""
        if any(arm.level not in self.performance for arm in comparison.arms):
            return None
        return comparison.estimate(lambda arm: np.array([self.performance[arm.level]]))


def load_reference(name: str | None) -> Reference | None:
    """Return the reference of that name; None for none.

    Raises:
        StudyError: there is none of that name.
    """
    if name is None:
        return None
    from swarm_logistics_env.studies.paper import PAPER

    known = {"paper": PAPER}
    if name not in known:
        raise StudyError(f"no reference {name!r}{suggest(name, known)}")
    return known[name]
