from __future__ import annotations

from dataclasses import replace

from swarm_logistics_env import Scenario
from swarm_logistics_env.policies import SwarmDT, identity
from swarm_logistics_env.studies.engines import execute
from swarm_logistics_env.studies.runs import Condition, StudiedPolicy
from swarm_logistics_env.tasks.code_version import code_version
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE

SCENARIO = Scenario(n_robots=3, n_items=5, warehouse_width=3, warehouse_height=3, duration=10)


def condition(source: object) -> Condition:
    return Condition(StudiedPolicy("mine", identity(SwarmDT()), source), SCENARIO, task=WAREHOUSE)


class Remembering(SwarmDT):
    """Changes with every episode that one object plays."""

    episodes = 0

    def reset(self, n_robots: int, seed: int) -> None:
        super().reset(n_robots, seed + self.episodes)
        self.episodes += 1


def test_what_a_policy_remembers_does_not_reach_the_next_run() -> None:
    run = condition(Remembering()).run(code_version(), 0)
    first, second = execute(run), execute(run)
    assert first.error is None
    assert first.delivery_times.tolist() == second.delivery_times.tolist()
    assert first.anchoring_seconds == second.anchoring_seconds


def test_run_of_other_code_fails_rather_than_mixes() -> None:
    outcome = execute(condition("swarm-dt").run("0" * 16, 0))
    assert outcome.error is not None
    assert "the package changed while the study ran" in outcome.error


class Recording(SwarmDT):
    """Keeps the seeds that it is reset with, and never moves."""

    identity = "recording"
    seeds: list[int] = []  # noqa: RUF012 - shared by the copies that runs play

    def reset(self, n_robots: int, seed: int) -> None:
        super().reset(n_robots, seed)
        Recording.seeds.append(seed)


def test_other_behaviour_meets_the_same_worlds() -> None:
    Recording.seeds.clear()
    source = Recording()
    Recording.seeds.clear()
    same = Condition(StudiedPolicy("mine", "recording", source), SCENARIO, task=WAREHOUSE)
    other = replace(same, behaviour=1)
    assert other.key != same.key
    for seed in (0, 1):
        for condition_ in (same, other):
            assert execute(condition_.run(code_version(), seed)).error is None
    first, other_first, second, other_second = Recording.seeds
    assert (first, second) == (0, 1)
    assert len({first, second, other_first, other_second}) == 4
