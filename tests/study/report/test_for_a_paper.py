"""What a paper can say of a study of several trainings, and of trials of three policies."""

from __future__ import annotations

import numpy as np
import pandas as pd

from swarm_logistics_env import judge as judge_trials
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.for_a_paper import in_a_sentence
from swarm_logistics_env.study.report.sentences import sentence
from swarm_logistics_env.study.verdicts.results import judge
from tests.made_up import delivered

HOLM = "Verdicts by Holm's method over all questions on an indicator of one policy, 5 % error."


def test_of_several_trainings_it_says_how_many_collapsed_and_are_needed() -> None:
    plan = Study(policies=["ppo-robust@all"], seeds=3, sizes=[{"values": [4, 8]}]).plan()
    rng = np.random.default_rng(0)
    outcomes = {
        (run.case.key, run.seed): delivered(rng.poisson(20) + 3 * run.case.scenario.n_robots)
        for run in plan.runs
    }
    results = judge(plan, outcomes)
    (verdict,) = results.verdicts
    assert answer(results).opening == []
    words = sentence(results, verdict)
    assert words.head == "ppo-robust, 7 trainings, scalable? N 4 -> 8."
    assert words.text == (
        "S = 0.298, 95 % interval [0.202, 0.400] over 7 trainings x 3 paired seeds (0 to 2). "
        "Alone: open, p < 0.001, p = 0.266 if some stall, which counts; by Holm's method: open, "
        "p = 0.266. The verdict is provisional, because fewer than ten seeds show too little of "
        "how they scatter. These trainings are too few to exclude collapses that would turn the "
        "verdict, so it is open. Trainings: 0 of 7 collapsed, at most 35 %. With collapses that "
        "may be hidden p is 0.27: it needs at least 16 trainings."
    )
    assert in_a_sentence(results, answer(results)) == (
        "ppo-robust, 7 trainings in a warehouse of 10 m x 10 m with 60 items, robots of 2 m/s "
        "(preset paper, engine chipmunk), 3 paired seeds (0 to 2). ppo-robust, 7 trainings: P [95 "
        "%] = 33.3 [31.2, 35.3] items in 500 s, N = 4; scalability S, N 4→8: P 33.3→43.2, S 0.30 "
        f"[0.20, 0.40], open, trainings. {HOLM}"
    )


def test_of_three_policies_it_says_each_p_and_then_each_indicator() -> None:
    noise = {"a": (0, 3, 1, 4), "b": (2, 2, 0, 1), "c": (4, 0, 3, 3)}
    rows = [
        (policy, n, 3 * n + (k + n) % 5) for policy, of in noise.items() for n in (4, 8) for k in of
    ]
    results = judge_trials(pd.DataFrame(rows, columns=["policy", "robots", "P"]))
    assert in_a_sentence(results, answer(results)) == (
        "a, b and c, trials of data frame, 4 unpaired runs a condition. a: P [95 %] = 14.2 [11.5, "
        "17.0], N = 4. b: P [95 %] = 13.5 [10.7, 16.3], N = 4. c: P [95 %] = 14.8 [13.2, 16.3], "
        "N = 4. Scalability S: 3 supported (n < 10; a: N 4→8; b: N 4→8; c: N 4→8); lowest at c: "
        f"N 4→8: P 14.8→25.8, S 0.75 [0.58, 0.93], supported, n < 10. {HOLM}"
    )
    report = document(results)
    (text,) = report.text
    assert text == (
        "data-frame: 6 conditions, 4 unpaired runs a condition; every verdict holds for the "
        "conditions of the set-up sheet below and for no others."
    )
    titles = ["Figures", "Verdicts", "Results", "Set-up", "Methods", "For a paper"]
    assert [chapter.title for chapter in report.chapters] == titles
    assert [part.title for part in report.summary] == [f"{name}: Scalability" for name in "abc"]
    assert [figure.name for figure in report.figures] == ["answer", "S-Scalability"]
