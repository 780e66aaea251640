"""P of each policy in words: what it is where nothing was delivered, and of which table."""

from __future__ import annotations

import re

import pandas as pd

from swarm_logistics_env import judge as judge_trials
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


def test_an_overview_names_conditions_where_they_differ() -> None:
    rows = [
        (policy, n, n * 3 + trial)
        for policy, sizes in {"a": (4, 8), "b": (6, 8), "c": (4, 8)}.items()
        for n in sizes
        for trial in range(3)
    ]

    def overview_of(rows: list[tuple[str, int, int]]) -> tuple[object, ...]:
        frame = pd.DataFrame(rows, columns=["policy", "robots", "P"])
        overview = answer(judge_trials(frame)).overview
        assert overview is not None
        return overview.columns, *overview.rows

    four, six = "13.0 [10.5, 15.5]", "19.0 [16.5, 21.5]"
    first, second, third = ("a, N = 4", four), ("b, N = 6", six), ("c, N = 4", four)
    assert overview_of(rows) == (("[95 %]", "P"), first, second, third)
    alike = [(policy, 4 if n == 6 else n, p - 6 * (n == 6)) for policy, n, p in rows]
    assert overview_of(alike) == (("[95 %]", "P, N = 4"), ("a", four), ("b", four), ("c", four))
