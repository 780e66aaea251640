"""What the script of the HTML page draws: points, seeds, delivery curves and runs."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from pydantic import JsonValue

from swarm_logistics_env.grouping import grouped
from swarm_logistics_env.questions.comparison import Arm
from swarm_logistics_env.tasks.task import DEFAULT, Outcome
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.verdicts.verdict import Verdict
from swarm_logistics_env.warehouse.faults import Fault, text_of

from .answer import Answer
from .figures import X_LABELS, indicator_panels
from .section import P_LEVEL, levels, sentence

Json: TypeAlias = dict[str, JsonValue]
_MOST_TIMES = 150_000  # deliveries in the curves of a page: about 400 kB


def axis(answer: Answer) -> tuple[float, float]:
    """Return the ends of the axis that all intervals of the first screen share."""
    values = [0.0, *(verdict.value for verdict in answer.verdicts if verdict.value is not None)]
    # An interval that is much wider than the values lie apart leaves the axis.
    span = max(max(values) - min(values), 0.5)
    return min(values) - span, max(values) + span


def page_data(results: StudyResults) -> Json:
    """Return all that the page's script needs, as JSON holds it."""
    arms = {arm.case.key: arm for _, _, arm in results.plan.cells}
    indices = {key: index for index, key in enumerate(arms)}
    return {
        "policies": [*results.policies],
        # A script rounds larger numbers.
        "seeds": [seed if seed < 2**53 else str(seed) for seed in results.plan.seeds],
        "paired": results.plan.paired,
        "conditions": list(_conditions(results, list(arms.values()))),
        "questions": [_question(results, verdict, indices) for verdict in results.verdicts],
        "views": [*_performance_views(results, indices), *_indicator_views(results)],
    }


def _conditions(results: StudyResults, arms: Sequence[Arm]) -> Iterator[Json]:
    n_deliveries = sum(len(outcome.delivery_times) for outcome in results.outcomes.values())
    share = min(1.0, _MOST_TIMES / max(1, n_deliveries))
    n_curves = max(1, int(share * len(results.plan.seeds)))
    for arm in arms:
        trainings = [replace(arm, case=case) for case in arm.case.trainings]
        at_seed = [
            [results.outcome(training, seed) for training in trainings]
            for seed in results.plan.seeds
        ]
        first_training = [outcomes[0] for outcomes in at_seed[:n_curves]]
        yield {
            "name": f"{arm.case.policy.title}, {arm.setting}",
            "end": float(arm.case.scenario.duration),
            "p": [_mean_p(outcomes) for outcomes in at_seed],
            # Deliveries in whole seconds, each as the time since the one before; of the first
            # training, where there are several.
            "curves": [
                None
                if outcome is None or outcome.untimed is not None
                else _steps(outcome.delivery_times)
                for outcome in first_training
            ],
            "command": watch_command(trainings[0]),
        }


def _mean_p(outcomes: Sequence[Outcome | None]) -> float | None:
    """Return mean P over the trainings at one seed; None: a run failed, or is missing."""
    p = [outcome.delivered for outcome in outcomes if outcome is not None]
    return round(float(np.mean(p)), 4) if len(p) == len(outcomes) else None


def _steps(times: ArrayLike) -> list[JsonValue]:
    return [*np.diff(np.rint(times).astype(int), prepend=0).tolist()]


def watch_command(arm: Arm) -> str | None:
    """Return the command that plays a condition but for its seed; None: there is none."""
    case = arm.case
    if case.task.name != DEFAULT or case.behaviour or not case.policy.is_text:
        return None
    words = ["swarm-logistics", "watch", "--policy", case.policy.name]
    # A class that is typed is trusted by that; the code in a file is not.
    if case.policy.runs_code and ":" not in case.policy.name:
        words.append("--trust-code")
    default = case.task.default.model_dump(mode="json")
    for name, value in case.scenario.model_dump(mode="json").items():
        if value != default[name]:
            text = value if isinstance(value, str) else json.dumps(value, separators=(",", ":"))
            words += ["--set", f"{name}={text}"]
    for fault in case.faults:
        text_of_fault = text_of(fault) if isinstance(fault, Fault) else None
        if text_of_fault is None:
            return None
        words += ["--fault", text_of_fault]
    return shlex.join(words)


def _question(results: StudyResults, verdict: Verdict, indices: dict[str, int]) -> Json:
    words = sentence(results, verdict)
    comparison = verdict.compared
    return {
        "table": comparison.table,
        "head": words.head,
        "text": words.text,
        "arms": [
            [comparison.definition.performances[name], str(arm.setting), indices[arm.case.key]]
            for name, arm in comparison.arguments.items()
        ],
    }


def _performance_views(results: StudyResults, indices: dict[str, int]) -> Iterator[Json]:
    """Yield P of every policy in the conditions of each table, on one axis."""
    shown = [cell for cell in results.cells if cell.arm.setting.kind != "policy"]
    for table, cells in grouped(shown, lambda cell: cell.table).items():
        categories = list(dict.fromkeys(cell.words for cell in cells))
        setting = cells[0].arm.setting
        yield {
            "name": f"P: {table}",
            "y": f"performance P over {X_LABELS.get(setting.kind, setting.name)}",
            "level": P_LEVEL,
            "thresholds": [],
            # "N = 10" stands there as "10", "FM1, m = 2" as "FM1 2".
            "categories": [re.sub(r"^\w+ = |, m =", "", category) for category in categories],
            "points": [
                {
                    "policy": cell.policy,
                    "at": categories.index(cell.words),
                    **_limits(*cell.mean),
                    "published": _number(cell.published),
                    "condition": indices[cell.arm.case.key],
                }
                for cell in cells
                if cell.n_seeds
            ],
        }


def _indicator_views(results: StudyResults) -> Iterator[Json]:
    """Yield every pair of axes of the figures."""
    numbers = {verdict.compared: number for number, verdict in enumerate(results.verdicts)}
    for condition, panel in indicator_panels(results):
        categories = list(dict.fromkeys(point.category for point in panel.points))
        yield {
            "name": f"{panel.verdicts[0].compared.indicator}: {condition}",
            "y": f"{panel.y_label} over {panel.x_label}",
            "level": levels(panel.verdicts),
            "thresholds": [float(threshold) for threshold in panel.thresholds],
            "categories": [*categories],
            "points": [
                {
                    "policy": point.series,
                    "at": categories.index(point.category),
                    **_limits(point.value, point.low, point.high),
                    "published": _number(point.published),
                    "question": numbers[verdict.compared],
                }
                for point, verdict in zip(panel.points, panel.verdicts)
                if point.value is not None
            ],
        }


def _limits(*limits: float | None) -> Json:
    return dict(zip(("value", "low", "high"), map(_number, limits)))


def _number(value: float | None) -> float | None:
    """Return a number as JSON holds it: infinite limits become very large, missing ones null."""
    return None if value is None else float(np.clip(round(value, 4), -1e9, 1e9))
