"""What does middleware cost? `python -m research.play_middleware [SEEDS]`.

Plays policies over middleware that loses and delays rows and commands, without ROS, with and
without broken robots, and writes the table of docs/robots.md. What is played stays in
results/middleware, and the same command goes on after an interruption. 20 seeds take about
25 minutes of a core.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Any

from research.play_bodies import cells_of, change_of_p, verdicts_of
from research.tables import ROOT, play, rewrite, seeds_from, table
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import NO_FAULT
from swarm_logistics_env.study.report import section
from swarm_logistics_env.study.verdicts.results import StudyResults
from swarm_logistics_env.world.scenario import Scenario

PAGE = ROOT / "docs" / "robots.md"
NAMES = ("homing", "homing-stock", "ppo-robust")
FAULTS = {"modes": ["FM1", "FM4"], "robots": [2]}
DIRECT = "no middleware"
NOTHING = "nothing"
MIDDLEWARE: dict[str, dict[str, float]] = {
    NOTHING: {},
    "10 % loss": {"loss": 0.1},
    "50 ms": {"delay": 0.05},
    "10 % loss, 50 ms": {"loss": 0.1, "delay": 0.05},
}


def study_of(name: str, n_seeds: int) -> Study:
    """Return the study of a policy over all kinds of middleware, which label its policies."""
    over_middleware = "swarm_logistics_env.robots.middleware:OverMiddleware"
    policies = [
        {"name": over_middleware, "parameters": {"policy": name, **settings}, "label": label}
        for label, settings in MIDDLEWARE.items()
    ]
    return _study(name, policies, n_seeds)


def _study(name: str, policies: list[Any], n_seeds: int) -> Study:
    return Study(
        name=f"middleware-{name}",
        policies=policies,
        seeds=n_seeds,
        first_seed=20_000,
        indicators=["R"],
        scenario=Scenario.preset("realistic").replace(restock=True),
        faults=[FAULTS],
        out=ROOT / "results" / "middleware" / name,
    )


def rows_of(name: str, direct: StudyResults, results: StudyResults) -> Iterator[tuple[str, ...]]:
    """Yield of a policy without middleware, and over each kind, P, its change, and each R."""
    without = cells_of(direct)[name, str(NO_FAULT)]
    yield f"`{name}`", DIRECT, section.mean_p(without), section.NOTHING, *_robustness(direct, name)
    cells = cells_of(results)
    lossless = cells[NOTHING, str(NO_FAULT)]
    for label in MIDDLEWARE:
        cell = cells[label, str(NO_FAULT)]
        change = section.NOTHING if label == NOTHING else change_of_p(lossless, cell)
        yield f"`{name}`", label, section.mean_p(cell), change, *_robustness(results, label)


def _robustness(results: StudyResults, label: str) -> list[str]:
    verdicts = verdicts_of(results)
    return [section.ratio(verdict) for (policy, _), verdict in verdicts.items() if policy == label]


def main() -> None:
    """Play what is missing, and write the table."""
    n_seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    direct, *studies = play(
        [
            _study("direct", [{"name": name, "label": name} for name in NAMES], n_seeds),
            *(study_of(name, n_seeds) for name in NAMES),
        ]
    )
    heading = ("policy", "lost or late", "P", "change of P", "R, FM1", "R, FM4")
    rows = [row for name, of_it in zip(NAMES, studies) for row in rows_of(name, direct, of_it)]
    line = f"{seeds_from(direct)}; P without broken robots, R with two of 25 from the start."
    rewrite(PAGE, {"middleware": table(heading, rows, f"{line} Intervals are of 95 %.")})


if __name__ == "__main__":
    main()
