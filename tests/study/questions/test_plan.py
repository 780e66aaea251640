"""Plans: the conditions and comparisons of presets, of files and of fields; and what is refused."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import FaultError, PolicyError, StudyError, SwarmLogisticsError
from swarm_logistics_env.policies import PolicySpec, SwarmDT
from swarm_logistics_env.policies.catalogue import WEIGHTS
from swarm_logistics_env.study.questions.comparison import OTHER_BEHAVIOUR
from swarm_logistics_env.study.questions.plan import make_plan, refuse_changed_policies
from swarm_logistics_env.study.questions.presets import PRESETS
from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.study.trials import read_trials
from swarm_logistics_env.study.verdicts.reference import PAPER
from swarm_logistics_env.world.warehouse import Fault
from tests.conftest import Check
from tests.study.tasks.lane import LANE

# The specification of the statistics prints these to three decimals.
GOLDEN = {
    "S": [1.000, 0.611, 0.276, 1.091, 0.978, 0.804, 0.208, -0.135],
    "FT": [0.051, 0.077, -0.026, 0.026, 0.154, -0.026, 0.026, 0.154, 0.103, 0.0, -0.513, -0.615],
    "R": [0.091, 0.054, 0.017, 0.066, 0.131, 0.017, 0.066, 0.131, 0.146, 0.040, -0.535, -0.572],
    "A": [0.872, 0.723, 0.723, 0.610, 0.268, 0.187, -0.773],
}


def test_paper_counted_by_hand() -> None:
    plan = Study.preset("paper").plan()
    # 9 sizes; no fault, 3 removed, 4 modes x 3; widths 5, 15, 20 (10 is the base); delivery 1.5,
    # 1, .5 (2 is the base); 70 items (60 is the base); random walk at N = 25 and N = 100.
    assert len(plan.cases) == 9 + (1 + 3 + 12) + 3 + 3 + 1 + 2
    # 8 steps and 2 questions of superlinearity; FT and R of 12; 3 + 3 + 1 of A; 2 ablations.
    assert len(plan.comparisons) == 10 + 2 * 12 + 7 + 2
    assert len(plan.runs) == 34 * 20
    for case in plan.cases:
        assert [run.seed for run in plan.runs if run.case is case] == list(range(20))


def test_removed_robots_are_those_that_fail_and_only_what_indicators_need_is_run(
    small: dict[str, Any],
) -> None:
    late = {**small, "faults": [{"modes": ["FM1"], "robots": [1], "onsets": [10.0]}]}
    plans = {indicator: Study(**late, indicators=[indicator]).plan() for indicator in ("FT", "R")}
    # No fault, its twin with other behaviour, the robot failed, the robot removed.
    assert len(plans["FT"].cases) == 4
    (comparison,) = plans["FT"].comparisons
    assert comparison.removed is not None
    assert comparison.removed.case.faults == (Fault("removed", 1, onset=10.0),)
    assert comparison.changed.case.faults == (Fault("FM1", 1, onset=10.0),)
    assert comparison.removed.case.scenario == comparison.original.case.scenario
    # Nobody looks at a twin without FT.
    assert len(plans["R"].cases) == 2
    assert {comparison.indicator for comparison in plans["R"].comparisons} == {"R"}
    # So a task that can only start without a robot is asked for R in mid-run.
    of_lane: dict[str, Any] = {"task": LANE, "policies": ["walker"], "indicators": ["R"]}
    fault = {"modes": ["silent"], "robots": [1], "onsets": [5.0]}
    assert len(Study(**of_lane, faults=[fault]).plan().cases) == 2


def test_cases_and_runs_are_known_by_content() -> None:
    spec, fault = PolicySpec(name="swarm-dt"), (Fault("FM1", 2),)
    base = Case(spec, "same", Scenario(), fault, task=WAREHOUSE)
    renamed = replace(base, policy=spec.replace(label="other"), scenario=Scenario(n_robots=25))
    assert base.key == renamed.key
    different = [
        replace(base, identity="different"),
        replace(base, scenario=Scenario(n_robots=26)),
        replace(base, faults=(Fault("FM1", 1),)),
        replace(base, faults=(Fault("FM1", 2, onset=1.0),)),
        replace(base, faults=()),
        replace(base, behaviour=1),
    ]
    assert len({base.key, *(other.key for other in different)}) == 7
    assert len({Run(base, "a", 0).key, Run(base, "a", 1).key, Run(base, "b", 0).key}) == 3
    named, built, other = (
        {case.key for case in Study(policies=[policy], sizes=[{"values": [2, 3]}]).plan().cases}
        for policy in ("swarm-dt", SwarmDT(), SwarmDT(taxis_gain=0.1))
    )
    assert named == built
    assert not named & other


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({}, "compares nothing"),
        ({"seeds": 0}, "Specification.seeds = 0: should be greater than 0"),
        ({"seeds": 100_001}, "Specification.seeds = 100001: should be at most 100000"),
        ({"first_seed": -1}, "first_seed = -1: should be at least 0"),
        ({"first_seed": 2**31}, "first_seed = 2147483648: should be at most 2147383648"),
        ({"margin": 1.0}, "margin = 1.0: should be less than 1"),
        ({"margin": 0}, "margin = 0: should be greater than 0"),
        ({"indicators": ["Q"]}, "Specification: no indicator 'Q'; known: A, FT, R, S, change"),
        ({"sizes": [{"valeus": [2, 3]}]}, "Sizes has no field 'valeus'; did you mean 'values'?"),
        ({"sizes": [{"values": [5, 5]}]}, "values = [5, 5]: should be ascending, each size once"),
        ({"sizes": [{"values": [3, 2]}]}, "values = [3, 2]: should be ascending, each size once"),
        ({"sizes": [{"values": [5, 9], "superlinear": [[5, 8]]}]}, "neighbouring sizes"),
        ({"faults": {"modes": ["FM1"]}}, "list of tables: [[faults]] in a TOML file"),
        ({"faults": [{"modes": ["FM9"]}]}, "no failure mode 'FM9'; did you mean"),
        ({"faults": [{"modes": ["FM1+FM9"]}]}, "Specification: no failure mode 'FM9'"),
        ({"faults": [{"modes": ["removed"]}]}, "Specification: no failure mode 'removed'"),
        ({"faults": [{"modes": ["FM1"], "factor": 0.5}]}, "FM1 takes no factor"),
        ({"faults": [{"modes": ["FM1"], "intermittent": [0.001, 5]}]}, "should be at least 0.01"),
        ({"faults": [{"modes": ["FM1"], "robots": [25]}]}, "no working robot is left"),
        ({"faults": [{"modes": ["FM1"], "onsets": [500]}]}, "or nothing fails"),
        (
            {"faults": [{"modes": ["FM1"]}], "reference": "papr"},
            "reference = 'papr': should be 'paper'",
        ),
        ({"ablations": [{"policy": "homing", "mode": "FM9"}]}, "no failure mode 'FM9'"),
        (
            {"ablations": [{"policy": "homing", "mode": "FM1", "robots": 25}]},
            "ablations.robots = 25: should be less than n_robots = 25",
        ),
        (
            {"ablations": [{"policy": "homing", "mode": "FM1", "onset": 500}]},
            "ablations.onset = 500 s: should be less than duration",
        ),
        (
            {"parameters": [{"name": "widht", "values": [1, 2]}]},
            "no numeric scenario field 'widht'",
        ),
        ({"parameters": [{"name": "n_robots", "values": [1, 2]}]}, "belong in `sizes`"),
        (
            {"parameters": [{"name": "delivery_width", "values": [0, 1]}]},
            "values = [0, 1]: should start with x_o above 0 and not repeat it",
        ),
        (
            {"parameters": [{"name": "delivery_width", "values": [2, 1, 2]}]},
            "values = [2, 1, 2]: should start with x_o above 0 and not repeat it",
        ),
        ({"parameters": [{"name": "delivery_width", "values": [2, 2]}]}, "and not repeat it: A is"),
        ({"scenario": 3}, "scenario = 3: should be a table of fields or a Scenario"),
        ({"policies": []}, "Specification.policies = []"),
        ({"policies": ["swarm-dt", "swarm-dt"]}, "given twice"),
        ({"policies": [{"nam": "swarm-dt"}]}, "PolicySpec has no field 'nam'; did you mean 'name'"),
    ],
)
def test_bad_specification_is_refused_in_words(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(SwarmLogisticsError) as caught:
        Study(**fields).plan()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_policy_files_with_one_name_on_their_cards_are_called_by_their_paths(
    tmp_path: Path,
) -> None:
    paths = [str(tmp_path / f"{number}.safetensors") for number in range(2)]
    for path in paths:
        shutil.copy(WEIGHTS / "ppo-delivery.safetensors", path)
    for policies, titles in ((paths, paths), (paths[:1], ["ppo-delivery"])):
        specification = Study(policies=policies, sizes=[{"values": [2, 3]}]).specification
        assert [policy.title for policy in specification.policies] == titles


def test_every_preset_can_be_planned_and_an_unknown_one_is_refused() -> None:
    # What two factors ask alike is asked once.
    faults = [{"modes": ["FM1"]}, {"modes": ["FM1", "FM2"]}]
    comparisons = Study(faults=faults).plan().comparisons
    assert len(comparisons) == len(set(comparisons)) == 2 * 2 * 3
    plans = {name: Study.preset(name).plan() for name in PRESETS}
    assert all(plan.comparisons for plan in plans.values())
    # Resilience: no fault, its twin, and m = 1, 2, 3 of the removed and of three modes.
    assert len(plans["resilience"].cases) == 2 + 3 * 4
    assert [null.setting for null in plans["resilience"].nulls.values()] == [OTHER_BEHAVIOUR]
    with pytest.raises(StudyError, match="did you mean 'paper'"):
        Study.preset("papr")


def test_published_tables_give_the_golden_values_and_every_claim_follows_from_them() -> None:
    comparisons = Study.preset("paper").plan().comparisons
    published = {c: estimate.value for c in comparisons if (estimate := PAPER.estimate(c))}
    for symbol, golden in GOLDEN.items():
        of_symbol = (c for c in comparisons if (c.indicator, c.threshold) == (symbol, 0))
        assert [published[c] for c in of_symbol] == pytest.approx(golden, abs=5e-4)
    claims = {c: PAPER.claims[c.question] for c in comparisons if c.indicator != "change"}
    assert len(claims) == 41
    # Those of the other reading of FM3 are asked of that alone.
    rest = PAPER.claims.keys() - {comparison.question for comparison in claims}
    assert {question.changed.name for question in rest} == {"FM3_send"}
    for comparison, claim in claims.items():
        assert (published[comparison] > comparison.threshold) == claim, comparison.label


def test_file_says_what_python_says_and_a_bad_one_is_named(tmp_path: Path) -> None:
    path = tmp_path / "small.toml"
    path.write_text("""
        scenario = { preset = "paper", duration = 50 }
        sizes = [{ values = [5, 10] }]
        [[faults]]
        modes = ["FM1"]
    """)
    sizes, faults = [{"values": (5, 10)}], [{"modes": ("FM1",)}]
    written = Study(name="small", scenario={"duration": 50}, sizes=sizes, faults=faults)
    assert Study.from_file(path).specification == written.specification
    assert Study.from_file(path, seeds=5).plan().seeds == range(5)
    with pytest.raises(StudyError, match=r"cannot read the study file .*none\.toml"):
        Study.from_file(tmp_path / "none.toml")
    for text, expected_format in ((b"seeds = ", "TOML"), (b"\xed\xb0\x80", "UTF-8 text")):
        path.write_bytes(text)
        with pytest.raises(StudyError, match=rf"small\.toml.* is not {expected_format}"):
            Study.from_file(path)


def test_robots_may_fail_and_be_repaired_at_random_or_keep_a_factor() -> None:
    repaired = {"modes": ["dead"], "intermittent": [2.0, 3], "duration": 15}
    slow = {"modes": ["motor_slow"], "robots": [2], "factor": 0.1}
    plan = Study(seeds=2, faults=[{**repaired, "robots": [1]}, slow]).plan()
    assert {fault for case in plan.cases for fault in case.faults} == {
        Fault("dead", 1, duration=15.0, intermittent=(2.0, 3.0)),
        Fault("motor_slow", 2, factor=0.1),
        Fault("removed", 1),
        Fault("removed", 2),
    }


def test_a_parameter_is_varied_in_the_conditions_of_its_table() -> None:
    width = {"name": "delivery_width", "values": [2, 1], "scenario": {"n_robots": 7}}
    cases = Study(seeds=2, parameters=[width]).plan().cases
    scenarios: list[Any] = [case.scenario for case in cases]
    assert {(s.n_robots, s.delivery_width) for s in scenarios} == {(7, 2.0), (7, 1.0)}


def test_for_p_s_of_faults_by_role_those_of_the_role_are_removed() -> None:
    by_role = {"modes": ["FM4"], "robots": [1, 2], "onsets": [50], "role": "carrier"}
    plan = Study(seeds=2, faults=[by_role]).plan()
    assert {fault for case in plan.cases for fault in case.faults} == {
        Fault(mode, m, onset=50.0, role="carrier") for mode in ("FM4", "removed") for m in (1, 2)
    }


def test_faults_of_a_kind_strike_it_and_for_p_s_robots_of_that_kind_are_removed() -> None:
    scenario = {"robot_kinds": "lifter:4, scout:1"}
    faults = {"modes": ["FM1"], "robots": [2], "kind": "scout"}
    plan = Study(scenario=scenario, faults=[faults]).plan()
    struck = {fault.mode: fault.kind for case in plan.cases for fault in case.faults}  # type: ignore[attr-defined]
    assert struck == {"FM1": "scout", "removed": "scout"}
    (command,) = {WAREHOUSE.watch_command(case) for case in plan.cases if not case.faults}
    assert str(command).endswith("--set 'robot_kinds=lifter:4, scout:1'")
    for wrong, complaint in ({"kind": "scuot"}, "lifter, scout"), ({"robots": [6]}, "at most 5"):
        with pytest.raises(FaultError, match=complaint):
            Study(scenario=scenario, faults=[{**faults, **wrong}]).plan()


def test_a_change_of_the_scenario_reaches_tables_with_a_preset_of_their_own() -> None:
    study = Study.preset("paper")
    study.specification = study.specification.varying({"restock": True})
    scenarios = [case.scenario for case in study.plan().cases]
    assert {scenario.n_items for scenario in scenarios} == {60, 70, 100}  # type: ignore[attr-defined]
    assert all(scenario.restock for scenario in scenarios)  # type: ignore[attr-defined]


def in_words(study: Study) -> Iterator[str]:
    """Yield what a study of its first policy compares, and the conditions of each arm."""
    plan = study.plan()
    yield str(plan)
    base = vars(plan.specification.scenario)
    first = plan.comparisons[0].policy
    for comparison in plan.comparisons:
        if comparison.policy == first:
            yield (
                f"{comparison.table}: {comparison.label}, {comparison.change}, above "
                f"{comparison.threshold:g}, claimed {comparison.claim}"
            )
    for policy, table, arm in plan.cells:
        if policy == first:
            scenario: Any = arm.case.scenario
            changes = {name: x for name, x in vars(scenario).items() if x != base[name]}
            all_faults: Any = arm.case.faults
            faults = [fault.model_dump(exclude_defaults=True) for fault in all_faults]
            yield f"{table}: {arm.setting}: {changes} {faults}"


def test_plans_are_as_recorded(check_recorded: Check) -> None:
    examples = sorted((Path(__file__).parents[3] / "examples").glob("*.toml"))
    studies = {path.stem: Study.from_file(path) for path in examples}
    studies |= {name: Study.preset(name) for name in PRESETS}
    lines = [f"{name}: {line}" for name, study in studies.items() for line in in_words(study)]
    check_recorded("plans.txt", lines)


def test_a_plan_tells_how_much_it_plays_and_what_p_is(tmp_path: Path) -> None:
    sizes: dict[str, Any] = {"sizes": [{"values": [2, 4]}]}
    clear = Study(name="mine", seeds=3, first_seed=5, until_clear=True, **sizes).plan()
    assert str(clear) == (
        "mine: 1 question; 2 conditions x at most 3 seeds from 5 on = at most 6 runs"
    )
    plan = Study(seeds=2, sizes=[{"values": [2, 4, 6]}], scenario={"bodies": "dots"}).plan()
    assert str(plan) == "study: 2 questions; 3 conditions x 2 seeds = 6 runs"
    assert (plan.unusual_engine, clear.unusual_engine) == ("dots", "")
    assert [run.seed for run in plan.runs] == [0] * 3 + [1] * 3
    of_standstills = Study(performance="longest_standstill:9", **sizes).plan()
    (tmp_path / "t.csv").write_text("robots,boxes\n4,1\n8,2\n")
    trials = read_trials(tmp_path / "t.csv", columns={"performance": "boxes"})
    of_file, of_p = (
        RecordedStudy.of(replace(trials, performance_name=name)).plan for name in ("boxes", "P")
    )
    assert [
        (plan.name_of_p, plan.what_p_is) for plan in (clear, of_standstills, of_file, of_p)
    ] == [
        ("P", "the number of items delivered in the order requested"),
        (
            "P (longest_standstill:9)",
            "1 - x / 9 s, at least 0; x is the longest time without a delivery",
        ),
        ("P (boxes)", "'boxes' of t.csv"),
        ("P", "'P' of t.csv"),
    ]


def test_several_trainings_and_unknown_policies_are_refused() -> None:
    sizes: dict[str, Any] = {"sizes": [{"values": [2, 4]}]}
    several = Study(policies=["homing", "ppo-robust@all"], until_clear=True, **sizes)
    with pytest.raises(StudyError) as refused:
        several.plan()
    assert str(refused.value) == (
        "policies = ['ppo-robust@all']: several trainings have a fixed number of seeds; should be "
        "until_clear = false (--all-seeds)"
    )
    ablated = Study(ablations=[{"policy": "homing"}]).specification
    identities = {"policy swarm-dt": "a"}
    with pytest.raises(
        StudyError, match=r"^the study does not know the identity of its ablation 1$"
    ):
        make_plan(ablated, code="old", identities=identities)
    # A part without which the policy is the same is not compared.
    plan = make_plan(ablated, code="old", identities={**identities, "ablation 1": "b"})
    assert (plan.code, len(plan.comparisons)) == ("old", 1)
    with pytest.raises(StudyError, match=r"^the study compares nothing: give sizes, faults, param"):
        make_plan(ablated, code="old", identities={**identities, "ablation 1": "a"})


def test_an_object_that_learned_since_the_plan_is_refused_also_where_no_run_is_missing() -> None:
    class Mine(SwarmDT):
        gain = 1.0

    policies = Mine(), "homing"
    plan = Study(policies=policies, seeds=1, sizes=[{"values": [2, 4]}]).plan()
    refuse_changed_policies(plan, plan.runs)
    policies[0].gain = 2.0
    for runs in ((), plan.runs[-1:]):
        with pytest.raises(PolicyError, match="policy 'Mine' is not what was planned"):
            refuse_changed_policies(plan, runs)
    other_case = replace(plan.cases[-1], identity="another")
    named = Study(policies=["homing"], seeds=1, sizes=[{"values": [2, 4]}]).plan()
    refuse_changed_policies(named, named.runs)
    with pytest.raises(PolicyError, match="policy 'homing' is not what was planned"):
        refuse_changed_policies(named, [Run(other_case, "code", 0)])
