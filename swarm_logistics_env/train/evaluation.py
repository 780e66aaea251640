"""Evaluation of a training, by the same episodes as any other policy, and on which versions."""

from __future__ import annotations

import math
import platform
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from copy import deepcopy
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.core.errors import TrainingError
from swarm_logistics_env.core.records import file_name
from swarm_logistics_env.policies import Policy
from swarm_logistics_env.policies.episode import run_episode
from swarm_logistics_env.policies.files import read_policy
from swarm_logistics_env.policies.learned import Score
from swarm_logistics_env.study.questions.comparison import Arm
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.train.settings import Evaluation, Scores
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse import Fault

PACKAGES = (
    "swarm-logistics-env", "torch", "stable-baselines3", "numpy", "numba", "pymunk", "gymnasium",
    "safetensors",
)  # fmt: skip


def versions() -> dict[str, str]:
    """Return the versions of everything that a training's result depends on."""
    by_name = {"python": platform.python_version(), "simulation": WAREHOUSE.code()}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            by_name[package] = version(package)
    return by_name


# Scores are measured on seeds 0, 1, .. and trainings use seeds of 63 bits: these are neither.
FIRST_SEED = 1_000_000


def evaluate(
    policy: Policy, scenario: Scenario, evaluation: Evaluation, threads: int
) -> dict[str, float]:
    """Return what `policy` delivers on the evaluation's seeds, without faults and with each.

    Returns:
        "P": the mean P_o [items]; of each mode, as "P_FM1" and "R_FM1", the mean P_F and R, which
        is nan where nothing was delivered without faults.
    """
    kinds: list[Sequence[Fault]] = [(), *((Fault(m, k),) for m, k in evaluation.faults.items())]
    seeds = range(FIRST_SEED, FIRST_SEED + evaluation.seeds)
    p_o, *p_of_faults = performances(policy, scenario, kinds, seeds, threads)
    means = {"P": float(p_o.mean())}
    for (mode, m), p_f in zip(evaluation.faults.items(), p_of_faults):
        r = spi.robustness(p_o, p_f, n=scenario.n_robots, m=m).value if p_o.any() else math.nan
        means |= {f"P_{mode}": float(p_f.mean()), f"R_{mode}": r}
    return means


def performances(
    policy: Policy,
    scenario: Scenario,
    kinds: Sequence[Sequence[Fault]],
    seeds: Sequence[int],
    threads: int = 1,
) -> NDArray[np.float64]:
    """Return P under each kind of faults at each seed (kinds, seeds) [items]."""
    jobs = [(faults, seed) for faults in kinds for seed in seeds]

    def play(job: tuple[Sequence[Fault], int]) -> int:
        faults, seed = job
        # Each episode gets a copy of the policy, because a policy may remember robots.
        return run_episode(scenario, deepcopy(policy), seed, faults).delivered

    with ThreadPoolExecutor(threads) as pool:
        delivered = np.array(list(pool.map(play, jobs)), np.float64)
    return delivered.reshape(len(kinds), len(seeds))


def evaluate_score(
    path: Path, scenario: Scenario, scores: Scores, threads: int
) -> tuple[Score, ...]:
    """Return what `scores` asks for of a policy file; the study in scores/ beside it goes on.

    Raises:
        TrainingError: a run failed, so that the scores would not be of all seeds.
    """
    sizes = [{"values": sorted(scores.sizes)}] if len(scores.sizes) > 1 else []
    faults = [{"modes": scores.modes, "robots": scores.robots}] if scores.modes else []
    if not scores.seeds or not (sizes or faults):
        return ()
    study = Study(
        out=path.parent / "scores",
        name=file_name(f"scores-{path.stem}"),
        policies=[read_policy(path)],
        seeds=scores.seeds,
        scenario=scenario,
        sizes=sizes,
        faults=faults,
    )
    study.run(processes=threads)
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
        _score("P", cell.arm, cell.mean, cell.n_seeds) for cell in results.cells if cell.n_seeds
    ]
    for verdict in results.verdicts:
        if (estimate := verdict.estimate) is not None:
            compared = verdict.compared
            scores.append(_score(compared.indicator, compared.changed, estimate, estimate.n_seeds))
    return tuple(dict.fromkeys(scores))


def _score(measure: str, arm: Arm, value: spi.Interval | spi.Estimate, seeds: int) -> Score:
    condition = str(arm.setting)
    if arm.setting.kind != "size":
        condition = f"N = {arm.case.scenario.n_robots}, {condition}"
    return Score(
        measure=measure,
        condition=condition,
        value=value.value,
        low=value.low,
        high=value.high,
        seeds=seeds,
    )
