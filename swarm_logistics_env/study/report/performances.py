"""P of each policy and task where the swarm is as it should be, in words."""

from __future__ import annotations

import math
from typing import NamedTuple

from more_itertools import map_reduce

from swarm_logistics_env.study.questions.comparison import CONFIDENCE
from swarm_logistics_env.study.tasks.task_world import counted_in
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.study.verdicts.results import StudyResults

from . import section


class Performance(NamedTuple):
    """P of a policy, in one task, where the swarm is as it should be.

    Attributes:
        in_words: e.g. "P [95 %] = 40.0 [39.5, 40.5] items in 500 s, N = 25, no fault".
        p: P alone, with its interval.
        condition: where that is, e.g. "N = 25, no fault".
    """

    in_words: str
    p: str
    condition: str


def performances(results: StudyResults) -> dict[str, Performance]:
    """Return P of each policy and task where the swarm is as it should be."""
    sound_cells = _sound_cells(results)
    means = {subject: section.mean_p(cell) for subject, cell in sound_cells.items()}
    engine = results.plan.unusual_engine
    behind = f", engine {engine}" if engine else ""
    by_subject = {}
    for subject, cell in sound_cells.items():
        case = cell.arm.case
        has_interval = _counts_anything(cell) and cell.mean.low is not None
        level = f" [{section.P_LEVEL}]" if has_interval else ""
        text = f"{results.plan.name_of_p}{level} = {_mean_in_words(cell, means[subject])}"
        if counted := counted_in(case):
            text += f" {counted} in {case.scenario.duration:g} s"
        condition = _condition(results, cell)
        p = _p_alone(cell, means[subject])
        by_subject[subject] = Performance(f"{text}, {condition}{behind}", p, condition)
    return by_subject


def _sound_cells(results: StudyResults) -> dict[str, Cell]:
    """Return the cell of each policy and task where the swarm is as it should be."""
    played = [cell for cell in results.cells if cell.n_seeds]
    conditions = [cell for cell in played if cell.arm.setting.kind != "policy"]
    sound_cells: dict[str, Cell] = {}
    by_subject: dict[str, list[Cell]] = map_reduce(
        conditions, lambda cell: results.subjects[cell.arm.case].name
    )
    for subject, cells in by_subject.items():
        # Where the swarm is as it should be, or else in the first condition.
        sound = [c for c in cells if c.arm.setting.kind == "fault" and not c.arm.setting.value]
        sound_cells[subject] = (sound or cells)[0]
    if not conditions:  # policies alone are compared: in the first table
        for cell in played:
            if cell.table == played[0].table:
                sound_cells.setdefault(cell.arm.setting.name, cell)
    judged = results.policies

    def place(subject: str) -> int:
        # A policy that others are compared with stands behind them.
        policy = sound_cells[subject].arm.case.policy.title
        return judged.index(policy) if policy in judged else len(judged)

    return {subject: sound_cells[subject] for subject in sorted(sound_cells, key=place)}


def _condition(results: StudyResults, cell: Cell) -> str:
    """Return where P of a policy is told, e.g. "N = 25, no fault"."""
    setting = cell.arm.setting
    task = results.plan.specification.played
    condition = f"N = {cell.arm.case.scenario.n_robots}"
    if setting.kind == "policy":
        condition += f", {cell.table}"
    elif setting.kind != "size":
        condition += f", {setting}"
    if task.name != "warehouse" and not results.plan.origin:
        condition += f", task {task.name}"
    return condition


def _counts_anything(cell: Cell) -> bool:
    """Return whether something was delivered, or P is another measure, of which 0 tells as much."""
    return bool(cell.by_seed.any() or cell.arm.case.performance)


def _p_alone(cell: Cell, mean: str) -> str:
    """Return mean P for a table; where nothing was delivered, the upper limit of a Poisson mean."""
    if _counts_anything(cell):
        return mean
    return f"0 (at most {-math.log(1.0 - CONFIDENCE) / cell.n_seeds:.2f})"


def _mean_in_words(cell: Cell, mean: str) -> str:
    """Return mean P with what limits it."""
    if not _counts_anything(cell):
        reason = f"as none of {cell.n_seeds} runs delivered anything"
        if cell.problem:
            reason += f"; {cell.problem}"
        return f"{_p_alone(cell, mean).removesuffix(')')} at {section.P_LEVEL}, {reason})"
    if cell.problem:
        mean += f" ({cell.problem} and do not count)"
    if any(outcome.all_delivered for outcome in cell.outcomes):
        mean += f", all items after {section.time_to_clear(cell)} s"
    return mean
