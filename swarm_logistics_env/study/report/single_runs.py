"""Single runs, seed by seed: what a click in the page shows, and the dots of its drawings."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from more_itertools import map_reduce
from pydantic import JsonValue

from swarm_logistics_env.study.questions.comparison import Arm, Comparison
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case
from swarm_logistics_env.study.tasks.task_world import p_of, world_of
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults

from .figures import X_LABELS
from .points import Panel, Point
from .section import P_LEVEL, Sentence

Json: TypeAlias = dict[str, JsonValue]
# Mean P over the trainings of every condition, at the seeds drawn, by the key of its case; None: a
# run failed, or is missing.
Runs: TypeAlias = Mapping[str, Sequence[float | None]]
_MOST_DOTS = 20_000  # runs that a page draws, the first of each condition
_MOST_TIMES = 150_000  # deliveries in the curves of a page: about 400 kB


class SingleRuns(NamedTuple):
    """The single runs of a study.

    Attributes:
        panels: P of every policy in the conditions of each table, a dot a run; by the table.
        note: what the marks of the panels are.
        data: seeds, conditions and questions, as the page's script reads them.
    """

    panels: Mapping[str, Panel]
    note: str
    data: Json


def single_runs(results: StudyResults, sentences: Sequence[Sentence]) -> SingleRuns:
    """Return the single runs of a study.

    Args:
        sentences: every verdict in words, in the order of the study.
    """
    plan = results.plan
    arms = {arm.case.key: arm for _, _, arm in plan.cells}  # each condition once
    seeds = plan.seeds[: max(1, _MOST_DOTS // len(arms))]
    runs = {
        key: [
            _mean_p(
                arm.case, [results.succeeded.get((case.key, seed)) for case in arm.case.trainings]
            )
            for seed in seeds
        ]
        for key, arm in arms.items()
    }
    indices = {key: index for index, key in enumerate(arms)}
    data: Json = {
        # A script rounds larger numbers.
        "seeds": [seed if seed < 2**53 else str(seed) for seed in plan.seeds],
        "paired": plan.paired,
        "conditions": list(_conditions(results, arms, runs)),
        "questions": [
            _question(verdict.compared, words, indices)
            for verdict, words in zip(results.verdicts, sentences)
        ],
    }
    repeat = "seed" if plan.paired else "trial"
    only = f" of the first {len(seeds):,}" if len(seeds) < len(plan.seeds) else ""
    panels = dict(_performance_panels(results, runs))
    points = [point for panel in panels.values() for point in panel.points]
    crosses = "; crosses: published" if any(p.published is not None for p in points) else ""
    note = f"Means; bars: {P_LEVEL} intervals; dots: one {repeat}{only}, click it{crosses}."
    return SingleRuns(panels, note, data)


def _performance_panels(results: StudyResults, runs: Runs) -> Iterator[tuple[str, Panel]]:
    """Yield P of every policy in the conditions of each table, with its runs; and the table."""
    conditions = list(runs)
    policies = results.policies
    shown = [cell for cell in results.cells if cell.arm.setting.kind != "policy"]
    by_table: dict[str, list[Cell]] = map_reduce(shown, lambda cell: cell.table)
    for table, cells in by_table.items():
        points = tuple(
            Point(
                cell.policy,
                policies.index(cell.policy),
                # "N = 10" stands there as "10", "FM1, m = 2" as "FM1 2".
                re.sub(r"^\w+ = |, m =", "", cell.words),
                *cell.mean,
                # The published values stand beside the first policy.
                cell.published if cell.policy == policies[0] else None,
                decided=True,
                saturated=cell.saturated,
                link=f"condition-{conditions.index(cell.arm.case.key)}",
                runs=tuple(runs[cell.arm.case.key]),
            )
            for cell in cells
            if cell.n_seeds
        )
        setting = cells[0].arm.setting
        x_label = X_LABELS.get(setting.kind, setting.name)
        if points:
            yield table, Panel("", f"performance {results.plan.name_of_p}", points, (), x_label)


def _conditions(results: StudyResults, arms: Mapping[str, Arm], runs: Runs) -> Iterator[Json]:
    n_deliveries = sum(len(outcome.delivery_times) for outcome in results.outcomes.values())
    share = min(1.0, _MOST_TIMES / max(1, n_deliveries))
    n_curves = max(1, int(share * len(results.plan.seeds)))
    for key, arm in arms.items():
        first_training = arm.case.trainings[0]
        outcomes = [
            results.succeeded.get((first_training.key, seed)) for seed in results.plan.seeds
        ]
        yield {
            "name": f"{arm.case.policy.title}, {arm.setting}",
            "end": float(arm.case.scenario.duration),
            "p": [*runs[key]],
            # Deliveries in whole seconds, each as the time since the one before; of the first
            # training, where there are several.
            "curves": [
                None
                if outcome is None or outcome.untimed is not None
                else np.diff(np.rint(outcome.delivery_times).astype(int), prepend=0).tolist()
                for outcome in outcomes[:n_curves]
            ],
            "command": world_of(first_training.task).watch_command(first_training),
        }


def _mean_p(case: Case, outcomes: Sequence[Outcome | None]) -> float | None:
    """Return mean P over the trainings at one seed; None: a run failed, or is missing."""
    p = [p_of(case, outcome) for outcome in outcomes if outcome is not None]
    return round(float(np.mean(p)), 4) if len(p) == len(outcomes) else None


def _question(comparison: Comparison, words: Sentence, indices: Mapping[str, int]) -> Json:
    return {
        "table": comparison.table,
        "head": words.head,
        "text": words.text,
        "arms": [
            [comparison.definition.performances[name], str(arm.setting), indices[arm.case.key]]
            for name, arm in comparison.arguments.items()
        ],
    }
