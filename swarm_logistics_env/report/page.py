"""What the script of the HTML page draws: points, seeds, delivery curves and runs."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue

from swarm_logistics_env import spi
from swarm_logistics_env.spi.summaries import Interval
from swarm_logistics_env.studies.comparison import Arm, Comparison
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.studies.verdict import Verdict, grouped
from swarm_logistics_env.tasks.task import DEFAULT
from swarm_logistics_env.warehouse import Fault
from swarm_logistics_env.warehouse.fault_text import text_of

from .answer import Answer
from .section import sentence

Json: TypeAlias = dict[str, JsonValue]
_MOST_TIMES = 150_000  # deliveries in the curves of a page: about 400 kB


@dataclass(frozen=True)
class Bar:
    """One value of the first screen's forest, in percent of its width.

    Attributes:
        number: of the verdict, which a click shows.
        verdict: its conclusion, for the colour.
        at, low, high: the value and its limits.
    """

    number: int
    verdict: str
    at: float
    low: float
    high: float


def bars(found: Answer) -> tuple[float, tuple[tuple[Bar, ...], ...]]:
    """Return where 0 stands on the shared axis, in percent, and the bars of every line."""
    tests = [test for line in found.lines for test in line.tests]
    values = [0.0, *(test.value for test in tests if test.value is not None)]
    span = max(max(values) - min(values), 0.5)
    # An interval that is much wider than the values lie apart leaves the axis.
    first, last = min(values) - span, max(values) + span

    def place(x: float | None, missing: float) -> float:
        within = min(max(missing if x is None else x, first), last)
        return round(100.0 * (within - first) / (last - first), 2)

    def bar(number: int, test: Verdict) -> Iterator[Bar]:
        if test.interval is not None:
            value, low, high = test.interval
            ends = place(low, value), place(high, value)
            yield Bar(number, test.conclusion or "blocked", place(value, value), *ends)

    return place(0.0, 0.0), tuple(
        tuple(one for n, test in zip(line.numbers, line.tests) for one in bar(n, test))
        for line in found.lines
    )


def page_data(results: StudyResults) -> dict[str, JsonValue]:
    """Return all that the page's script needs, as JSON holds it."""
    arms = {arm.case.key: arm for _, _, arm in results.plan.cells}
    places = {key: place for place, key in enumerate(arms)}
    labels = dict.fromkeys((*results.policies, *(a.case.policy.title for a in arms.values())))
    return {
        "policies": list(labels),
        "seeds": [int(seed) for seed in results.plan.seeds],
        "paired": results.plan.paired,
        "conditions": list(_conditions(results, list(arms.values()))),
        "questions": [_question(results, test, places) for test in results.verdicts],
        "views": [*_performance_views(results, places), *_indicator_views(results)],
        "first": _first(results.verdicts),
    }


def _conditions(results: StudyResults, arms: Sequence[Arm]) -> Iterator[Json]:
    delivered = sum(len(outcome.delivery_times) for outcome in results.outcomes.values())
    share = min(1.0, _MOST_TIMES / max(1, delivered))
    shown = max(1, int(share * len(results.plan.seeds)))
    for arm in arms:
        outcomes = [results.outcome(arm, seed) for seed in results.plan.seeds]
        yield {
            "name": f"{arm.case.policy.title}, {arm.setting}",
            "end": float(arm.case.scenario.duration),
            "p": [None if one is None else round(float(one.delivered), 4) for one in outcomes],
            # Deliveries in whole seconds, each as the time since the one before.
            "curves": [
                None if one is None or one.untimed is not None else _steps(one.delivery_times)
                for one in outcomes[:shown]
            ],
            "command": watch_command(arm),
        }


def _steps(times: NDArray[np.float64]) -> list[JsonValue]:
    gaps: list[JsonValue] = np.diff(np.rint(times).astype(int), prepend=0).tolist()
    return gaps


def watch_command(arm: Arm) -> str | None:
    """Return the command that plays a condition but for its seed; None: there is none."""
    case = arm.case
    if case.task.name != DEFAULT or case.behaviour:
        return None
    if not case.policy.is_text:
        return None
    words = ["swarm-logistics", "watch", "--policy", case.policy.name]
    default = case.task.default.model_dump(mode="json")
    for name, value in case.scenario.model_dump(mode="json").items():
        if value != default[name]:
            text = value if isinstance(value, str) else json.dumps(value, separators=(",", ":"))
            words += ["--set", f"{name}={text}"]
    for fault in case.faults:
        described = text_of(fault) if isinstance(fault, Fault) else None
        if described is None:
            return None
        words += ["--fault", described]
    return shlex.join(words)


