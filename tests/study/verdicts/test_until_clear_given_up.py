"""Until it is clear: which open questions the seeds to come would hardly decide."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env.spi.inputs import Numbers
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.until_clear import latest_look


def noise(number: int) -> Numbers:
    """Return errors of ten seeds, of variance 1 and mean 0."""
    drawn = np.random.default_rng(number).uniform(-math.sqrt(3.0), math.sqrt(3.0), 10)
    return np.asarray(drawn - drawn.mean())


@pytest.mark.parametrize(
    ("modes", "gain", "given_up"),
    [
        (["FM2"], 4.0, "hardly"),
        (["FM2"], 6.0, ""),
        # Each of three needs a third of the error.
        (["FM2", "FM3", "FM4"], 6.0, "hardly"),
        (["FM2", "FM3", "FM4"], 8.0, ""),
    ],
)
def test_a_question_is_given_up_by_its_share_of_the_error_of_those_that_are_open(
    modes: list[str], gain: float, given_up: str
) -> None:
    """Ten of 100 robots fail, and P falls by 10 less what it gains."""
    faults = [{"modes": modes, "robots": [10]}]
    plan = Study(
        seeds=20, until_clear=True, scenario={"n_robots": 100}, indicators=["R"], faults=faults
    ).plan()
    outcomes = {}
    for run in (run for run in plan.runs if run.seed < 10):
        p = 100.0 + noise(0)[run.seed]
        if run.case.faults:
            number = int(run.case.faults[0].mode[2])
            p = 90.0 + gain + 10.0 * noise(number + 1)[run.seed]
        outcomes[run.case.key, run.seed] = Outcome(untimed=float(p), digest=f"{p}")
    verdicts = latest_look(plan, outcomes).verdicts
    assert [verdict.given_up for verdict in verdicts] == [given_up] * len(modes)
    assert {verdict.on_threshold.adjusted for verdict in verdicts} == {"open"}
    assert {verdict.p_adjusted for verdict in verdicts} == {1.0}
