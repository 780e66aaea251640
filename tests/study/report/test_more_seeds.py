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
        (12, 1.0, 50, ["1 open: 50 new seeds might decide it"]),
        (12, 6.0, 60, ["5 open: 60 new seeds might decide them"]),
        (
            *(4, 20.0, 120),
            [
                "5 open: 120 new seeds might decide 2; 200 seeds are too few for 3 (",
                "R FM3 no radio, 1 of 10: 960, R FM4 no delivery, 1 of 10: 210, ",
                "R dead, 1 of 10: 240)",
            ],
        ),
        (
            *(12, 20.0, None),
            [
                "5 open: 200 seeds are too few for them (R FM1 false timer, 1 of 10: 400, ",
                "R FM2 lifts nothing, 1 of 10: 410, R FM3 no radio, 1 of 10: 320, and 2 more)",
            ],
        ),
    ],
)
def test_what_is_open_is_told_the_seeds_that_it_needs(
    seeds: int, spread: float, n_seeds: int | None, words: list[str]
) -> None:
    faults = [{"modes": [*COSTS], "robots": [1]}]
    study = Study(
        policies=["homing"], seeds=seeds, scenario={"n_robots": 10}, indicators=["R"], faults=faults
    )
    rng = np.random.default_rng(1)

    def play(_: str, setting: Setting, seed: int) -> Outcome:
        p = 40.0 + rng.normal(0.0, spread) - COSTS.get(setting.name, 4.0)
        return delivered(max(0, round(p)), digest=f"{setting} {seed}")

    assert more_seeds(judged(study, play)) == (n_seeds, "".join(words))


def test_an_effect_that_is_likely_small_is_worth_no_more_seeds() -> None:
    faults = [{"modes": ["FM2", "FM4"], "robots": [1]}]
    study = Study(
        policies=["homing"], seeds=100, scenario={"n_robots": 10}, indicators=["R"], faults=faults
    )
    rng = np.random.default_rng(1)
    results = judged(
        study, lambda _, at, seed: delivered(round(rng.normal(36.0 if at.value else 40.0, 2.0)))
    )
    n_seeds, words = more_seeds(results)
    assert n_seeds == 160
    assert words == (
        "2 open: 160 new seeds might decide 1; the effect of 1 is likely below 0.1, too small for "
        "more seeds"
    )


def test_trials_are_told_how_many_trials_a_condition_they_need() -> None:
    p = {4: [20, 25, 19, 31], 8: [25, 33, 20, 24]}
    trials = pd.DataFrame([(n, x) for n, values in p.items() for x in values], columns=["N", "P"])
    assert more_seeds(judge_trials(trials)) == (
        120,
        "1 open: 120 new trials a condition might decide it",
    )
