from __future__ import annotations

from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.errors import PolicyError, StudyError, SwarmLogisticsError
from swarm_logistics_env.policies import PolicySpec, SwarmDT
from swarm_logistics_env.studies import Study
from swarm_logistics_env.tasks.task import Case
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.warehouse import Fault


def test_paper_counted_by_hand() -> None:
    plan = Study.preset("paper").plan()
    # 9 sizes; no fault, 3 removed, 4 modes x 3; widths 5, 15, 20 (10 is the base); delivery 1.5,
    # 1, .5 (2 is the base); 70 items (60 is the base); random walk at N = 25 and N = 100.
    assert len(plan.cases) == 9 + (1 + 3 + 12) + 3 + 3 + 1 + 2
    # 8 steps and 2 questions of superlinearity; FT and R of 12; 3 + 3 + 1 of A; 2 ablations.
    assert len(plan.comparisons) == 10 + 2 * 12 + 7 + 2
    assert len(plan.runs) == 34 * 20
    for case in plan.cases:
        seeds = [run.seed for run in plan.runs if run.case is case]
        assert seeds == list(range(20))


def test_second_policy_doubles_all_but_the_ablation_it_is() -> None:
    plan = Study.preset("paper", policies=("swarm-dt", "random-walk")).plan()
    # The two ablation conditions of the first policy are conditions of the second one anyway.
    assert len(plan.cases) == 2 * 32
    assert {c.policy for c in plan.comparisons if c.indicator == "change"} == {"swarm-dt"}


def test_removed_robots_are_those_that_fail(small: dict[str, Any]) -> None:
    for comparison in Study(**small, indicators=["FT"]).plan().comparisons:
        assert comparison.removed is not None
        (removed,), (failed,) = comparison.removed.case.faults, comparison.changed.case.faults
        assert isinstance(removed, Fault)
        assert isinstance(failed, Fault)
        assert removed == Fault("removed", failed.robots, onset=failed.onset)
        assert comparison.removed.case.scenario == comparison.original.case.scenario


def test_only_what_the_indicators_need_is_run(small: dict[str, Any]) -> None:
    late = {**small, "faults": [{"modes": ["FM1"], "robots": [1], "onsets": [10.0]}]}
    plans = {asked: Study(**late, indicators=[asked]).plan() for asked in ("FT", "R")}
    # No fault, its twin with other behaviour, the robot failed, the robot removed.
    assert len(plans["FT"].cases) == 4
    # Nobody looks at a twin without FT.
    assert len(plans["R"].cases) == 2
    assert {comparison.indicator for comparison in plans["R"].comparisons} == {"R"}


def test_cases_and_runs_are_known_by_content() -> None:
    one = PolicySpec(name="swarm-dt")
    base = Case(one, "same", Scenario(), (Fault("FM1", 2),), task=WAREHOUSE)
    other_name = one.replace(label="other")
    same = Case(other_name, "same", Scenario(n_robots=25), (Fault("FM1", 2),), task=WAREHOUSE)
    assert base.key == same.key
    others = [
        Case(one, "different", Scenario(), (Fault("FM1", 2),), task=WAREHOUSE),
        Case(one, "same", Scenario(n_robots=26), (Fault("FM1", 2),), task=WAREHOUSE),
        Case(one, "same", Scenario(), (Fault("FM1", 1),), task=WAREHOUSE),
        Case(one, "same", Scenario(), (Fault("FM1", 2, onset=1.0),), task=WAREHOUSE),
        Case(one, "same", Scenario(), task=WAREHOUSE),
        Case(one, "same", Scenario(), (Fault("FM1", 2),), 1, task=WAREHOUSE),
    ]
    assert len({base.key, *(other.key for other in others)}) == 7
    assert len({base.run("a", 0).key, base.run("a", 1).key, base.run("b", 0).key}) == 3


def test_policy_parameters_make_another_condition() -> None:
    named, built, other = (
        {case.key for case in Study(policies=[policy], sizes=[{"values": [2, 3]}]).plan().cases}
        for policy in ("swarm-dt", SwarmDT(), SwarmDT(taxis_gain=0.1))
    )
    assert named == built
    assert not named & other


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"sizes": [{"valeus": [2, 3]}]}, "Sizes has no field 'valeus'; did you mean 'values'?"),
        ({"seedz": 3}, "did you mean 'seeds'?"),
        ({"seeds": 0}, "Specification.seeds = 0: should be greater than 0"),
        ({"first_seed": -1}, "first_seed = -1: should be greater than or equal to 0"),
        ({"first_seed": 2**31}, "first_seed = 2147483648: should be less than or equal to"),
        ({"scenario": {"n_robot": 3}}, "did you mean 'n_robots'?"),
        ({"scenario": {"preset": "papr"}}, "did you mean 'paper'?"),
        ({"sizes": [{"values": [5, 5]}]}, "ascending"),
        ({"sizes": [{"values": [5, 9], "superlinear": [[5, 8]]}]}, "neighbouring sizes"),
        ({"faults": [{"modes": ["FM9"]}]}, "no failure mode 'FM9'; did you mean"),
        ({"faults": [{"modes": ["removed"]}]}, "no failure mode 'removed'"),
        ({"faults": [{"modes": ["FM1"], "robots": [25]}]}, "no working robot is left"),
        ({"faults": [{"modes": ["FM1"], "onsets": [500]}]}, "or nothing fails"),
        ({"parameters": [{"name": "relay", "values": [1, 2]}]}, "no numeric scenario field"),
        ({"parameters": [{"name": "n_robots", "values": [1, 2]}]}, "belong in `sizes`"),
        ({"parameters": [{"name": "n_items", "values": [60.5, 70]}]}, "60.5"),
        ({"policies": ["swarm-dt", "swarm-dt"]}, "given twice"),
        ({"policies": [3]}, "an object with act"),
        ({"faults": {"modes": ["FM1"]}}, "list of tables: [[faults]] in a TOML file"),
        ({"parameters": {"name": "x"}}, "list of tables: [[parameters]] in a TOML file"),
        ({"faults": [{"modes": ["FM1"]}], "reference": "papr"}, "did you mean 'paper'?"),
        (
            {
                "faults": [
                    {"modes": ["FM1"], "title": "one", "duration": lasts} for lasts in (5.0, 9.0)
                ]
            },
            "title = 'one' heads 'FM1, m = 1' under two different conditions",
        ),
        ({}, "compares nothing"),
    ],
)
def test_bad_specification_is_refused_in_words(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(SwarmLogisticsError) as caught:
        Study(**fields).plan()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_two_factors_ask_alike_is_asked_once() -> None:
    faults = [{"modes": ["FM1"]}, {"modes": ["FM1", "FM2"]}]
    comparisons = Study(faults=faults).plan().comparisons
    assert len(comparisons) == len(set(comparisons)) == 2 * 2 * 3


def test_unknown_names_are_refused_before_any_run() -> None:
    with pytest.raises(PolicyError, match="swarm-dt"):
        Study.preset("paper", policies=("swarm-td",)).plan()
    with pytest.raises(StudyError, match="did you mean 'paper'"):
        Study.preset("papr")
