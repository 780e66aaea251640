"""What the script of the HTML page draws: points, seeds, delivery curves, runs and replays."""

from __future__ import annotations

import base64
import json
import shlex
import zlib
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.errors import SwarmLogisticsError
from swarm_logistics_env.fault_text import text_of
from swarm_logistics_env.studies.comparisons import Arm, Comparison
from swarm_logistics_env.studies.indicator_table import Finding, findings_of
from swarm_logistics_env.studies.performance_table import Cell, cells_of, groups_of
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.tasks.policy_choice import runs_code
from swarm_logistics_env.tasks.task import DEFAULT
from swarm_logistics_env.tasks.warehouse_task import Recording, record_run

from . import wording
from .verdict_matrix import VerdictMatrix

if TYPE_CHECKING:
    import pandas as pd

_MOST_REPLAYS = 3
_MOST_TIMES = 150_000  # deliveries in the curves of a page: about 400 kB
_STEPS_A_METRE = 50  # of positions in a replay


def page_data(results: StudyResults, matrix: VerdictMatrix) -> dict[str, Any]:
    """Return all that the page's script needs, as JSON holds it."""
    arms = {arm.condition.key: arm for _, _, arm in results.plan.cells}
    places = {key: place for place, key in enumerate(arms)}
    labels = list(dict.fromkeys(arm.condition.policy.label for arm in arms.values()))
    names = [*matrix.policies, *(label for label in labels if label not in matrix.policies)]
    return {
        "policies": names,
        "seeds": [int(seed) for seed in results.plan.seeds],
        "paired": results.plan.paired,
        "conditions": list(_conditions(results, arms.values())),
        "questions": [_question(results, test, places) for test in findings_of(results.indicators)],
        "views": [*_performance_views(results, places), *_indicator_views(results)],
        "first": _first(results.indicators),
        "replays": list(_replays(results, places)),
    }


def _conditions(results: StudyResults, arms: Any) -> Iterator[dict[str, Any]]:
    arms = list(arms)
    delivered = sum(len(outcome.delivery_times) for outcome in results.outcomes.values())
    share = min(1.0, _MOST_TIMES / max(1, delivered))
    shown = max(1, int(share * len(results.plan.seeds)))
    for arm in arms:
        outcomes = [results.outcome(arm, seed) for seed in results.plan.seeds]
        yield {
            "name": f"{arm.condition.policy.label}, {arm.setting}",
            "end": float(arm.condition.duration),
            "p": [None if one is None else round(float(one.delivered), 4) for one in outcomes],
            # Deliveries in whole seconds, each as the time since the one before.
            "curves": [
                None if one is None or one.untimed is not None else _steps(one.delivery_times)
                for one in outcomes[:shown]
            ],
            "command": watch_command(arm),
        }


def _steps(times: NDArray[np.float64]) -> list[int]:
    gaps: list[int] = np.diff(np.rint(times).astype(int), prepend=0).tolist()
    return gaps


def watch_command(arm: Arm) -> str | None:
    """Return the command that plays a condition but for its seed; None: there is none."""
    condition = arm.condition
    if condition.task.name != DEFAULT or not isinstance(condition.policy.source, str):
        return None
    if condition.behaviour:
        return None
    words = ["swarm-logistics", "watch", "--policy", condition.policy.source]
    default = condition.task.default.model_dump(mode="json")
    for name, value in condition.scenario.model_dump(mode="json").items():
        if value != default[name]:
            text = value if isinstance(value, str) else json.dumps(value, separators=(",", ":"))
            words += ["--set", f"{name}={text}"]
    for fault in condition.faults:
        described = text_of(fault)
        if described is None:
            return None
        words += ["--fault", described]
    return shlex.join(words)


def _question(results: StudyResults, test: Finding, places: dict[str, int]) -> dict[str, Any]:
    told = wording.sentence(results, test)
    compared: Comparison = test.compared
    return {
        "policy": test.policy,
        "table": test.table,
        "head": told.head,
        "text": told.text,
        "verdict": told.verdict,
        "arms": [
            [compared.definition.performances[name], str(arm.setting), places[arm.condition.key]]
            for name, arm in compared.arguments.items()
        ],
    }


