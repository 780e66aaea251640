"""P of each policy in words: what it is where nothing was delivered, and of which table."""

from __future__ import annotations

import re

from swarm_logistics_env.study.questions.comparison import Setting
from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.terminal_answer import terminal_answer
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.verdicts.results import judge
from tests.made_up import delivered, judged


def test_p_of_no_delivery_has_the_limit_of_its_runs() -> None:
    study = Study(seeds=4, sizes=[{"values": [2, 3]}])
    nothing = judged(study, lambda *_: delivered(0))
    assert "= 0 (at most 0.75 at 95 %, as none of 4 runs delivered" in " ".join(
        answer(nothing).head
    )

    def failed_once(_: str, setting: Setting, seed: int) -> Outcome:
        return Outcome(error="x") if (setting.value, seed) == (2, 1) else delivered(0)

    study = Study(seeds=4, sizes=[{"values": [2, 3]}], scenario={"n_robots": 2})
    words = (
        "0 (at most 1.00 at 95 %, as none of 3 runs delivered anything; 1 of 4 runs failed) items"
    )
    assert f"swarm-dt: P = {words}" in " ".join(answer(judged(study, failed_once)).head)


def test_p_of_a_policy_is_that_of_its_first_table() -> None:
    tables = [{"modes": ["FM1"]}, {"modes": ["FM4"], "scenario": {"n_items": 20}}]
    plan = Study(seeds=2, faults=tables, scenario={"n_items": 50}).plan()
    outcomes = {
        (run.case.key, run.seed): delivered(run.case.scenario.n_items + run.seed)  # type: ignore[attr-defined]
        for run in plan.runs
    }
    assert " = 50.5 [" in " ".join(answer(judge(plan, outcomes)).head)


def test_a_study_that_compares_policies_alone_says_p_of_each_in_its_first_table() -> None:
    small = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0}
    study = Study(
        policies=["swarm-dt", "homing"],
        seeds=2,
        scenario={**small, "n_robots": 4, "n_items": 6, "duration": 20.0, "restock": True},
        ablations=[{"title": title, "policy": "homing"} for title in ("as it is", "again")],
    )
    study.run()
    text = terminal_answer(answer(study.findings()), 80)
    for policy in ("swarm-dt", "homing"):
        assert re.search(rf"^{policy}: P \[95 %\] = .* N = 4,\s+as it is", text, re.MULTILINE)
