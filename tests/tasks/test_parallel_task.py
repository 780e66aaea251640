"""A PettingZoo environment in a study: its runs, indicators, failure modes, and what is refused."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from swarm_logistics_env import spi
from swarm_logistics_env.errors import StudyError, SwarmLogisticsError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.studies import Study
from swarm_logistics_env.tasks import Case, ParallelTask, Run, SumOfInfos, SumOfRewards
from tests.tasks.lane import ACTIONS, FAILURES, LANE, OBSERVATIONS, Lane, Walker

STUDY = """
task = "tests.tasks.lane:LANE"
policies = ["walker", "random"]
seeds = 4
sizes = [{ values = [2, 4] }]
faults = [{ modes = ["silent", "blind"], robots = [1] }]
parameters = [{ name = "length", values = [6, 12] }]
"""
FAULT = {"modes": ["silent"], "robots": [1]}


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("lane") / "lane.toml"
    path.write_text(STUDY)
    return path


@pytest.fixture(scope="module")
def study(file: Path) -> Study:
    """The study of the file, played beside it."""
    study = Study.from_file(file, out=file.parent / "out", trust_code=True)
    # N = 2, 4 (which is no fault and length 6), silent, blind, removed, length 12; two policies.
    tally = study.run()
    assert (tally.played, tally.failed) == (6 * 2 * 4, 0)
    return study


def only_run(task: object, **fields: Any) -> Run:
    study = Study(**{"task": task, "seeds": 1, "policies": ["walker"], "faults": [FAULT], **fields})
    return study.plan().runs[0]


def test_a_study_plays_sizes_parameters_and_failure_modes(study: Study) -> None:
    results = study.findings()
    p = {(cell.policy, cell.words): cell.by_seed for cell in results.cells}
    assert p["walker", "N = 2"].mean() > 5
    assert p["walker", "length = 12"].mean() < p["walker", "length = 6"].mean()
    assert p["random", "N = 4"].mean() < p["walker", "N = 4"].mean()
    # A silent robot stands in the way of the others; one that is blind stands still, too.
    assert p["walker", "silent, m = 1"].mean() < p["walker", "removed, m = 1"].mean()
    assert p["walker", "silent, m = 1"].tolist() == p["walker", "blind, m = 1"].tolist()
    by_hand = spi.fault_tolerance(
        *(p["walker", name] for name in ("no fault", "silent, m = 1", "removed, m = 1"))
    )
    asked = {
        (v.compared.policy, v.compared.indicator, v.compared.label): v for v in results.verdicts
    }
    assert asked["walker", "FT", "silent, m = 1"].value == by_hand.value
    for outcome in results.outcomes.values():  # whole rewards are events with times
        assert len(outcome.delivery_times) == outcome.delivered
        assert (outcome.ended_at, outcome.untimed) == (40, None)
    study.report()
    text = (Path(study.out or "") / "report.md").read_text()
    assert "P is the sum of the rewards." in text
    assert "its actions are replaced by the task's no-op" in text


@pytest.mark.parametrize(("shared", "wanted"), [(False, 6.0), (True, 2.0)])
def test_what_the_team_shares_counts_once(shared: bool, wanted: float) -> None:
    told = {"a": 2.0, "b": 2.0, "c": 2.0}
    infos = {agent: {"done": value} for agent, value in told.items()}
    assert SumOfRewards(shared)(None, told, {}) == wanted
    assert SumOfInfos("done", shared)(None, {}, {**infos, "d": {}}) == wanted
    assert SumOfRewards(shared)(None, {}, {}) == 0.0


def test_an_event_is_at_the_end_of_its_step() -> None:
    gains = iter([1.0, 0.0, 2.0, 0.0, 1.0])
    task = task_of(performance=lambda *_: next(gains), period=0.5)
    run = task.play(Case(PolicySpec(name="random"), "", task.default, task=task), 0, 0)
    assert run.delivery_times.tolist() == [0.5, 1.5, 1.5, 2.5]
    assert run.ended_at == 2.5


def test_equal_seeds_give_equal_bits_in_other_processes(study: Study, file: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from swarm_logistics_env.studies import Study\n"
        "study = Study.from_file(Path(sys.argv[1]), trust_code=True)\n"
        "for run in reversed(study.plan().runs):\n"
        "    outcome = run.play(); print(run.key, outcome.delivered, outcome.digest)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(file)], capture_output=True, text=True, check=True
    )
    outcomes = study.findings().outcomes
    kept = [(run.key, outcomes[run.case.key, run.seed]) for run in study.plan().runs]
    told = {f"{key} {outcome.delivered} {outcome.digest}" for key, outcome in kept}
    assert {*done.stdout.splitlines()} == told
    assert len({outcome.digest for _, outcome in kept}) > len(kept) / 2
    shared = Study.from_file(file, trust_code=True, seeds=1)
    assert shared.run(processes=2).failed == 0
    for place, outcome in shared.findings().outcomes.items():
        assert outcome.digest == outcomes[place].digest


def test_fractions_are_kept_without_times_and_told_apart_by_digests(tmp_path: Path) -> None:
    task = task_of(
        name="distance",
        steps=10,
        performance=SumOfInfos("distance"),
        failures={"frozen": None, "blind": None},
    )
    fields: dict[str, Any] = {"task": task, "seeds": 3, "policies": ["random"]}
    with pytest.raises(StudyError, match="less than n_robots"):
        Study(**fields, faults=[{"modes": ["blind"]}]).plan()
    faults = [{"modes": ["blind", "frozen"], "robots": [1]}]
    study = Study(out=tmp_path, faults=faults, **fields)
    # Removing is not among its failures, so FT is not asked.
    assert {c.indicator for c in study.plan().comparisons} == {"R"}
    study.run()
    results = Study.stored(tmp_path, task=task).findings()
    assert all(o.untimed is not None and o.digest for o in results.outcomes.values())
    # Random actions do not look: a blind robot changes nothing, and the report says so.
    assert [v.plain == "unaffected" for v in results.verdicts] == [True, False]
    assert any(p % 1 for cell in results.cells for p in cell.by_seed)


class Hidden(Lane):
    """Tells nothing of what happens, neither by observations nor by rewards."""

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        _, rewards, *others, infos = super().step(actions)
        infos = {agent: {"done": rewards[agent]} for agent in infos}
        return self._observations(), dict.fromkeys(rewards, 0.0), *others, infos

    def _observations(self) -> dict[str, Any]:
        return {agent: np.zeros(2, np.float32) for agent in self.agents}


def test_runs_that_differ_in_p_alone_are_not_the_same_runs() -> None:
    task = task_of(make_env=Hidden, steps=40, performance=SumOfInfos("done"))
    study = Study(task=task, seeds=3, policies=[Blunt()], faults=[FAULT], indicators=["R"])
    study.run()
    (test,) = study.findings().verdicts
    assert (test.problem, test.plain == "unaffected") == (None, False)


def test_a_model_of_stable_baselines3_plays(tmp_path: Path) -> None:
    sb3 = pytest.importorskip("stable_baselines3")

    class Single(gymnasium.Env[Any, Any]):
        observation_space, action_space = OBSERVATIONS, ACTIONS

    path = tmp_path / "model.zip"
    sb3.PPO("MlpPolicy", Single(), seed=0, device="cpu").save(path)
    run = only_run(LANE, policies=[str(path)])
    one, two = run.play(), run.play()
    assert (one.error, one.digest) == (None, two.digest)


class Blunt:
    def act(self, observations: Any) -> Any:
        return np.ones(len(observations), dtype=int)


def test_a_policy_needs_nothing_but_act_here_and_reset_in_the_warehouse() -> None:
    assert only_run(LANE, policies=[Blunt()]).play().delivered > 0
    with pytest.raises(SwarmLogisticsError, match="should have the methods reset and act"):
        only_run("warehouse", policies=[Blunt()], faults=[{"modes": ["FM1"], "robots": [1]}])


class Crash(Walker):
    def act(self, observations: Any) -> Any:
        raise ZeroDivisionError("on purpose")


class Wrong(Walker):
    def act(self, observations: Any) -> Any:
        return np.full(self.n_robots, 7)


def costs(env: object, rewards: object, infos: object) -> float:
    return -2.0


def task_of(**fields: Any) -> ParallelTask:
    usual = {"name": "lane", "n_robots": 3, "steps": 5, "failures": FAILURES}
    return ParallelTask(
        fields.pop("make_env", Lane), **{**usual, "policies": {"walker": Walker}, **fields}
    )


SCORED = task_of(performance=costs, references=(-5.0, 0.0))
SMALLER = task_of(make_env=lambda n_robots: Lane(2))


@pytest.mark.parametrize(
    ("task", "policy", "words"),
    [
        (LANE, Crash(), "ZeroDivisionError: on purpose"),
        (LANE, Wrong(), "PolicyError: action 7 of robot 0: should be in Discrete(3)"),
        (task_of(performance=costs), "walker", "step 1 adds -2: should be 0 or more; the indic"),
        (task_of(performance=costs), "walker", "references=(score that counts as 0"),
        (task_of(performance=lambda *_: np.nan), "walker", "adds nan: should be a finite number"),
        (SCORED, "walker", "the score -10 is below the reference -5"),
        (SMALLER, "random", "the environment of 3 robots has 2 agents"),
    ],
)
def test_failing_runs_are_outcomes_with_their_reason(
    task: ParallelTask, policy: object, words: str
) -> None:
    assert words in str(only_run(task, policies=[policy]).play().error)


def test_references_make_a_score_of_what_is_below_zero() -> None:
    scored = only_run(task_of(performance=costs, references=(-20.0, 0.0))).play()
    assert (scored.error, scored.delivered) == (None, 0.5)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: task_of(failures={"silnt": 0}), "no mode 'silnt'; did you mean 'silent'?"),
        (lambda: task_of(failures={"silent": None}), "should be the action that counts as none"),
        (lambda: task_of(failures={"noisy": 0.0}), "should be a standard deviation above 0"),
        (lambda: task_of(failures={"removed": True}), "should be the name of the factory's"),
        (lambda: task_of(references=(1.0, 1.0)), "should be two different scores"),
        (lambda: task_of(period=0.0), "should be above 0 s"),
        (lambda: Study(task=LANE, scenario={"lenght": 3}), "did you mean 'length'?"),
        (lambda: Study(task=LANE, scenario={"length": 6.5}), "6.5: should be a whole number"),
        (lambda: Study(task=LANE, scenario={"length": "x"}), "length = 'x': should be a number"),
        (lambda: only_run(LANE, policies=["walkr"]), "no policy 'walkr'"),
        (lambda: only_run(LANE, policies=["swarm-dt"]), "the task has no policy 'swarm-dt'"),
        *(
            (lambda task=task: Study(task=task, sizes=[{"values": [2, 4]}]), words)
            for task, words in (
                ("warehous", "(a name or 'package.module:OBJECT'); did you mean 'warehouse'?"),
                ("nowhere:TASK", "task 'nowhere:TASK' cannot be imported: No module named 'now"),
                ("json:nothing", "has no attribute 'nothing'"),
                ("json:dumps", "is no task: should have the attributes of tasks.Task"),
                (3, "3 is no task"),
            )
        ),
        *(
            (lambda fields=fields: Study(task=LANE, **fields), words)
            for fields, words in (
                ({"faults": [{"modes": ["silnt"]}]}, "'silnt'; did you mean 'silent'?"),
                ({"faults": [{"modes": ["removed"]}]}, "no failure mode 'removed'"),
                ({"parameters": [{"name": "item_radius", "values": [1, 2]}]}, "known: duration, l"),
                ({"parameters": [{"name": "n_robots", "values": [1, 2]}]}, "belong in `sizes`"),
                ({"scenario": 3}, "should be a table of fields or a ParallelScenario"),
            )
        ),
        (
            lambda: only_run(LANE, faults=[{**FAULT, "onsets": [5]}]),
            "removed from the start, not from 5 s on, so FT is not defined here: should be asked",
        ),
    ],
)
def test_what_cannot_be_is_refused_before_any_run(make: Any, words: str) -> None:
    with pytest.raises(SwarmLogisticsError) as caught:
        make()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_settings_code_and_versions_are_part_of_the_code_version() -> None:
    assert task_of().code() == task_of().code()
    assert "pettingzoo" in task_of().code()
    noisier = task_of(failures={**FAILURES, "noisy": 0.1})
    others = [task_of(performance=costs), SCORED, noisier, task_of(period=0.5), SMALLER]
    assert len({task.code() for task in (task_of(), *others)}) == 6
