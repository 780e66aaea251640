"""Results of studies whose outcomes are made up, so that the answer is known; and exports."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from swarm_logistics_env.study.questions.comparison import NO_FAULT, Setting
from swarm_logistics_env.study.runs.rows import row_digest
from swarm_logistics_env.study.runs.store import Runs, export
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.reference import PAPER
from swarm_logistics_env.study.verdicts.results import StudyResults, judge
from swarm_logistics_env.study.verdicts.verdict import Decision

# The constants of homing before its search, with which robots seldom touch.
CAREFUL = {
    "spread_gain": 0.8, "spread_range": 2.0, "avoid_gain": 2.0, "avoid_range": 0.5,
    "wall_gain": 1.5, "wall_range": 0.6, "sure": 3.0, "clearance": 0.28, "obstacle_range": 0.5,
}  # fmt: skip


def digest(directory: Path, to: Path) -> str:
    """The digest of a study's exported rows."""
    with Runs.existing(directory) as runs:
        return export(runs, to / "rows.csv")[1]


def alter(store: Path, change: str, *values: Any) -> None:
    """Change a store by a statement of SQL, as if that had been written with its digests."""
    with closing(sqlite3.connect(store)) as database, database:
        database.execute(change, values)
        database.create_function("row_digest", -1, row_digest)
        database.execute("UPDATE runs SET digest = row_digest(key, run, failed, outcome)")
        database.execute("UPDATE notes SET digest = row_digest(name, value)")


def made_old(store: Path) -> None:
    """Make a store one of version 0.3.0, which has no digests."""
    with closing(sqlite3.connect(store)) as database, database:
        for table in ("runs", "notes"):
            database.execute(f"ALTER TABLE {table} DROP COLUMN digest")
        database.execute("PRAGMA user_version = 4")


def decided(decision: Decision | None) -> Decision:
    """Return a decision, which the question has."""
    assert decision is not None
    return decision


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
    unaffected: frozenset[str] = frozenset(),
    **fields: Any,
) -> StudyResults:
    """The paper's study if every cell gave p(policy, setting), with noise at several seeds.

    Args:
        full: the setting whose runs deliver every item, on one seed.
        unaffected: failure modes whose runs are those without a fault.
    """
    rng = np.random.default_rng(0)

    def play(policy: str, setting: Setting, seed: int) -> Outcome:
        count = round(p(policy, setting) + (rng.normal(0.0, noise) if seeds > 1 else 0.0))
        digest = f"{policy} {setting} {seed}"
        if setting.name in unaffected or setting == NO_FAULT:
            count, digest = round(p(policy, NO_FAULT)) + seed % 3, f"{policy} no fault {seed}"
        return delivered(max(0, count), all_delivered=setting == full and seed == 0, digest=digest)

    return judged(Study.preset("paper", seeds=seeds, **fields), play)


MEANS = {"FM2": 38.5, "FM3": 32.5, "FM4": 15.0}  # of 40 items


# P of a run at each of four seeds.
P_BY_SEED = {"homing": [6, 7, 9, 11], "swarm-dt": [8, 11, 12, 10], "random-walk": [1, 2, 1, 3]}


def limited() -> StudyResults:
    """A study with a failed run under FM4, where under FM1 every item is delivered once."""
    faults = [{"modes": ["FM1", "FM4"], "robots": [1]}]
    study = Study(
        policies=["homing"], seeds=4, scenario={"n_robots": 4}, faults=faults, indicators=["R"]
    )

    def play(_: str, setting: Setting, seed: int) -> Outcome:
        if (setting.name, seed) == ("FM4", 1):
            return Outcome(error="Traceback")
        is_full = (setting.name, seed) == ("FM1", 0)
        count = 40 + seed**2 % 5 + 3 * (setting.name == "FM1")
        return delivered(count, digest=f"{setting} {seed}", all_delivered=is_full)

    return judged(study, play)


def looked_at(modes: Iterable[str] = MEANS) -> StudyResults:
    """A study whose comparisons stop at looks of other levels than 95 %."""
    faults = [{"modes": [*modes], "robots": [1]}]
    study = Study(seeds=60, until_clear=True, faults=faults, indicators=["R"])

    def play(_: str, setting: Setting, seed: int) -> Outcome:
        draw = np.random.default_rng([seed, *map(ord, setting.name)])
        return delivered(draw.poisson(MEANS.get(setting.name, 40.0)), digest=f"{setting} {seed}")

    return judged(study, play)
