"""Results of studies whose outcomes are made up, so that the answer is known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparison import NO_FAULT, Setting
from swarm_logistics_env.studies.presets import PAPER
from swarm_logistics_env.studies.results import StudyResults, judge
from swarm_logistics_env.studies.verdict import Verdict
from swarm_logistics_env.tasks.task import Outcome

# The specification of the statistics prints these to three decimals.
GOLDEN = {
    "S": [1.000, 0.611, 0.276, 1.091, 0.978, 0.804, 0.208, -0.135],
    "FT": [0.051, 0.077, -0.026, 0.026, 0.154, -0.026, 0.026, 0.154, 0.103, 0.0, -0.513, -0.615],
    "R": [0.091, 0.054, 0.017, 0.066, 0.131, 0.017, 0.066, 0.131, 0.146, 0.040, -0.535, -0.572],
    "A": [0.872, 0.723, 0.723, 0.610, 0.268, 0.187, -0.773],
}


def delivered(count: float, **fields: Any) -> Outcome:
    return Outcome(delivery_times=np.arange(float(count)), **fields)


def judged(study: Study, play: Callable[[str, Setting, int], Outcome]) -> StudyResults:
    """The study if a run of a policy in a setting at a seed gave `play(policy, setting, seed)`."""
    plan = study.plan()
    levels = {arm.case.key: (policy, arm.setting) for policy, _, arm in reversed(plan.cells)}
    return judge(
        plan,
        {(run.case.key, run.seed): play(*levels[run.case.key], run.seed) for run in plan.runs},
    )


def published(policy: str, setting: Setting) -> float:
    return float(PAPER.performance.get(setting, 10.0))


def paper(
    p: Callable[[str, Setting], float] = published,
    *,
    seeds: int = 10,
    noise: float = 1.0,
    full: Setting | None = None,
    same: frozenset[str] = frozenset(),
    **fields: Any,
) -> StudyResults:
    """The paper's study if every cell gave p(policy, setting), with noise at several seeds.

    Args:
        full: the setting whose runs deliver every item, on one seed.
        same: failure modes whose runs are those without a fault.
    """
    rng = np.random.default_rng(0)

    def play(policy: str, setting: Setting, seed: int) -> Outcome:
        count = round(p(policy, setting) + (rng.normal(0.0, noise) if seeds > 1 else 0.0))
        digest = f"{policy} {setting} {seed}"
        if setting.name in same or setting == NO_FAULT:
            count, digest = round(p(policy, NO_FAULT)) + seed % 3, f"{policy} no fault {seed}"
        return delivered(max(0, count), all_delivered=setting == full and seed == 0, digest=digest)

    return judged(Study.preset("paper", seeds=seeds, **fields), play)


def by_question(results: StudyResults) -> dict[tuple[str, str, float], Verdict]:
    """The verdicts of a study's first policy by indicator, comparison and threshold."""
    return {
        (v.compared.indicator, v.compared.label, v.compared.threshold): v
        for v in results.verdicts
        if v.compared.policy == results.policies[0]
    }
