"""A study plays whatever keeps the protocol of a task, by policies with parameters of their own."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

import swarm_logistics_env
from swarm_logistics_env import Scenario, policies
from swarm_logistics_env.core.errors import ScenarioError, StudyError
from swarm_logistics_env.policies import PolicySpec, SwarmDT
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.task import Case, Run, digest_of, refuse_untrusted, task_of
from swarm_logistics_env.study.tasks.warehouse_task import (
    CLEARING,
    EPISODE_CODE,
    RECORDED,
    WAREHOUSE,
)
from tests.study.tasks.lane import LANE

PACKAGE = Path(swarm_logistics_env.__file__).parent


def test_a_file_names_its_task_by_import_path_and_the_store_finds_it_again(tmp_path: Path) -> None:
    path, out = tmp_path / "lane.toml", tmp_path / "out"
    path.write_text(
        'task = "tests.study.tasks.lane:LANE"\nseeds = 2\nsizes = [{ values = [2, 4] }]\n'
    )
    study = Study.from_file(path, out=out, trust_code=True, policies=["walker"])
    assert study.run().failed == 0
    with pytest.raises(StudyError, match=r"is code.*--trust-code"):
        Study.stored(out)
    again = Study.stored(out, trust_code=True)
    assert again.specification == study.specification
    assert again.run().played == 0
    assert Study.stored(out, task=LANE).finished() == (4, 4)


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ('task = "mine:TASK"', "task 'mine:TASK'"),
        ('policies = ["swarm-dt", "mine:Policy"]', "policy 'mine:Policy'"),
        ('policies = [{ name = "mine:Policy", parameters = { a = 1 } }]', "policy 'mine:Policy'"),
        ('scenario = { bodies = "mine:Bodies" }', "bodies 'mine:Bodies'"),
        ('sizes = [{ values = [2, 4], scenario = { bodies = "my.py:B" } }]', "bodies 'my.py:B'"),
    ],
)
def test_whatever_is_code_in_a_file_is_refused(line: str, name: str, tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(f"{line}\n")
    with pytest.raises(StudyError, match=f"{name} is code, which runs when it is loaded"):
        Study.from_file(tmp_path / "mine.toml")


def test_a_task_is_known_by_a_name_an_import_path_or_itself() -> None:
    for source, task in (
        ("warehouse", WAREHOUSE), ("clearing", CLEARING), ("recorded trials", RECORDED),
        ("tests.study.tasks.lane:LANE", LANE), (LANE, LANE),
    ):  # fmt: skip
        assert task_of(source) is task
    with pytest.raises(
        StudyError, match=r"^3 is no task: should have the attributes of tasks\.Task$"
    ):
        task_of(3)
    missing = (
        "task 'tests.study.tasks.lane:ALNE' cannot be imported: module 'tests.study.tasks.lane"
    )
    with pytest.raises(StudyError, match=f"^{missing}' has no attribute 'ALNE'$"):
        task_of("tests.study.tasks.lane:ALNE")


@pytest.mark.parametrize(
    ("task", "policies", "bodies", "name"),
    [
        ("mine:T", ("mine:P",), ["mine:B"], "task 'mine:T'"),
        ("warehouse", ("homing", "mine:P"), ["mine:B"], "policy 'mine:P'"),
        (None, ("homing",), ["dots", "mine:B"], "bodies 'mine:B'"),
        (None, ("model.zip",), (), "policy 'model.zip'"),
        ("warehouse", ("homing",), ["dots"], None),
    ],
)
def test_the_first_that_is_code_is_refused_by_its_name_unless_it_is_trusted(
    task: str | None, policies: tuple[str, ...], bodies: Sequence[str], name: str | None
) -> None:
    specs = tuple(PolicySpec(name=policy) for policy in policies)
    path = Path("study.toml")
    refuse_untrusted(path, task, specs, bodies, trust_code=True)
    if name is None:
        refuse_untrusted(path, task, specs, bodies, trust_code=False)
        return
    with pytest.raises(StudyError) as refused:
        refuse_untrusted(path, task, specs, bodies, trust_code=False)
    assert str(refused.value) == (
        f"study.toml: {name} is code, which runs when it is loaded: should be a name that the "
        "package knows, or be allowed by --trust-code (trust_code=True)"
    )


def test_the_warehouse_is_varied_by_presets_and_its_cases_are_its_own() -> None:
    case, lane_case = (
        Case(PolicySpec(name="x"), "x", Scenario(), task=t) for t in (WAREHOUSE, LANE)
    )
    assert case.key != lane_case.key
    assert WAREHOUSE.vary(Scenario(), {"preset": "dots"}) == Scenario.preset("dots")
    with pytest.raises(ScenarioError, match="no scenario preset"):
        WAREHOUSE.vary(Scenario(), {"preset": "dot"})
    words = "max_acceleration=3.0), batteries of 71900 J, charging stations: 4"
    assert WAREHOUSE.world_in_words(Scenario.preset("day")).endswith(words)


def test_a_report_states_the_conditions_of_the_environment() -> None:
    assert LANE.vary(LANE.default, {"length": 8.0, "n_robots": 2}).conditions() == [
        ("n_robots", "2", "robots"),
        ("duration", "40.0", "s"),
        ("length", "8", "argument of the environment"),
    ]


def test_the_content_of_a_case_is_all_that_decides_its_outcomes() -> None:
    faults = (LANE.fault("blind", 1, 2.0, None, {}),)
    fields = '{"duration":40.0,"length":6,"n_robots":4}'
    fault = '[{"duration":null,"mode":"blind","onset":2.0,"robots":1}]'
    case = Case(PolicySpec(name="x"), "id", LANE.default, faults, 2, task=LANE)
    assert case.content == (fields, fault, "id", "2", "task lane")
    assert replace(case, faults=(), behaviour=0).content == (fields, "[]", "id", "task lane")
    assert replace(case, task=WAREHOUSE).content == (fields, fault, "id", "2")
    assert case.key == digest_of(*case.content)
    assert Run(case, "code", 7).key == digest_of(*case.content, "code", "7")
    assert case.trainings == (case,)
    recipe = PolicySpec.of("ppo-robust@all")
    planned = [["ppo-robust@1", "a"], ["ppo-robust@2", "b"]]
    trainings = replace(case, policy=recipe, identity=json.dumps(planned)).trainings
    assert [[training.policy.name, training.identity] for training in trainings] == planned


def test_the_seed_of_a_policy_is_that_of_the_run_unless_its_behaviour_is_another() -> None:
    case = Case(PolicySpec(name="x"), "x", Scenario(), task=WAREHOUSE)
    seeds = [
        Run(replace(case, behaviour=behaviour), "code", seed).policy_seed
        for behaviour, seed in ((0, 7), (1, 7), (2, 7), (1, 8))
    ]
    assert seeds[0] == 7
    assert len(set(seeds)) == 4
    assert all(0 <= seed < 2**31 for seed in seeds)
    many = [Run(replace(case, behaviour=1), "code", seed).policy_seed for seed in range(40)]
    assert max(many) >= 2**30


def test_covers_all_that_an_episode_loads() -> None:
    """A module that decides what a run gives must make stored runs stale when it changes."""
    script = (
        "import sys, swarm_logistics_env.policies.episode as e; "
        "print(*(m.__file__ for n, m in sys.modules.items() "
        "if n.startswith('swarm_logistics_env.')), sep='\\n')"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    loaded = {Path(line).relative_to(PACKAGE).as_posix() for line in done.stdout.split()}
    included, excluded = (
        {path.relative_to(PACKAGE).as_posix() for p in patterns for path in PACKAGE.glob(p)}
        for patterns in (
            [p for p in EPISODE_CODE if p[0] != "!"],
            [p[1:] for p in EPISODE_CODE if p[0] == "!"],
        )
    )
    covered = included - excluded
    # These hold messages, validation and names only.
    assert loaded - covered <= {
        *(path for path in loaded if path.startswith("core/")),
        "policies/__init__.py",
    }  # fmt: skip
    assert {"world/warehouse/physics.py", "policies/homing.py", "compiler/kernels.py"} <= covered


def test_clearing_is_a_rate_that_no_number_of_items_caps() -> None:
    small = {"warehouse_width": 3.0, "warehouse_height": 3.0, "delivery_width": 1.0, "n_items": 6}
    size = {"sizes": [{"values": [2, 4]}], "policies": ["homing"], "seeds": 3}
    study = Study(out=None, task="clearing", scenario={**small, "n_robots": 4}, **size)
    assert study.run().failed == 0
    for cell in study.findings().cells:
        assert not cell.saturated
        assert cell.mean.high is not None
        assert cell.mean.value > 6.0
        assert cell.mean.high > cell.mean.value
        for p, outcome in zip(cell.by_seed, cell.outcomes):
            assert len(outcome.delivery_times) == 6
            assert outcome.time_to_clear == pytest.approx(outcome.delivery_times[-1])
            assert p == pytest.approx(60.0 * 6 / outcome.ended_at)
    # A run that is not done in time has the rate until then, and no time.
    short = Study(out=None, task="clearing", scenario={**small, "duration": 1.0}, **size)
    outcome = short.plan().runs[0].play()
    assert (outcome.time_to_clear, outcome.delivered) == (math.inf, 0.0)
    with pytest.raises(StudyError, match="restock = True: should be False"):
        Study(task="clearing", scenario={"restock": True})
    # A preset keeps the time of the task, unless another is said.
    for fields, duration in (({}, 3_000.0), ({"duration": 90.0}, 90.0)):
        dots = CLEARING.vary(CLEARING.default, {"preset": "dots", **fields})
        assert dots == Scenario.preset("dots").replace(duration=duration)


def test_recorded_trials_are_not_played_again() -> None:
    with pytest.raises(StudyError, match="cannot be played again: give a file with more of them"):
        RECORDED.fault("jam", 1, 0.0, None, {})
    study = Study(task=RECORDED.name, seeds=1, sizes=[{"values": [2, 4]}])
    assert (
        str(study.plan().runs[0].play().error)
        .strip()
        .endswith(
            "StudyError: recorded trials cannot be played again: give a file with more of them"
        )
    )


FILE = """
seeds = 1
scenario = { n_robots = 3, n_items = 4, warehouse_width = 3, warehouse_height = 3, duration = 2 }
sizes = [{ values = [2, 3] }]
policies = [
    "swarm-dt",
    { name = "swarm-dt", parameters = { taxis_gain = 0.5, diffusion = 0.7 } },
    { name = "swarm-dt", parameters = { taxis_gain = 0.25 }, label = "half-hearted" },
]
"""


def test_parameters_of_a_policy_are_part_of_what_a_run_is_and_are_kept(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(FILE)
    study = Study.from_file(tmp_path / "mine.toml", out=tmp_path / "out")
    plan = study.plan()
    played = {case.policy.title: case.identity for case in plan.cases}
    parameters = "swarm-dt (taxis_gain = 0.5, diffusion = 0.7)"
    assert list(played) == ["swarm-dt", parameters, "half-hearted"]
    assert len({*played.values()}) == 3
    assert study.run().failed == 0
    again = Study.stored(tmp_path / "out")
    assert again.specification == study.specification
    assert again.plan().cases == plan.cases


class Silent(SwarmDT):
    """A policy that tells nobody its parameters."""

    def __init__(self, speed: float = 0.0) -> None:
        super().__init__()
        self.speed = speed


def test_parameters_reach_the_policy_and_count_where_it_does_not_tell_them(tmp_path: Path) -> None:
    chosen = PolicySpec(name="swarm-dt", parameters={"taxis_gain": 0.0})
    # Swarm D-T without its taxis is the random walk.
    assert policies.identity(chosen.load()) == PolicySpec.of("random-walk").identity()
    tables = [{"name": f"{__name__}:Silent", "parameters": {"speed": s}} for s in (0.1, 0.2)]
    slow, fast = map(PolicySpec.of, tables)
    assert slow.identity() != fast.identity()
    table = f'{{ name = "{__name__}:Silent", parameters = {{ speed = 0.1 }} }}'
    (tmp_path / "mine.toml").write_text(FILE.replace('"swarm-dt",', f"{table},", 1))
    assert Study.from_file(tmp_path / "mine.toml", trust_code=True).plan().cases
