"""How many seeds open questions need: all together, those beyond reach by their names."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import judge as judge_trials
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.more_seeds import more_seeds
from swarm_logistics_env.study.tasks.outcome import Outcome
from tests.made_up import delivered, judged

COSTS = {"FM1": 2.0, "FM2": 4.0, "FM3": 6.0, "FM4": 4.0, "dead": 4.0}  # of 40 items


@pytest.mark.parametrize(
    ("seeds", "spread", "n_seeds", "words"),
    [
        (12, 0.6, 80, "1 open: 80 new seeds might decide it"),
        (12, 6.0, 130, "5 open: 130 new seeds might decide them"),
        (
            12, 0.8, 70,
            ("2 open: 70 new seeds might decide 1; the effect of 1 is likely below 0.1, too small "
             "for more seeds"),
        ),
        (
            4, 10.0, 110,
            ("5 open: 110 new seeds might decide 2; 200 seeds are too few for 3 (R FM3 no radio, "
             "1 of 10: 210, R FM4 no delivery, 1 of 10: 600, R dead, 1 of 10: 310)"),
        ),
        (
            12, 20.0, None,
            ("5 open: 200 seeds are too few for them (R FM1 false timer, 1 of 10: 480, R FM2 lifts "
             "nothing, 1 of 10: 430, R FM3 no radio, 1 of 10: 670, and 2 more)"),
        ),
    ],
)  # fmt: skip
def test_what_is_open_is_told_the_seeds_that_it_needs(
    seeds: int, spread: float, n_seeds: int | None, words: str
) -> None:
    faults = [{"modes": [*COSTS], "robots": [1]}]
    study = Study(
        policies=["homing"], seeds=seeds, scenario={"n_robots": 10}, indicators=["R"], faults=faults
    )

    def play(_: str, setting: Setting, seed: int) -> Outcome:
        noise = np.random.default_rng([seed, *map(ord, setting.name)]).normal(0.0, spread)
        p = 40.0 + noise - COSTS.get(setting.name, 4.0)
        return delivered(max(0, round(p)), digest=f"{setting} {seed}")

    assert more_seeds(judged(study, play)) == (n_seeds, words)


def test_trials_are_told_how_many_trials_a_condition_they_need() -> None:
    p = {4: [20, 25, 19, 31], 8: [25, 33, 20, 24]}
    trials = pd.DataFrame([(n, x) for n, values in p.items() for x in values], columns=["N", "P"])
    assert more_seeds(judge_trials(trials)) == (
        120,
        "1 open: 120 new trials a condition might decide it",
    )
