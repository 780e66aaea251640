"""What one run gave: its deliveries, and what was counted of contacts and orders."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, ConfigDict, NonNegativeFloat, PlainSerializer
from pydantic.dataclasses import dataclass as validated

from swarm_logistics_env.world.warehouse.contacts import ContactMeasures
from swarm_logistics_env.world.warehouse.orders import OrderMeasures

Seconds: TypeAlias = NDArray[np.float64]


def _check_ascending(times: Seconds) -> Seconds:
    if times.size and not (np.isfinite(times).all() and (np.diff(times, prepend=0.0) >= 0.0).all()):
        raise ValueError("should ascend")
    return times


Times = Annotated[
    Seconds,
    BeforeValidator(lambda times: np.asarray(times, dtype=np.float64)),
    AfterValidator(_check_ascending),
    PlainSerializer(lambda times: times.tolist()),
]


_LONGEST_ERROR = 20_000  # characters
LAST_PART = 0.2  # of a run: who delivers nothing in it stands still


def _make_storable(error: object) -> object:
    """Return a text as files and databases hold it: no half signs, and not without end."""
    if not isinstance(error, str):
        return error
    text = error.encode(errors="backslashreplace").decode().replace("\0", "\\x00")
    half = _LONGEST_ERROR // 2
    return text if len(text) <= _LONGEST_ERROR else f"{text[:half]} [..] {text[-half:]}"


@dataclass(frozen=True)
class Deliveries:
    """What one run delivered, or the traceback of the error that ended it.

    Attributes:
        delivery_times: [s], ascending, shape (delivered,); its length is the paper's P.
        ended_at: [s].
        all_delivered: whether no item was left, so that more robots could not have delivered more.
        failed_robots: numbers of the robots that any fault names.
        anchoring_seconds: robot-seconds that working robots spent in contact range of failed ones;
            None: the task does not tell.
        digest: of the trajectory and the deliveries (`Episode.digest`); None: not known.
        error: traceback, its middle left out where it is very long; None: the run succeeded.
        wall_seconds: time it took [s]; no part of the result.
        untimed: P, 0 or more, where it is not the number of times; None: it is.
        least: P at least, of a recorded trial that was stopped and not counted, where `untimed` is
            the most that it may be; None: P is known.
    """

    delivery_times: Times = field(default_factory=lambda: np.empty(0))
    ended_at: NonNegativeFloat = 0.0
    all_delivered: bool = False
    failed_robots: tuple[int, ...] = ()
    anchoring_seconds: NonNegativeFloat | None = 0.0
    digest: str | None = None
    error: Annotated[str | None, BeforeValidator(_make_storable)] = None
    wall_seconds: float = 0.0  # a clock may be set back
    untimed: NonNegativeFloat | None = None
    least: NonNegativeFloat | None = None

    @property
    def delivered(self) -> float:
        """The paper's P, 0 or more: the number of items delivered, or a task's own measure."""
        return len(self.delivery_times) if self.untimed is None else self.untimed

    @property
    def longest_standstill(self) -> float | None:
        """The longest time without a delivery, from start to end [s]; None: times are unknown."""
        if self.untimed is not None and not self.delivery_times.size:
            return None
        times = np.concatenate([[0.0], self.delivery_times, [self.ended_at]])
        return float(np.diff(times).max())

    @property
    def stands_still(self) -> bool | None:
        """Whether nothing was delivered in the last fifth, though there was something to deliver.

        None: the times are unknown.
        """
        if self.longest_standstill is None:
            return None
        is_late = self.delivery_times > (1.0 - LAST_PART) * self.ended_at
        return not self.all_delivered and not is_late.any()

    @property
    def time_to_clear(self) -> float:
        """Time until every item was delivered [s]; infinite: not all were when the time was up."""
        return self.ended_at if self.all_delivered else math.inf


# A dataclass has the fields of its last base first.
@validated(
    frozen=True,
    config=ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False, extra="forbid"),
)
class Outcome(OrderMeasures, ContactMeasures, Deliveries):
    """What one run gave: its deliveries, then what was counted of contacts and orders, validated.

    A measure is None where nobody counted, too, as in runs of version 0.3.
    """

    @property
    def capped(self) -> bool:
        """Whether P would be larger if there had been more to deliver."""
        return bool(self.all_served) or (self.all_delivered and self.untimed is None)
