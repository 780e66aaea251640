"""What P of a run is, where it is not what the task counts: a measure of its orders or deliveries.

The indicators are ratios of P, so P has a true zero and more of it is better. Where less of a
measure is better, its worst value is declared and counts as P = 0, and 0 of it as P = 1.
"""

from __future__ import annotations

from typing import NamedTuple, Self

from pydantic import PositiveFloat, model_validator

from swarm_logistics_env.core.errors import StudyError, suggest
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.world.scenario import Scenario

from .outcome import Outcome


class Measure(NamedTuple):
    """A field of an outcome that may be P.

    Attributes:
        words: what it is.
        unit: of it; empty: it has none.
        is_gain: whether more of it is better.
        largest: the largest value that it can have; None: no largest.
        needs: the field of the warehouse without which nothing is measured; empty: none.
    """

    words: str
    unit: str = ""
    is_gain: bool = False
    largest: float | None = None
    needs: str = ""


MEASURES = {
    "on_time": Measure(
        "number of orders that were served by their due time", "orders", True, needs="order_due"
    ),
    "share_on_time": Measure(
        "share of the orders that were served by their due time", "", True, 1.0, "order_due"
    ),
    "mean_tardiness": Measure("mean time by which orders were late", "s", needs="order_due"),
    "p95_tardiness": Measure(
        "95th percentile of the time by which orders were late", "s", needs="order_due"
    ),
    "longest_queue": Measure(
        "largest number of orders that were open or waited", "orders", needs="orders"
    ),
    "longest_standstill": Measure("longest time without a delivery", "s"),
    "stands_still": Measure(
        "share of runs that do not stand still: 1 where something was delivered in the last fifth, "
        "or nothing was left, else 0",
        largest=1.0,
    ),
}


class Performance(Record):
    """A measure of a run as its P.

    Args:
        measure: a key of `MEASURES`.
        worst: of a measure of which less is better, the value that counts as P = 0, in its unit.
    """

    error_type = StudyError

    measure: str
    worst: PositiveFloat | None = None

    @classmethod
    def of(cls, source: object) -> object:
        """Return the performance of a text, e.g. "p95_tardiness:60"; others as they are.

        Raises:
            StudyError: there is no such measure, its worst value is missing, or it has none.
        """
        if not isinstance(source, str):
            return source
        measure, colon, worst = source.partition(":")
        fields = {"measure": measure, **({"worst": worst} if colon else {})}
        return cls.model_validate(fields)

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        if self.measure not in MEASURES:
            raise ValueError(f"no measure {self.measure!r}{suggest(self.measure, MEASURES)}")
        measure = MEASURES[self.measure]
        has_worst = self.worst is not None
        if has_worst and (measure.is_gain or measure.largest is not None):
            raise ValueError(f"has no worst value: should be {self.measure!r}")
        if not (has_worst or measure.is_gain or measure.largest is not None):
            raise ValueError(
                f"less of {self.measure} is better: should say which value counts as P = 0, e.g. "
                f"'{self.measure}:60' [{measure.unit}]"
            )
        return self

    def __str__(self) -> str:
        return self.measure if self.worst is None else f"{self.measure}:{self.worst:.15g}"

    @property
    def words(self) -> str:
        """What P is, as a sentence for the report."""
        measure = MEASURES[self.measure]
        if measure.is_gain:
            return f"the {measure.words}"
        if self.worst is None:  # a share of runs
            return measure.words
        return f"1 - x / {self.worst:g} {measure.unit}, at least 0; x is the {measure.words}"

    @property
    def counted(self) -> str:
        """What P counts; empty: it is no count."""
        measure = MEASURES[self.measure]
        return measure.unit if measure.is_gain else ""

    @property
    def largest(self) -> float | None:
        """The largest P; None: there is none."""
        measure = MEASURES[self.measure]
        return measure.largest if measure.is_gain else 1.0

    def refuse_unmeasured(self, scenario: object) -> None:
        """Raise StudyError if nothing of this measure is to be had in a scenario."""
        needs = MEASURES[self.measure].needs
        if not needs:
            return
        if not isinstance(scenario, Scenario):
            raise StudyError(f"performance = {str(self)!r}: should be of the warehouse's orders")
        is_there = scenario.has_due_times if needs == "order_due" else scenario.has_orders
        if not is_there and scenario.order_file is not None:
            raise StudyError(
                f"performance = {str(self)!r}: no row of the file of orders has a due time: "
                "should have a column due"
            )
        if not is_there:
            raise StudyError(
                f"performance = {str(self)!r}: {needs} = {getattr(scenario, needs)!r}: should be "
                "set, or the runs have no such measure"
            )

    def of_run(self, outcome: Outcome) -> float:
        """Return P of a run.

        A run without an order that is due has none on time, and none that is late.

        Raises:
            StudyError: the task does not tell when something was delivered.
        """
        measure = MEASURES[self.measure]
        value = getattr(outcome, self.measure)
        if value is None and not measure.needs:
            raise StudyError(
                f"performance = {str(self)!r}: should be of a task that tells when something was "
                "delivered"
            )
        if measure.is_gain:
            none_due = 0.0 if measure.largest is None else measure.largest
            return none_due if value is None else float(value)
        worst = self.worst or 1.0  # a share of runs
        return max(0.0, 1.0 - (value or 0.0) / worst)

    def is_capped(self, outcome: Outcome) -> bool:
        """Return whether P could not be larger, however good the swarm."""
        if self.measure == "on_time":
            return outcome.share_on_time == 1.0
        return self.of_run(outcome) == self.largest
