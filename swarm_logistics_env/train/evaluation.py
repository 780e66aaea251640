"""Evaluation of a training, by the same episodes as any other policy, and how it was made."""

from __future__ import annotations

import json
import math
import platform
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from copy import deepcopy
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import spi
from swarm_logistics_env.episode import run_episode
from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.policies import Policy, load
from swarm_logistics_env.policies.learned import Score
from swarm_logistics_env.questions.comparison import Arm
from swarm_logistics_env.records import atomic_write, file_name, read_table
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.studies import Study
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.train.training import Training
from swarm_logistics_env.verdicts.results import StudyResults
from swarm_logistics_env.warehouse import Fault

FILE_NAME = "training.json"
# Fields that may change when a training goes on, because they change nothing of what was done.
MAY_CHANGE = frozenset({"about", "threads", "scores"})
PACKAGES = (
    "swarm-logistics-env", "torch", "stable-baselines3", "numpy", "numba", "pymunk", "gymnasium",
    "safetensors",
)  # fmt: skip


def versions() -> dict[str, str]:
    """Return the versions of everything that a training's result depends on."""
    found = {"python": platform.python_version(), "simulation": WAREHOUSE.code()}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


def enter(directory: Path, training: Training, command: str) -> None:
    """Make the directory of a training, or enter it to go on; note when and by what.

    Raises:
        TrainingError: it cannot be written, or holds another training.
    """
    path, asked = directory / FILE_NAME, training.model_dump(mode="json")
    sessions: list[dict[str, Any]] = []
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TrainingError(f"cannot write to {directory}: {error.strerror}") from error
    if path.exists():
        record = read_table(path, "record of a training", TrainingError)
        there, sessions = record.get("training", {}), record.get("sessions", [])
        if not isinstance(there, dict) or not isinstance(sessions, list):
            raise TrainingError(f"{path} is damaged: should be as it was written, or --out another")
        differing = sorted(n for n in asked if n not in MAY_CHANGE and there.get(n) != asked[n])
        if differing:
            raise TrainingError(
                f"{directory} holds a training with another {', '.join(differing)}: should be the "
                "same to go on, or --out another directory"
            )
    began = datetime.now(UTC).isoformat(timespec="seconds")
    sessions.append({"began": began, "versions": versions()})
    with atomic_write(path, TrainingError) as part:
        record = {"command": command, "training": asked, "sessions": sessions}
        part.write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")


# Scores are measured on seeds 0, 1, .. and trainings use seeds of 63 bits: these are neither.
FIRST_SEED = 1_000_000
REFERENCES = ("swarm-dt", "homing")  # scripted policies that a training is shown beside


def evaluate(policy: Policy, training: Training) -> dict[str, float]:
    """Return what `policy` delivers on the evaluation's seeds, without faults and with each.

    Returns:
        "P": the mean P_o [items]; of each mode, as "P_FM1" and "R_FM1", the mean P_F and R, which
        is nan where nothing was delivered without faults.
    """
    asked = training.evaluation
    scenario = training.scenario.replace(n_robots=asked.n_robots)
    kinds: list[Sequence[Fault]] = [(), *((Fault(m, k),) for m, k in asked.faults.items())]
    seeds = range(FIRST_SEED, FIRST_SEED + asked.seeds)
    p_o, *others = performances(policy, scenario, kinds, seeds, training.threads)
    means = {"P": float(p_o.mean())}
    for (mode, m), p_f in zip(asked.faults.items(), others):
        r = spi.robustness(p_o, p_f, n=asked.n_robots, m=m).value if p_o.any() else math.nan
        means |= {f"P_{mode}": float(p_f.mean()), f"R_{mode}": r}
    return means


def reference_means(training: Training) -> dict[str, dict[str, float]]:
    """Return what the scripted policies measure on the evaluation's seeds, by their names."""
    return {name: evaluate(load(name), training) for name in REFERENCES}


def performances(
    policy: Policy,
    scenario: Scenario,
    kinds: Sequence[Sequence[Fault]],
    seeds: Sequence[int],
    threads: int = 1,
) -> NDArray[np.float64]:
    """Return P under each kind of faults at each seed (kinds, seeds) [items]."""
    jobs = [(faults, seed) for faults in kinds for seed in seeds]

    def played(job: tuple[Sequence[Fault], int]) -> int:
        faults, seed = job
        # Each episode gets a copy of the policy, because a policy may remember robots.
        return run_episode(scenario, deepcopy(policy), seed, faults).delivered

    with ThreadPoolExecutor(threads) as pool:
        delivered = np.array(list(pool.map(played, jobs)), np.float64)
    return delivered.reshape(len(kinds), len(seeds))


def score(policy: Policy, training: Training, out: Path) -> tuple[Score, ...]:
    """Return what `training.scores` asks for; the study lies in `out`, and goes on where it was.

    Raises:
        TrainingError: a run failed, so that the scores would not be of all seeds.
    """
    asked = training.scores
    sizes = [{"values": sorted(asked.sizes)}] if len(asked.sizes) > 1 else []
    faults = [{"modes": asked.modes, "robots": asked.robots}] if asked.modes else []
    if not asked.seeds or not (sizes or faults):
        return ()
    study = Study(
        out=out,
        name=file_name(f"scores-{training.name}"),
        policies=[policy],
        seeds=asked.seeds,
        scenario=training.scenario.replace(n_robots=asked.n_robots),
        sizes=sizes,
        faults=faults,
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
    found = [
        _scored("P", cell.arm, cell.mean, cell.n_seeds) for cell in results.cells if cell.n_seeds
    ]
    for test in results.verdicts:
        if (estimate := test.estimate) is not None:
            compared = test.compared
            found.append(_scored(compared.indicator, compared.changed, estimate, estimate.n_seeds))
    return tuple(dict.fromkeys(found))


def _scored(measure: str, arm: Arm, value: spi.Interval | spi.Estimate, seeds: int) -> Score:
    in_words = str(arm.setting)
    if arm.setting.kind != "size":
        in_words = f"N = {arm.case.scenario.n_robots}, {in_words}"
    return Score(
        measure=measure,
        condition=in_words,
        value=value.value,
        low=value.low,
        high=value.high,
        seeds=seeds,
    )
