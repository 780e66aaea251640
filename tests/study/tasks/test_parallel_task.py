"""A PettingZoo environment in a study: its runs, indicators, failure modes, and what is refused."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box

from swarm_logistics_env import spi
from swarm_logistics_env.core.errors import FaultError, StudyError, SwarmLogisticsError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks import (
    Case,
    Outcome,
    ParallelTask,
    Run,
    SumOfInfos,
    SumOfRewards,
)
from tests.study.tasks.lane import FAILURES, LANE, OF_LANE, Lane, Walker

FAULT = {"modes": ["silent"], "robots": [1]}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Study:
    study = Study(
        out=tmp_path_factory.mktemp("lane"),
        task="tests.study.tasks.lane:LANE",
        policies=["walker", "random"],
        seeds=4,
        sizes=[{"values": [2, 4]}],
        faults=[{"modes": ["silent", "blind"], "robots": [1]}],
        parameters=[{"name": "length", "values": [6, 12]}],
    )
    # N = 2, 4 (which is no fault and length 6), silent, blind, removed, length 12; two policies.
    tally = study.run()
    assert (tally.played, tally.failed) == (6 * 2 * 4, 0)
    return study


def only_run(task: object, **fields: Any) -> Run:
    study = Study(**{"task": task, "seeds": 1, "policies": ["walker"], "faults": [FAULT], **fields})
    return study.plan().runs[0]


@pytest.mark.unmeasured
def test_a_study_plays_sizes_parameters_and_failure_modes(study: Study) -> None:
    results = study.findings()
    p = {(cell.policy, cell.words): cell.by_seed for cell in results.cells}
    assert p["walker", "N = 2"].mean() > 5
    assert p["walker", "length = 12"].mean() < p["walker", "length = 6"].mean()
    assert p["random", "N = 4"].mean() < p["walker", "N = 4"].mean()
    # A silent robot stands in the way of the others; one that is blind stands still, too.
    assert p["walker", "silent, m = 1"].mean() < p["walker", "removed, m = 1"].mean()
    assert p["walker", "silent, m = 1"].tolist() == p["walker", "blind, m = 1"].tolist()
    verdict = next(v for v in results.verdicts if v.compared.indicator == "FT")
    assert (verdict.compared.policy, verdict.compared.label) == ("walker", "silent, m = 1")
    conditions = ("no fault", "silent, m = 1", "removed, m = 1")
    by_hand = spi.fault_tolerance(*(p["walker", condition] for condition in conditions))
    assert verdict.value == by_hand.value
    for outcome in results.outcomes.values():  # whole rewards are events with times
        assert len(outcome.delivery_times) == outcome.delivered
        assert (outcome.ended_at, outcome.untimed) == (40, None)


def test_what_the_team_shares_counts_once() -> None:
    rewards = {"a": 2.0, "b": 2.0, "c": 2.0}
    infos = {"d": {}, **{agent: {"done": value} for agent, value in rewards.items()}}
    for shared, wanted in ((False, 6.0), (True, 2.0)):
        assert SumOfRewards(shared)(None, rewards, {}) == wanted
        assert SumOfInfos("done", shared)(None, {}, infos) == wanted


def played(*gains: float) -> Outcome:
    """A run of random actions whose steps add so much to P."""
    steps = iter(gains)
    task = task_of(performance=lambda *_: next(steps), period=0.5)
    return task.play(Case(PolicySpec(name="random"), "", task.default, task=task), 0, 0)


def test_an_event_is_at_the_end_of_its_step_and_tells_runs_apart() -> None:
    run = played(1.0, 0.0, 2.0, 0.0, 1.0)
    assert run.delivery_times.tolist() == [0.5, 1.5, 1.5, 2.5]
    assert run.ended_at == 2.5
    assert run.digest == played(1.0, 0.0, 2.0, 0.0, 1.0).digest
    assert run.digest != played(1.0, 0.0, 2.0, 1.0, 0.0).digest


@pytest.mark.parametrize(("duration", "steps"), [(0.1, 1), (2.2, 4), (2.3, 5)])
def test_a_run_has_the_nearest_number_of_steps_and_one_at_least(
    duration: float, steps: int
) -> None:
    began = time.perf_counter()
    run = only_run(task_of(period=0.5), scenario={"duration": duration}).play()
    assert 0.0 < run.wall_seconds <= time.perf_counter() - began
    assert (run.error, run.ended_at) == (None, 0.5 * steps)


class Leaving(Lane):
    """Of its robots one leaves in every step."""

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        assert list(actions) == self.agents
        results = super().step({**dict.fromkeys(self.cells, 0), **actions})
        self.agents = self.agents[1:]
        return results


def test_a_run_ends_with_its_last_agent() -> None:
    task = task_of(Leaving, performance=lambda env, *_: len(env.agents), period=0.5)
    run = only_run(task).play()
    assert (run.error, run.ended_at) == (None, 1.5)
    assert run.delivery_times.tolist() == [0.5, 0.5, 1.0]


class Told(Walker):
    """Remembers what it was told before its first step."""

    def configure(self, env: Lane, agents: Any) -> None:
        self.configured = env.length, [*agents]

    def reset(self, n_robots: int, seed: int) -> None:
        self.told = n_robots, seed


def test_a_policy_is_told_the_world_the_swarm_and_its_seed() -> None:
    policy = Told()
    task = task_of(policies={"told": lambda: policy})
    task.play(Case(PolicySpec(name="told"), "", task.default, task=task), 0, 5)
    assert policy.configured == (6, ["robot_0", "robot_1", "robot_2"])
    assert policy.told == (3, 5)


@pytest.mark.daily
def test_equal_seeds_give_equal_bits_in_other_processes(study: Study) -> None:
    script = (
        "import sys; from swarm_logistics_env.study.studies import Study\n"
        "for run in reversed(Study.stored(sys.argv[1], trust_code=True).plan().runs):\n"
        "    outcome = run.play(); print(run.key, outcome.delivered, outcome.digest)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(study.out)], capture_output=True, text=True, check=True
    )
    outcomes = study.findings().outcomes
    stored = [(run.key, outcomes[run.case.key, run.seed]) for run in study.plan().runs]
    lines = {f"{key} {outcome.delivered} {outcome.digest}" for key, outcome in stored}
    assert {*done.stdout.splitlines()} == lines
    assert len({outcome.digest for _, outcome in stored}) > len(stored) / 2


def test_fractions_are_kept_without_times_and_told_apart_by_digests(tmp_path: Path) -> None:
    failures = {"frozen": None, "blind": None}
    task = task_of(steps=10, performance=SumOfInfos("distance"), failures=failures)
    fields: dict[str, Any] = {"task": task, "seeds": 3, "policies": ["random"]}
    with pytest.raises(StudyError, match="less than n_robots"):
        Study(**fields, faults=[{"modes": ["blind"]}]).plan()
    faults = [{"modes": ["blind", "frozen"], "robots": [1]}]
    study = Study(out=tmp_path, faults=faults, **fields)
    study.run()
    results = Study.stored(tmp_path, task=task).findings()
    assert all(o.untimed is not None for o in results.outcomes.values())
    # Removing is not among its failures, so FT is not asked.
    assert {v.compared.indicator for v in results.verdicts} == {"R"}
    # Random actions do not look: a blind robot changes nothing, and the report says so.
    assert [v.on_threshold.plain == "unaffected" for v in results.verdicts] == [True, False]
    assert any(p % 1 for cell in results.cells for p in cell.by_seed)


class Blunt:
    def act(self, observations: Any) -> Any:
        return np.ones(len(observations), dtype=int)


def test_a_policy_needs_nothing_but_act_here_and_reset_in_the_warehouse() -> None:
    assert only_run(LANE, policies=[Blunt()]).play().delivered > 0
    with pytest.raises(SwarmLogisticsError, match="should have the methods reset and act"):
        only_run("warehouse", policies=[Blunt()], faults=[{"modes": ["FM1"], "robots": [1]}])


class Wrong:
    def act(self, observations: Any) -> Any:
        return np.full(len(observations), 7)


class Few:
    def act(self, observations: Any) -> Any:
        return np.ones(len(observations) - 1, dtype=int)


class Driven(Lane):
    """Takes a number with a fraction for an action."""

    def action_space(self, agent: str) -> Any:
        return Box(0.0, 2.0, (1,), np.float32)

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        assert {action.dtype for action in actions.values()} == {np.dtype(np.float32)}
        return super().step({agent: int(action[0]) for agent, action in actions.items()})


class Driver:
    def act(self, observations: Any) -> Any:
        return [[1.5]] * len(observations)


def test_an_array_of_actions_has_the_type_of_its_space() -> None:
    run = only_run(task_of(make_env=Driven, steps=40), policies=[Driver()]).play()
    assert run.error is None
    assert run.delivered > 0


def costs(env: object, rewards: object, infos: object) -> float:
    return -2.0


def task_of(make_env: Any = Lane, **fields: Any) -> ParallelTask:
    return ParallelTask(make_env, **{**OF_LANE, "n_robots": 3, "steps": 5, **fields})


SCORED = task_of(performance=costs, references=(-5.0, 0.0))
SMALLER = task_of(make_env=lambda n_robots: Lane(2))


@pytest.mark.parametrize(
    ("task", "policy", "words"),
    [
        (LANE, Wrong(), "PolicyError: action 7 of robot 0: should be in Discrete(3)"),
        (LANE, Few(), "PolicyError: 3 actions for 4 robots"),
        (task_of(performance=costs), "walker", "step 1 adds -2: should be 0 or more; the indic"),
        (task_of(performance=lambda *_: np.nan), "walker", "adds nan: should be 0 or more"),
        (SCORED, "walker", "the score -10 is below the reference -5"),
        (SMALLER, "random", "the environment of 3 robots has 2 agents"),
    ],
)
def test_failing_runs_are_outcomes_with_their_reason(
    task: ParallelTask, policy: object, words: str
) -> None:
    assert words in str(only_run(task, policies=[policy]).play().error)


def test_by_references_what_is_below_zero_is_a_score() -> None:
    scored = only_run(task_of(performance=costs, references=(-20.0, 0.0))).play()
    assert (scored.error, scored.delivered) == (None, 0.5)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"failures": {"silnt": 0}}, "no mode 'silnt'; did you mean 'silent'?"),
        ({"failures": {"silent": None}}, "failures['silent'] = None: should be the action that c"),
        ({"failures": {"noisy": 0.0}}, "should be a standard deviation above 0"),
        ({"failures": {"noisy": "1"}}, "failures['noisy'] = '1': should be a standard deviation"),
        ({"failures": {"removed": 0}}, "failures['removed'] = 0: should be the name of the fact"),
        ({"references": (1.0, 1.0)}, "should be two different scores"),
    ],
)
def test_a_task_that_cannot_be_is_refused(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(StudyError) as caught:
        task_of(**fields)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"task": "warehous"}, "(a name or 'package.module:OBJECT'); did you mean 'warehouse'?"),
        ({"task": "nowhere:TASK"}, "task 'nowhere:TASK' cannot be imported: No module named 'now"),
        ({"task": "json:dumps"}, "is no task: should have the attributes of tasks.Task"),
        ({"scenario": {"lenght": 3}}, "did you mean 'length'?"),
        ({"scenario": {"length": 6.5}}, "6.5: should be a whole number"),
        ({"scenario": {"length": "six"}}, "task lane: length = 'six': should be a number"),
        ({"scenario": {"length": True}}, "task lane: length = True: should be a number"),
        ({"policies": ["swarm-dt"]}, "the task has no policy 'swarm-dt'"),
        ({"faults": [{"modes": ["silnt"]}]}, "'silnt'; did you mean 'silent'?"),
        ({"faults": [{**FAULT, "onsets": [5]}]}, "not from 5 s on, so FT is not defined here"),
        ({"parameters": [{"name": "item_radius", "values": [1, 2]}]}, "known: duration, l"),
    ],
)
def test_what_cannot_be_is_refused_before_any_run(fields: dict[str, Any], words: str) -> None:
    with pytest.raises(SwarmLogisticsError) as caught:
        only_run(**{"task": LANE, **fields})
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_task_has_the_faults_of_its_failure_modes_alone() -> None:
    with pytest.raises(FaultError, match="task lane: no failure mode 'silnt'; did you mean 'sil"):
        LANE.fault("silnt", 1, 0.0, None, {})
    with pytest.raises(FaultError, match="RobotFault has no field 'role'"):
        LANE.fault("silent", 1, 0.0, None, {"role": "carrier"})


def test_what_is_no_number_is_no_field_to_vary() -> None:
    task = task_of(parameters={"length": 6, "name": "A", "is_loud": True})
    assert [*task.fields] == ["duration", "length"]


@pytest.mark.unmeasured
def test_settings_code_and_versions_are_part_of_the_code_version() -> None:
    assert task_of().code() == task_of().code()
    assert "pettingzoo" in task_of().code()
    noisier = task_of(failures={**FAILURES, "noisy": 0.1})
    changed_tasks = [task_of(performance=costs), SCORED, noisier, task_of(period=0.5), SMALLER]
    assert len({task.code() for task in (task_of(), *changed_tasks)}) == 6


@pytest.mark.unmeasured
def test_a_task_is_known_by_what_its_functions_hold() -> None:
    def closed(length: int) -> ParallelTask:
        return task_of(make_env=lambda n_robots: Lane(n_robots, length))

    def partly(length: int) -> ParallelTask:
        return task_of(make_env=functools.partial(Lane, length=length))

    for made in (closed, partly):
        assert made(6).code() == made(6).code() != made(8).code()
        study: dict[str, Any] = {"seeds": 1, "policies": ["random"], "sizes": [{"values": [2, 4]}]}
        keys = [Study(task=made(6), **study).plan().runs[0].key for _ in range(2)]
        assert keys[0] == keys[1]
    assert closed(6).code() != partly(6).code()


@pytest.mark.daily
def test_a_task_has_one_code_version_in_every_process_and_folder(tmp_path: Path) -> None:
    script = (
        "import functools\nfrom pettingzoo.test.example_envs import generated_agents_parallel_v0\n"
        "from swarm_logistics_env.study.tasks import ParallelTask\n"
        "def make(n_robots, names): return generated_agents_parallel_v0.env()\n"
        "print(ParallelTask(functools.partial(make, names={'a', 'b', 'c'}), name='x', n_robots=4,"
        " steps=5).code())\n"
    )
    (tmp_path / "elsewhere").mkdir()
    codes = set()
    for folder, hash_seed in ((tmp_path, "1"), (tmp_path / "elsewhere", "2")):
        (folder / "mine.py").write_text(script)
        done = subprocess.run(
            [sys.executable, "mine.py"],
            cwd=folder,
            env={**os.environ, "PYTHONHASHSEED": hash_seed},
            capture_output=True,
            text=True,
            check=True,
        )
        codes.add(done.stdout)
    assert len(codes) == 1


@pytest.mark.unmeasured
def test_a_task_that_cannot_be_compared_plays_in_its_workers_and_counts_for_no_other() -> None:
    def made() -> ParallelTask:
        lock = threading.RLock()

        def make_env(n_robots: int) -> Lane:
            with lock:
                return Lane(n_robots)

        return task_of(make_env=make_env)

    task = made()
    assert task.code() == task.code() != made().code()
    assert only_run(task).play().error is None


class Threaded(Walker):
    """Walks where torch computes in one thread, and stays else."""

    identity = "threaded"

    def act(self, observations: Any) -> Any:
        import torch

        return super().act(observations) * (torch.get_num_threads() == 1)


def test_torch_computes_in_one_thread() -> None:
    torch = pytest.importorskip("torch")
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        of_walker, of_threaded = (
            only_run(LANE, policies=[policy]).play().delivered for policy in ("walker", Threaded())
        )
        assert of_threaded == of_walker > 0
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)
