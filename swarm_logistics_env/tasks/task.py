"""What playing a task once gives."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Outcome:
    """What one run gave: an episode's result, or the traceback of the error that ended it.

    Attributes:
        run: key of the run.
        delivery_times: [s], ascending, shape (delivered,); its length is the paper's P.
        ended_at: [s].
        all_delivered: whether no item was left, so that more robots could not have delivered more.
        failed_robots: numbers of the robots that any fault names.
        anchoring_seconds: robot-seconds that working robots spent in contact range of failed ones.
        digest: of the trajectory and the deliveries (`Episode.digest`); None: not known.
        error: traceback; None: the run succeeded.
        wall_seconds: time it took [s]; no part of the result.
        untimed: items delivered, where only their number is known; None: the times tell it.
    """

    run: str
    delivery_times: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    ended_at: float = 0.0
    all_delivered: bool = False
    failed_robots: tuple[int, ...] = ()
    anchoring_seconds: float = 0.0
    digest: str | None = None
    error: str | None = None
    wall_seconds: float = 0.0
    untimed: int | None = None

    @property
    def delivered(self) -> int:
        """The paper's P [items]."""
        return len(self.delivery_times) if self.untimed is None else self.untimed
