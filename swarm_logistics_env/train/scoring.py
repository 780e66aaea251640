"""The scores on a policy's card: a study on seeds that the training did not use."""

from __future__ import annotations

from math import isnan
from pathlib import Path
from typing import Any

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.policies import Policy
from swarm_logistics_env.policies.card import Score
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.comparisons import Arm
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.studies.results import StudyResults
from swarm_logistics_env.train.training import Training


def score(policy: Policy, training: Training, out: Path) -> tuple[Score, ...]:
    """Return what `training.scores` asks for; the study lies in `out`, and goes on where it was.

    Raises:
        TrainingError: a run failed, so that the scores would not be of all seeds.
    """
    asked = training.scores
    if not asked.seeds or not (len(asked.sizes) > 1 or asked.modes):
        return ()
    factors: dict[str, Any] = {}
    if len(asked.sizes) > 1:
        factors["sizes"] = [{"values": sorted(asked.sizes)}]
    if asked.modes:
        factors["faults"] = [{"modes": asked.modes, "robots": asked.robots}]
    study = Study(
        out=out,
        name=f"{training.name}: scores",
        policies=[policy],
        seeds=asked.seeds,
        scenario=training.scenario.replace(n_robots=asked.n_robots),
        **factors,
    )
    study.run(processes=training.threads)
    results = study.findings()
    errors = [outcome.error for outcome in results.outcomes.values() if outcome.error]
    if errors:
        raise TrainingError(
            f"{len(errors)} runs of the scores failed ({errors[0].strip().splitlines()[-1]}); the "
            "policy file is written, without scores: the same command plays them again"
        )
    return scores_of(results)


def scores_of(results: StudyResults) -> tuple[Score, ...]:
    """Return every P and every indicator of a study with its interval."""
    scores = [
        Score(
            measure="P",
            condition=_in_words(cell.arm),
            value=cell.mean,
            low=None if isnan(cell.low) else cell.low,
            high=None if isnan(cell.high) else cell.high,
            seeds=cell.n_seeds,
        )
        for cell in rows_of(results.performance)
        if cell.n_seeds
    ]
    scores += [
        Score(
            measure=comparison.indicator,
            condition=_in_words(comparison.changed),
            value=estimate.value,
            low=estimate.low,
            high=estimate.high,
            seeds=estimate.n_seeds,
        )
        for estimate, comparison in rows_of(results.indicators[["estimate", "compared"]])
        if estimate is not None
    ]
    return tuple(dict.fromkeys(scores))


def _in_words(arm: Arm) -> str:
    setting = str(arm.setting)
    if arm.setting.kind == "size":
        return setting
    return f"N = {arm.condition.scenario.n_robots}, {setting}"
