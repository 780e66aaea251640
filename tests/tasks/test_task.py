"""A study plays whatever keeps the protocol of a task, the warehouse being one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarm_logistics_env.errors import ScenarioError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.performance_table import rows_of
from swarm_logistics_env.studies.runs import Condition, StudiedPolicy
from swarm_logistics_env.tasks.task import Outcome, Playable
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE, Scenario, WarehouseTask


class Foraging(WarehouseTask):
    """Each working robot brings as many items as its policy's number says; no physics."""

    name = "foraging"

    def code(self) -> str:
        return "foraging 1"

    def play(self, policy: object, condition: Playable, seed: int, policy_seed: int) -> Outcome:
        assert isinstance(policy, str)
        lost = sum(fault.robots for fault in condition.faults)
        items = (condition.scenario.n_robots - lost) * 3 + seed % 2
        return Outcome("", np.linspace(1.0, 9.0, items), ended_at=9.0, digest=f"{items} {policy}")


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
    p = {cell.cell: cell.by_seed.tolist() for cell in rows_of(study.findings().performance)}
    assert p["N = 2"] == [6, 7, 6]
    assert p["dead, m = 1"] == p["removed, m = 1"] == [72, 73, 72]
    study.report()
    assert "code version foraging 1" in (tmp_path / "report.md").read_text()


def test_conditions_of_two_tasks_never_share_runs() -> None:
    policy = StudiedPolicy("x", "x", "x")
    own, other = (Condition(policy, Scenario(), task=t) for t in (WAREHOUSE, Foraging()))
    assert own.key != other.key


def test_the_warehouse_names_its_fields_and_failure_modes() -> None:
    assert "delivery_width" in WAREHOUSE.fields
    assert "n_robots" not in WAREHOUSE.fields
    assert "restock" not in WAREHOUSE.fields
    assert WAREHOUSE.removed in WAREHOUSE.failure_modes
    assert WAREHOUSE.vary(Scenario(), {"preset": "dots"}) == Scenario.preset("dots")
    with pytest.raises(ScenarioError, match="no scenario preset"):
        WAREHOUSE.vary(Scenario(), {"preset": "dot"})