def _first(tests: pd.DataFrame) -> int:
    """Return the question that the page opens with: the lowest value that is refuted, or any."""
    decided = tests["value"].where(tests["answer_holm"] == "refuted", np.inf).fillna(np.inf)
    return int(decided.to_numpy().argmin())


def _performance_views(results: StudyResults, places: dict[str, int]) -> Iterator[dict[str, Any]]:
    """Yield P of every policy in the conditions of each table, on one axis."""
    cells = results.performance[results.performance["kind"] != "policy"]
    for table, here in groups_of(cells, "table"):
        # One failure mode after the other, as in the tables.
        rows = [row for _, part in groups_of(here, "factor") for row in cells_of(part)]
        categories = list(dict.fromkeys(row.cell for row in rows))
        yield {
            "name": f"P: {table}",
            "y": f"performance P over {_over(rows[0])}",
            "thresholds": [],
            "categories": [_short(one) for one in categories],
            "points": [
                {
                    "policy": row.policy,
                    "at": categories.index(row.cell),
                    **_limits(row.mean, row.low, row.high),
                    "published": _number(row.published),
                    "condition": places[row.arm.condition.key],
                }
                for row in rows
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


def _over(row: Cell | Finding) -> str:
    """Return the label of the axis of a figure on which the conditions stand."""
    factors = {
        "size": "swarm size N",
        "fault": "failure mode and number m of faulty robots",
        "policy": "the policy in its place",
    }
    return factors.get(row.kind) or f"{row.factor}"


def _indicator_views(results: StudyResults) -> Iterator[dict[str, Any]]:
    """Yield every indicator of every policy, each with its value at every single seed."""
    tests = results.indicators.assign(number=range(len(results.indicators)))
    tests = tests.drop_duplicates(["policy", "table", "indicator", "comparison"])
    for (table, indicator), here in groups_of(tests, "table", "indicator"):
        parts = [part for _, part in groups_of(here, "factor")]
        numbers = [number for part in parts for number in part["number"]]
        rows = [row for part in parts for row in findings_of(part)]
        categories = list(dict.fromkeys(row.comparison for row in rows))
        yield {
            "name": f"{indicator}: {table}",
            "y": f"{rows[0].compared.definition.heading} over {_over(rows[0])}",
            "thresholds": sorted({float(x) for x in here["threshold"]}),
            "categories": [_short(one) for one in categories],
            "points": [
                {
                    "policy": row.policy,
                    "at": categories.index(row.comparison),
                    **_limits(row.value, row.low, row.high),
                    "published": _number(row.published),
                    "question": number,
                    "seeds": _seed_by_seed(results, row.compared),
                }
                for number, row in zip(numbers, rows)
                if row.estimate is not None
            ],
        }


def _seed_by_seed(results: StudyResults, compared: Comparison) -> list[float | None]:
    """Return an indicator's value from each seed alone; None where it is undefined."""
    if not results.plan.paired:
        return []
    samples = {
        arm: results.by_arm[compared.policy, compared.table, arm].by_seed for arm in compared.arms
    }
    values: list[float | None] = []
    for place in range(len(results.plan.seeds)):
        try:
            # It is called before `place` changes.
            one = compared.estimate(lambda arm: samples[arm][place : place + 1])  # noqa: B023
        except spi.IndicatorError:
            values.append(None)
        else:
            values.append(_number(one.value))
    return values


def _limits(value: float, low: float, high: float) -> dict[str, float | None]:
    return {"value": _number(value), "low": _number(low), "high": _number(high)}


def _number(value: float | None) -> float | None:
    """Return a number as JSON holds it: infinite limits become very large, missing ones null."""
    if not wording.is_known(value):
        return None
    return float(np.clip(round(value, 4), -1e9, 1e9))


def _replays(results: StudyResults, places: dict[str, int]) -> Iterator[dict[str, Any]]:
    """Yield the most telling runs beside their twins, as far as they can be played again."""
    taken: set[str] = set()
    recorded: dict[str, dict[str, Any] | None] = {}
    for test in _telling(results.indicators):
        original, changed = test.compared.original, test.compared.changed
        if changed.condition.key in taken or len(taken) == _MOST_REPLAYS:
            continue
        seed = _typical_seed(results, original, changed)
        pair = []
        for arm in (changed, original):
            run = arm.condition.run(results.plan.code, seed)
            if run.key not in recorded:
                recorded[run.key] = _recorded(results, arm, seed)
            pair.append(recorded[run.key])
        if all(pair):
            taken.add(changed.condition.key)
            yield {
                "name": f"{test.policy}, {changed.setting}",
                "seed": int(seed),
                "runs": pair,
                "conditions": [places[arm.condition.key] for arm in (changed, original)],
            }


def _telling(tests: pd.DataFrame) -> Iterator[Finding]:
    """Yield the faults that harm most and, of several policies, where they differ most."""
    faults = tests[(tests["kind"] == "fault") & tests["value"].notna()]
    if faults.empty:
        return
    faults = faults[faults["indicator"] == faults["indicator"].iloc[-1]]
    spread = faults.groupby(["table", "comparison"])["value"].transform(lambda x: x.max() - x.min())
    if spread.max() > 0:
        contrast = faults[spread == spread.max()].sort_values("value")
        yield from findings_of(contrast.iloc[[0, -1]])
    yield from findings_of(faults.sort_values("value", kind="stable"))


def _typical_seed(results: StudyResults, original: Arm, changed: Arm) -> int:
    """Return the seed at which the change of P is the median one."""
    seeds = list(results.plan.seeds)
    changes = []
    for seed in seeds:
        before, after = (results.outcome(arm, seed) for arm in (original, changed))
        changes.append(after.delivered - before.delivered if before and after else -np.inf)
    return seeds[int(np.argsort(changes, kind="stable")[len(seeds) // 2])]


def _recorded(results: StudyResults, arm: Arm, seed: int) -> dict[str, Any] | None:
    """Return a stored run, played again; None: it is not the same any more, or cannot be played."""
    condition, outcome = arm.condition, results.outcome(arm, seed)
    source = condition.policy.source
    if condition.task.name != DEFAULT or outcome is None or outcome.digest is None:
        return None
    # A store's text must run no code.
    if results.plan.code != condition.task.code() or runs_code(source):
        return None
    run = condition.run(results.plan.code, seed)
    try:
        found = record_run(source, condition, seed, run.policy_seed)
    except SwarmLogisticsError:  # the policy's file is gone, say
        return None
    if found.digest != outcome.digest:
        return None
    return {
        "name": str(arm.setting),
        "times": _steps(outcome.delivery_times),
        **_packed(found),
    }


def _packed(found: Recording) -> dict[str, Any]:
    """Return a recording as text: positions in steps, each as the change since the frame before."""
    scenario = found.scenario
    return {
        "width": scenario.warehouse_width,
        "height": scenario.warehouse_height,
        "delivery": scenario.storage_width,
        "robot": scenario.robot_radius,
        "item": scenario.item_radius,
        "scale": _STEPS_A_METRE,
        "period": found.period,
        "frames": len(found.robots),
        # Series of each: two coordinates of every robot and item, one mark of every robot.
        "count": {
            "robots": 2 * found.robots.shape[1],
            "items": 2 * found.items.shape[1],
            "carrying": found.robots.shape[1],
            "failed": found.robots.shape[1],
        },
        "robots": _text(np.rint(found.robots * _STEPS_A_METRE)),
        "items": _text(np.rint(found.items * _STEPS_A_METRE)),
        "carrying": _text(found.carrying),
        "failed": _text(found.failed),
    }


def _text(frames: NDArray[Any]) -> str:
    series = frames.reshape(len(frames), -1).T.astype("<i2")
    changes = np.diff(series, axis=1, prepend=np.int16(0)).astype("<i2")
    return base64.b64encode(zlib.compress(changes.tobytes(), 9)).decode("ascii")
