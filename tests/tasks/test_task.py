"""A study plays whatever keeps the protocol of a task, the warehouse being one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.errors import ScenarioError, StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.studies import Study
from swarm_logistics_env.tasks.task import Case, Outcome
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE, WarehouseTask


class Foraging(WarehouseTask):
    """Each working robot brings as many items as its policy's number says; no physics."""

    name = "toy"

    def code(self) -> str:
        return "foraging 1"

    def play(self, case: Case, seed: int, policy_seed: int) -> Outcome:
        items = (case.scenario.n_robots - len(case.faults)) * 3 + seed % 2
        times = np.linspace(1.0, 9.0, items)
        return Outcome(times, ended_at=9.0, digest=f"{items} {case.policy.name}")


FORAGING = Foraging()


def test_a_study_of_another_task(tmp_path: Path) -> None:
    study = Study(
        out=tmp_path,
        task=Foraging(),
        seeds=3,
        sizes=[{"values": [2, 4]}],
        faults=[{"modes": ["dead"], "robots": [1]}],
    )
    tally = study.run(processes=2)
    assert (tally.played, tally.failed) == (5 * 3, 0)
    p = {cell.words: cell.by_seed.tolist() for cell in study.findings().cells}
    assert p["N = 2"] == [6, 7, 6]
    assert p["dead, m = 1"] == p["removed, m = 1"] == [72, 73, 72]
    study.report()
    assert "code version foraging 1" in (tmp_path / "report.md").read_text()


def test_conditions_of_two_tasks_never_share_runs() -> None:
    policy = PolicySpec(name="x")
    own, other = (Case(policy, "x", Scenario(), task=t) for t in (WAREHOUSE, Foraging()))
    assert own.key != other.key


FILE = f"""
task = "{__name__}:FORAGING"
seeds = 2
policies = ["swarm-dt"]

[[sizes]]
values = [2, 4]
"""


def test_a_file_names_its_task_by_import_path_and_the_store_finds_it_again(tmp_path: Path) -> None:
    path, out = tmp_path / "forage.toml", tmp_path / "out"
    path.write_text(FILE)
    with pytest.raises(StudyError, match="is code, which runs when it is loaded"):
        Study.from_file(path)
    study = Study.from_file(path, out=out, trust_code=True)
    assert study.run().failed == 0
    with pytest.raises(StudyError, match=r"is code.*--trust-code"):
        Study.stored(out)
    again = Study.stored(out, trust_code=True)
    assert again.specification == study.specification
    assert again.run().played == 0
    assert Study.stored(out, task=FORAGING).finished() == (4, 4)


def test_a_task_that_was_an_object_is_handed_over_again(tmp_path: Path) -> None:
    Study(out=tmp_path, task=FORAGING, seeds=1, sizes=[{"values": [2, 4]}]).run()
    with pytest.raises(StudyError, match=r"task 'toy'.*Study\.stored\("):
        Study.stored(tmp_path, trust_code=True)
    assert Study.stored(tmp_path, task=FORAGING).run().kept == 2


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (
            "warehous",
            "no task 'warehous' (a name or 'package.module:OBJECT'); did you mean 'warehouse'?",
        ),
        ("nowhere:TASK", "task 'nowhere:TASK' cannot be imported: No module named 'nowhere'"),
        ("json:nothing", "has no attribute 'nothing'"),
        ("json:dumps", "is no task: should have the attributes of tasks.Task"),
        (3, "3 is no task"),
    ],
)
def test_what_is_no_task_is_refused_in_one_sentence(task: object, words: str) -> None:
    with pytest.raises(StudyError) as caught:
        Study(task=task, sizes=[{"values": [2, 4]}])
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_fields_and_failure_modes_are_those_of_the_task() -> None:
    class Other(Foraging):
        @property
        def fields(self) -> dict[str, str]:
            return {"flowers": "number"}

        @property
        def failure_modes(self) -> dict[str, str]:
            return {"lost": "x", "removed": "y"}

    Study(task=Other(), parameters=[{"name": "flowers", "values": [1, 2]}])
    for fields, words in (
        ({"faults": [{"modes": ["lots"]}]}, "no failure mode 'lots'; did you mean 'lost'?"),
        ({"faults": [{"modes": ["removed"]}]}, "no failure mode 'removed'"),
        ({"parameters": [{"name": "delivery_width", "values": [1, 2]}]}, "known: flowers"),
        ({"parameters": [{"name": "n_robots", "values": [1, 2]}]}, "belong in `sizes`"),
        ({"scenario": 3}, "should be a table of fields or a Scenario"),
    ):
        with pytest.raises(StudyError, match=words):
            Study(task=Other(), **fields)


def test_the_warehouse_names_its_fields_and_failure_modes() -> None:
    assert "delivery_width" in WAREHOUSE.fields
    assert "n_robots" not in WAREHOUSE.fields
    assert "restock" not in WAREHOUSE.fields
    assert WAREHOUSE.removed in WAREHOUSE.failure_modes
    assert WAREHOUSE.vary(Scenario(), {"preset": "dots"}) == Scenario.preset("dots")
    with pytest.raises(ScenarioError, match="no scenario preset"):
        WAREHOUSE.vary(Scenario(), {"preset": "dot"})
