"""The sheet of a set-up: what was fixed and varied, or what trials and their user tell of it."""

from __future__ import annotations

import pandas as pd
import pytest

from swarm_logistics_env import judge
from swarm_logistics_env.study import Study
from swarm_logistics_env.study.report.set_up import setup_sheet


def test_the_sheet_of_a_study_has_its_policies_modes_and_what_differs() -> None:
    plan = Study(
        policies=["homing"],
        seeds=3,
        scenario={"n_robots": 4, "restock": True},
        sizes=[{"values": [4, 8], "scenario": {"n_items": 7}}],
        faults=[
            {"modes": ["FM1", "dead"], "onsets": [5.0], "duration": 3.0, "title": "Late"},
            {"modes": ["FM2"], "role": "searching"},
        ],
        ablations=[
            {"policy": "random-walk", "mode": "FM4", "robots": 2, "title": "Walk"},
            {"policy": "random-walk", "scenario": {"max_speed": 0.5}, "mode": "FM1", "robots": 1},
        ],
    ).plan()
    study, policies, modes, base = setup_sheet(plan)
    assert study.title == "Study"
    assert study.lines[0].endswith(f", code version {plan.code}.")
    assert (policies.title, policies.columns) == ("Policies", ("policy", "identity"))
    assert policies.rows == tuple(
        sorted({(case.policy.title, case.identity) for case in plan.cases})
    )
    assert (modes.title, modes.columns) == ("Failure modes", ("mode", "what it does to a robot"))
    assert [row[0] for row in modes.rows] == ["removed", "FM1", "dead", "FM2", "FM4"]
    assert modes.rows[-1][1:] == ("delivers nothing when it enters the delivery area",)
    assert base.columns == ("condition", "value", "unit, meaning; source")
    assert base.rows[0][:2] == ("n_robots", "4 (default 25)")
    assert base.lines == (
        "Sizes differs: n_items = 7.",
        "Ablation differs: max_speed = 0.5.",
        "Late: robots fail for 3 s.",
        "Faults: robots fail role searching.",
        "Walk: FM4, m = 2, under both policies.",
        "Ablation: FM1, m = 1, under both policies.",
    )


@pytest.mark.parametrize(
    ("column", "shared"),
    [
        ("map", "Paired by the blocks that it names"),
        ("seed", "Paired by the seeds that it names"),
        ("", "Unpaired: it names no seeds"),
    ],
)
def test_the_sheet_of_trials_says_what_is_known_of_them(column: str, shared: str) -> None:
    rows = [
        (n, f"hall {run}" if column == "map" else run, 2 * n + run)
        for n in (4, 8)
        for run in range(3)
    ]
    frame = pd.DataFrame(rows, columns=["robots", column, "P"])
    plan = judge(frame if column else frame[["robots", "P"]]).plan
    study, stated = setup_sheet(plan)
    (line,) = study.lines
    assert line == (
        f"Study 'data-frame': 2 conditions, imported from data frame. {shared}. Their conditions "
        "are known as far as the file tells them and they are stated below."
    )
    assert (stated.title, stated.columns) == ("Set-up as stated", ("condition", "value"))
    assert (stated.rows, stated.lines) == (
        (), ("Nothing is stated of the set-up (--setup NAME=VALUE).",),
    )  # fmt: skip
