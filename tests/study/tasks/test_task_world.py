"""What a task says of its world stands in the report; one that is silent is called by its name."""

from __future__ import annotations

import math

from swarm_logistics_env.study.report.answer import answer
from swarm_logistics_env.study.report.for_a_paper import in_a_sentence
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks import Case, ParallelTask, Task, TaskWorld
from swarm_logistics_env.study.tasks.task import TaskScenario
from swarm_logistics_env.study.tasks.task_world import world_of
from swarm_logistics_env.study.verdicts.results import StudyResults
from tests.study.tasks.lane import LANE, OF_LANE, Lane

MOST = 15.0


class ToldLane(TaskWorld, ParallelTask):
    counted = "parcels"

    def world_in_words(self, scenario: TaskScenario) -> str:
        return f"a lane for {scenario.n_robots} robots"

    def largest_performance(self, scenario: TaskScenario) -> float:
        return MOST

    def watch_command(self, case: Case) -> str:
        return f"watch-lane {case.policy.name}"


TOLD = ToldLane(Lane, n_robots=4, steps=40, parameters={"length": 6}, **OF_LANE)


def played(task: Task) -> StudyResults:
    study = Study(task=task, policies=["walker"], seeds=4, sizes=[{"values": [2, 4]}])
    assert study.run().failed == 0
    return study.findings()


def test_a_task_without_words_on_its_world_is_called_by_its_name() -> None:
    results = played(LANE)
    performance = answer(results).head[0]
    assert performance.startswith("walker: P [95 %] = ")
    assert ", N = 2, task lane; 4 paired seeds (0 to 3)." in performance
    sentence = in_a_sentence(results, answer(results))
    assert sentence.startswith("walker in the task lane, 4 paired seeds (0 to 3). walker: P ")
    case = results.plan.cases[0]
    assert world_of(LANE).watch_command(case) is None
    assert world_of(LANE).largest_performance(case.scenario) == math.inf


def test_a_task_says_what_it_counts_where_it_is_and_how_large_p_can_be() -> None:
    free = played(LANE)
    results = played(TOLD)
    assert " parcels in 40 s, N = 2, task " in answer(results).head[0]
    sentence = in_a_sentence(results, answer(results))
    assert sentence.startswith("walker in a lane for 4 robots, 4 paired seeds")
    highs = [cell.mean.high or 0.0 for cell in free.cells]
    assert max(highs) > MOST
    assert [cell.mean.high for cell in results.cells] == [min(high, MOST) for high in highs]