def _question(results: StudyResults, test: Verdict, places: dict[str, int]) -> Json:
    told, compared = sentence(results, test), test.compared
    return {
        "policy": compared.policy,
        "table": compared.table,
        "head": told.head,
        "text": told.text,
        "verdict": told.verdict,
        "arms": [
            [compared.definition.performances[name], str(arm.setting), places[arm.case.key]]
            for name, arm in compared.arguments.items()
        ],
    }


def _first(tests: Sequence[Verdict]) -> int:
    """Return the question that the page opens with: the lowest value that is refuted, or any."""
    refuted = {
        number: test.value
        for number, test in enumerate(tests)
        if test.answer_holm == "refuted" and test.value is not None
    }
    return min(refuted, key=lambda number: refuted[number], default=0)


def _performance_views(results: StudyResults, places: dict[str, int]) -> Iterator[Json]:
    """Yield P of every policy in the conditions of each table, on one axis."""
    shown = [cell for cell in results.cells if cell.arm.setting.kind != "policy"]
    for table, here in grouped(shown, lambda cell: cell.table).items():
        categories = list(dict.fromkeys(row.words for row in here))
        yield {
            "name": f"P: {table}",
            "y": f"performance P over {_over(here[0].arm)}",
            "thresholds": [],
            "categories": [_short(one) for one in categories],
            "points": [
                {
                    "policy": row.policy,
                    "at": categories.index(row.words),
                    **_limits(row.mean),
                    "published": _number(row.published),
                    "condition": places[row.arm.case.key],
                }
                for row in here
                if row.n_seeds
            ],
        }


def _short(told: str) -> str:
    """Return a condition for an axis: "10" of "N = 10", "FM1 2" of "FM1, m = 2"."""
    told = told.replace(" -> ", "→")
    if "→" in told:
        return told.rpartition(" ")[2]
    name, equals, value = told.rpartition(" = ")
    if not equals:
        return told
    return value if not name.endswith(", m") else f"{name.removesuffix(', m')} {value}"


def _over(arm: Arm) -> str:
    """Return the label of the axis of a figure on which the conditions stand."""
    factors = {
        "size": "swarm size N",
        "fault": "failure mode and number m of faulty robots",
        "policy": "the policy in its place",
    }
    return factors.get(arm.setting.kind) or arm.setting.name


def _indicator_views(results: StudyResults) -> Iterator[Json]:
    """Yield every indicator of every policy, each with its value at every single seed."""
    numbers = {test.compared: number for number, test in enumerate(results.verdicts)}
    views = grouped(results.verdicts, lambda t: (t.compared.table, t.compared.indicator))
    for (table, indicator), here in views.items():
        # A question that is asked against two thresholds has one value.
        once = {(t.compared.policy, t.compared.label): t for t in reversed(here)}
        of_factor = grouped(reversed(once.values()), lambda t: t.compared.changed.setting.name)
        rows = [test for part in of_factor.values() for test in part]
        categories = list(dict.fromkeys(row.compared.label for row in rows))
        heading = rows[0].compared.definition.heading
        yield {
            "name": f"{indicator}: {table}",
            "y": f"{heading} over {_over(rows[0].compared.changed)}",
            "thresholds": [*sorted({float(test.compared.threshold) for test in here})],
            "categories": [_short(one) for one in categories],
            "points": [
                {
                    "policy": row.compared.policy,
                    "at": categories.index(row.compared.label),
                    **_limits(row.interval),
                    "published": _number(row.published),
                    "question": numbers[row.compared],
                    "seeds": _seed_by_seed(results, row.compared),
                }
                for row in rows
                if row.interval is not None
            ],
        }


def _seed_by_seed(results: StudyResults, compared: Comparison) -> list[JsonValue]:
    """Return an indicator's value from each seed alone; None where it is undefined."""
    if not results.plan.paired:
        return []
    where = compared.policy, compared.table
    samples = {arm: results.by_place[*where, arm].by_seed for arm in compared.arms}
    values: list[JsonValue] = []
    for place in range(len(results.plan.seeds)):
        try:
            one = compared.estimate({arm: p[place : place + 1] for arm, p in samples.items()})
        except spi.IndicatorError:
            values.append(None)
        else:
            values.append(_number(one.value))
    return values


def _limits(found: Interval) -> Json:
    return dict(zip(("value", "low", "high"), map(_number, found)))


def _number(value: float | None) -> float | None:
    """Return a number as JSON holds it: infinite limits become very large, missing ones null."""
    return None if value is None else float(np.clip(round(value, 4), -1e9, 1e9))
