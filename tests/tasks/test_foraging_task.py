"""A study plays foraging by its name, with all that it does for the warehouse."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.errors import PolicyError, ScenarioError, StudyError
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.runs import Condition, StudiedPolicy
from swarm_logistics_env.tasks.foraging import ForagingScenario
from swarm_logistics_env.tasks.foraging_task import FORAGING
from swarm_logistics_env.tasks.task import Outcome, Task
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE

FILE = """
task = "foraging"
policies = ["forager"]
seeds = 2
scenario = { n_robots = 10, duration = 40 }

[[sizes]]
values = [5, 10]

[[faults]]
modes = ["FM4"]
robots = [2]
onsets = [0.0, 15.0]

[[parameters]]
name = "delivery_width"
values = [2.0, 1.0]

[[ablations]]
policy = { name = "forager", parameters = { taxis_gain = 0.0 } }
"""


def outcome(task: Task, policy: str, seed: int, *faults: Fault) -> Outcome:
    scenario = task.vary(task.default, {"duration": 100.0, "restock": True})
    condition = Condition(StudiedPolicy(policy, policy, policy), scenario, faults, task=task)
    return task.play(policy, condition, seed, policy_seed=seed)


def test_a_study_of_every_indicator_runs_resumes_and_reports(tmp_path: Path) -> None:
    file, out = tmp_path / "foraging.toml", tmp_path / "out"
    file.write_text(FILE)
    study = Study.from_file(file, out=out)
    tally = study.run()
    assert (tally.failed, tally.kept) == (0, 0)
    more = Study.from_file(file, out=out, seeds=3).run(processes=2)
    assert (more.failed, more.kept, more.played) == (0, tally.played, tally.played // 2)
    study = Study.stored(out)
    results = study.findings()
    asked = set(results.indicators["indicator"])
    assert asked == {"S", "R", "FT", "A", "change"}
    assert (results.performance["n_seeds"] == 3).all()
    study.report()
    report = (out / "report.md").read_text()
    assert "Performance P is the number of items brought into the nest." in report
    assert "| FM4 | its entering the nest delivers nothing |" in report
    assert "diameter of the nest" in report
    assert "## Resilience" in report
    # The same bits, whether one process played them or two.
    again = Study.from_file(file, out=tmp_path / "again", seeds=3)
    again.run()
    for one, other in zip(
        results.performance["by_seed"], again.findings().performance["by_seed"], strict=True
    ):
        assert one.tolist() == other.tolist()


def test_what_an_outcome_tells_fits_together() -> None:
    found = outcome(FORAGING, "forager", 0, Fault("dead", 3))
    assert found.delivered == len(found.delivery_times) > 30
    assert (found.delivery_times[1:] >= found.delivery_times[:-1]).all()
    assert found.ended_at == 100.0
    assert not found.all_delivered
    assert len(found.failed_robots) == 3
    assert found.anchoring_seconds is not None
    assert found.anchoring_seconds > 0.0


def test_without_an_order_of_requests_fm4_stops_nothing() -> None:
    kept = {}
    for task, policy in ((FORAGING, "forager"), (WAREHOUSE, "swarm-dt-follow")):
        failed, whole = (
            sum(outcome(task, policy, seed, *faults).delivered for seed in range(4))
            for faults in ([Fault("FM4", 5)], [])
        )
        kept[task.name] = failed / whole
    assert kept["foraging"] > 0.7
    assert kept["warehouse"] < 0.6


def test_fields_and_failure_modes_say_what_they_mean_here() -> None:
    assert FORAGING.fields.keys() == WAREHOUSE.fields.keys()
    assert "nest" in FORAGING.fields["delivery_width"]
    assert WAREHOUSE.failure_modes.keys() - FORAGING.failure_modes.keys() == {"FM4_jam"}
    assert "nest" in FORAGING.failure_modes["FM1"]
    with pytest.raises(StudyError, match="no failure mode 'FM4_jam'"):
        Study(task="foraging", policies=["forager"], faults=[{"modes": ["FM4_jam"]}])
    assert FORAGING.code() != WAREHOUSE.code()


def test_a_preset_gives_the_robots_of_the_warehouse() -> None:
    varied = FORAGING.vary(FORAGING.default, {"preset": "realistic", "delivery_width": 3.0})
    assert isinstance(varied, ForagingScenario)
    assert (varied.drive, varied.delivery_width, varied.restock) == ("differential", 3.0, True)
    assert varied.radio_loss == Scenario.preset("realistic").radio_loss
    with pytest.raises(ScenarioError, match="no scenario preset"):
        FORAGING.vary(FORAGING.default, {"preset": "realist"})


def test_a_policy_that_waits_for_requests_is_refused() -> None:
    study = Study(task="foraging", policies=["swarm-dt"], sizes=[{"values": [2, 4]}])
    with pytest.raises(PolicyError, match=r"the task has no policy 'swarm-dt'.*known: forager"):
        study.plan()
