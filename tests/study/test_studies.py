"""A study from end to end: failures are kept, a killed one goes on, declared seeds are guarded."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.core import progress_bar
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.study import studies
from swarm_logistics_env.study.questions.declaration import Declaration
from swarm_logistics_env.study.questions.plan import Plan
from swarm_logistics_env.study.report.document import document
from swarm_logistics_env.study.report.write import markdown
from swarm_logistics_env.study.runs.engines import Shard
from swarm_logistics_env.study.runs.notes import note
from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs
from swarm_logistics_env.study.runs.worker_processes import Played
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.task import Outcomes, Run
from swarm_logistics_env.study.trials import read_trials
from swarm_logistics_env.study.verdicts.until_clear import Judged, LatestLook, latest_look
from tests.conftest import SMALL
from tests.made_up import alter, delivered, digest
from tests.study.verdicts.test_until_clear import Engine, until_clear

DYING = """
import os, pathlib, signal
from swarm_logistics_env.policies import SwarmDT

class Dying(SwarmDT):
    identity = "dying"
    def act(self, observations):
        deaths = pathlib.Path(os.environ["DEATHS"], f"{len(observations)}")
        if left := int(deaths.read_text()):
            deaths.write_text(f"{left - 1}")
            os.kill(os.getpid(), signal.SIGKILL)
        return super().act(observations)
"""

# Plays the study, in a process group of its own per number of processes that it reads. It keeps at
# most four more runs, and then waits until it is killed.
SEVERAL_TIMES = """
import json, os, signal, sys
from swarm_logistics_env.study.runs.store import Runs
from swarm_logistics_env.study.studies import Study

add, added = Runs.add, []
def add_or_wait(store, runs):
    added.extend(runs)
    if len(added) > 4:
        signal.pause()
    add(store, runs)

fields = json.loads(sys.argv[2])
Study(**{**fields, "seeds": 1, "faults": [], "parameters": []}).run()  # loads what is compiled
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        Runs.add = add_or_wait
        Study(out=sys.argv[1], **fields).run(processes=int(line))
        os._exit(0)
    print(child, flush=True)
    os.waitpid(child, 0)
"""


class Failing(SwarmDT):
    """Swarm D-T that breaks down where it is told to."""

    identity = "failing"
    broken = True

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        if Failing.broken:
            raise RuntimeError("a wheel came off")
        return np.asarray(super().act(observations), dtype=np.float64)


def stored(directory: Path) -> int:
    try:
        with Runs.existing(directory) as runs:
            return len(runs)
    except StudyError:  # there is no store yet, or no table in it
        return 0


@pytest.mark.daily
def test_another_thread_may_ask_a_study_and_play_it(tmp_path: Path) -> None:
    for out in (None, tmp_path / "out"):
        study, answers = Study(out=out, **SMALL), list[Any]()

        def ask(study: Study = study, answers: list[Any] = answers) -> None:
            answers.append(study.run().failed)
            answers.append(len(study.findings().verdicts))

        study.run()
        thread = threading.Thread(target=ask)
        thread.start()
        thread.join()
        assert answers == [0, len(study.findings().verdicts)]


@pytest.mark.daily
def test_study_killed_at_five_random_moments_goes_on(played: Path, tmp_path: Path) -> None:
    out, total, n_stored = tmp_path / "out", stored(played), 0
    moments = random.Random(0)
    with subprocess.Popen(
        [sys.executable, "-c", SEVERAL_TIMES, str(out), json.dumps(SMALL)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as warm:
        assert warm.stdin is not None
        assert warm.stdout is not None
        for kill in range(5):
            print(2 if kill == 3 else 1, file=warm.stdin, flush=True)
            group = int(warm.stdout.readline())
            while stored(out) == n_stored:
                os.kill(group, 0)  # it still runs
                time.sleep(0.002)
            time.sleep(moments.uniform(0, 0.01))
            os.killpg(group, signal.SIGKILL)
            assert n_stored < stored(out) < total
            n_stored = stored(out)
    Study(out=out, **SMALL).run()
    assert digest(out, tmp_path) == digest(played, tmp_path)
    report, undisturbed_report = (
        markdown(document(Study.stored(where).findings())) for where in (out, played)
    )
    assert report == undisturbed_report


@pytest.mark.parametrize(
    ("first_seed", "seeds", "n_reused", "exploratory"),
    [
        (1000, 2, 4, False),
        (1000, 3, 4, True),
        (999, 2, 2, True),  # as many, but others
        (1000, 1, 2, True),  # else one could choose the part that says most
    ],
)
def test_verdicts_over_others_than_the_declared_seeds_are_exploratory(
    sizes: dict[str, Any],
    first_seed: int,
    seeds: int,
    n_reused: int,
    exploratory: bool,
    tmp_path: Path,
) -> None:
    fields = {**sizes, "sizes": [{"values": [2, 4]}]}
    declared = Study(out=tmp_path, **{**fields, "seeds": 2}, first_seed=1000)
    declared.run()
    study = Study(out=tmp_path, **{**fields, "seeds": seeds}, first_seed=first_seed)
    assert study.is_exploratory() == exploratory
    tally = study.run()
    assert (tally.kept, tally.played) == (n_reused, 2 * seeds - n_reused)
    assert study.findings().exploratory == exploratory
    assert sorted(set(study.results()["seed"])) == list(range(first_seed, first_seed + seeds))
    assert declared.run().played == 0
    assert not declared.findings().exploratory


def test_another_study_does_not_enter_the_directory_of_this_one(
    small: dict[str, Any], tmp_path: Path
) -> None:
    edits = {"name": "second", "policies": ["random-walk"], "faults": [], "indicators": ["S"]}
    declared = Study(out=tmp_path, **small)
    with Runs(tmp_path / FILE_NAME) as runs:
        note(runs, declared.plan(), Declaration.model_validate(declared.specification))
        notes = runs.notes()
    for field, value in edits.items():
        other = Study(out=tmp_path, **{**small, field: value})
        for ask in (other.run, other.is_exploratory, other.findings):
            with pytest.raises(StudyError, match=f"holds the study 'small' with other {field}: "):
                ask()
    with Runs.existing(tmp_path) as runs:
        assert (runs.notes(), len(runs)) == (notes, 0)


def test_stored_study_is_judged_without_its_policies(
    sizes: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Failing, "broken", False)
    study = Study(out=tmp_path, **{**sizes, "policies": [Failing()], "seeds": 2})
    study.run()
    again = Study.stored(tmp_path)
    assert [case.key for case in again.plan().cases] == [case.key for case in study.plan().cases]
    # The page alone names commands, which need the policy.
    first, second = study.report()[1:], again.report(tmp_path / "elsewhere")[1:]
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]
    alter(tmp_path / FILE_NAME, "UPDATE notes SET value = json_set(value, '$.code', 'older')")
    with pytest.raises(StudyError, match="was played under code version older"):
        Study.stored(tmp_path).run()
    nobody = "UPDATE notes SET value = json_set(value, '$.identities', json('{}'))"
    alter(tmp_path / FILE_NAME, nobody)
    with pytest.raises(StudyError, match=r"does not know the identity of its policy Failing$"):
        Study.stored(tmp_path)


def test_failed_runs_are_rows_block_their_verdicts_and_are_tried_again(
    sizes: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = Study(out=tmp_path, **{**sizes, "policies": [Failing()]})
    # Nothing works: what is left is played by a later call.
    tally = study.run()
    assert (tally.failed, tally.left, tally.error) == (4, 5, "RuntimeError: a wheel came off")
    errors = study.results()["error"]
    assert errors.str.contains(r"Traceback[^$]*RuntimeError: a wheel came off").all()
    tests = study.indicators()
    assert tests["value"].isna().all()
    assert {*tests["verdict"], *tests["verdict_holm"]} == {"undefined"}
    assert tests["problem"].str.contains("1 of 3 runs failed, 2 of 3 runs missing").all()
    monkeypatch.setattr(Failing, "broken", False)
    assert study.run().failed == 0
    assert study.results()["error"].isna().all()
    assert study.indicators()["value"].notna().all()


@pytest.mark.daily
def test_run_whose_worker_is_killed_is_tried_again_once(
    sizes: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "dying_policy.py").write_text(DYING)
    for n_robots, deaths in ((2, 1), (4, 2), (6, 0)):
        (tmp_path / f"{n_robots}").write_text(f"{deaths}")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("DEATHS", str(tmp_path))
    study = Study(**{**sizes, "policies": ["dying_policy:Dying"], "seeds": 1})
    tally = study.run("process", processes=1)
    assert (tally.played, tally.failed) == (3, 1)
    (error,) = study.results()["error"].dropna()
    assert "WorkerDied" in error
    assert [(tmp_path / f"{n_robots}").read_text() for n_robots in (2, 4, 6)] == ["0"] * 3


def test_time_that_is_over_leaves_runs_for_the_same_call(sizes: dict[str, Any]) -> None:
    study = Study(**{**sizes, "seeds": 1})
    tally = study.run(minutes=0.0)
    assert (tally.played, tally.left) == (1, 2)
    assert study.finished() == (1, 3)
    tally = study.run(minutes=60.0)
    assert (tally.kept, tally.played, tally.left) == (1, 2, 0)


def test_a_policy_that_cannot_travel_and_a_study_in_memory(sizes: dict[str, Any]) -> None:
    class Rooted(SwarmDT):
        def __reduce_ex__(self, protocol: object) -> Any:
            raise TypeError("has roots")

        def __deepcopy__(self, memo: object) -> Rooted:
            return Rooted()

    study = Study(**{**sizes, "policies": [Rooted()], "seeds": 1})
    with pytest.raises(StudyError, match="nothing has been run"):
        study.results()
    with pytest.raises(StudyError, match="use one process"):
        study.run("process", processes=1)
    assert study.run(processes=1).failed == 0
    with pytest.raises(StudyError, match="report needs a path"):
        study.report()
    with pytest.raises(StudyError, match="cannot write to"):
        Study(out=Path(__file__) / "in", **sizes).run()


def test_another_specification_makes_another_plan(tmp_path: Path) -> None:
    study = Study(**{**SMALL, "seeds": 2})
    before = study.plan()
    study.specification = study.specification.replace(seeds=3)
    assert (len(before.seeds), len(study.plan().seeds)) == (2, 3)
    (tmp_path / "t.csv").write_text("robots,p\n4,1\n8,2\n")
    RecordedStudy.of(read_trials(tmp_path / "t.csv")).keep(tmp_path / "out")
    imported = Study.stored(tmp_path / "out")
    with pytest.raises(StudyError, match="asks what its trials vary"):
        imported.specification = study.specification
    assert imported.plan().origin is not None


@pytest.mark.unmeasured
def test_the_same_outcomes_are_looked_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    study, looks_at = until_clear(30), list[int]()

    def counted(plan: Plan, outcomes: Outcomes, judged: Judged) -> LatestLook:
        looks_at.append(len(outcomes))
        look = latest_look(plan, outcomes, judged)
        anew = latest_look(plan, outcomes)
        assert repr(look.verdicts) == repr(anew.verdicts)  # a nan is not equal to itself
        return look

    monkeypatch.setattr(studies, "latest_look", counted)
    study.run(Engine(), after_look=lambda _: None)
    results = study.findings()
    assert looks_at == sorted(set(looks_at))
    assert looks_at[-1] == len(results.outcomes)
    assert study._judged
    study.specification = study.specification.replace(margin=0.2)
    assert study.findings().verdicts != results.verdicts  # another plan's looks


def test_it_says_where_its_runs_are(tmp_path: Path) -> None:
    assert repr(Study(name="mine", seeds=2)) == "Study('mine', in memory)"
    assert repr(Study(name="mine", seeds=2, out=tmp_path)) == f"Study('mine', in {tmp_path})"


def test_a_notebook_shows_what_is_asked_and_how_much_of_it_is_played() -> None:
    def engine(runs: Iterable[Run]) -> Played:
        for run in runs:
            yield run, delivered(run.case.scenario.n_robots)

    fields: dict[str, Any] = {"policies": ["homing", "swarm-dt"], "sizes": [{"values": [2, 4]}]}
    study = Study(name="mine", seeds=2, **fields)
    words = (
        "mine: 2 questions; 4 conditions x 2 seeds = 8 runs; homing, swarm-dt; {} of 8 runs done"
    )
    head = "<b>Study(&#x27;mine&#x27;, in memory)</b><br>"
    assert study._repr_html_() == head + words.format(0)
    tally = study.run(engine, shard=Shard(1, 2))
    assert (tally.played, tally.failed, tally.kept, tally.left) == (4, 0, 0, 0)
    assert not tally.gave_up
    assert study._repr_html_() == head + words.format(4)
    assert [study.finished(Shard(number, 2)) for number in (1, 2)] == [(4, 4), (0, 4)]
    tally = study.run(engine)
    assert (tally.played, tally.kept, tally.changes) == (4, 4, ())
    assert study.results()["delivered"].tolist().count(2) == 4
    with pytest.raises(StudyError, match=r"^shard: should not be with until_clear, where all runs"):
        Study(until_clear=True, **fields).run(engine, shard=Shard(1, 2))


def test_until_it_is_clear_a_study_counts_its_next_look_and_all_that_may_follow(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress_bar, "LINE_EVERY", 0.0)
    study = until_clear(30)
    assert study.finished() == (0, 120)
    study.run(Engine(most=4))
    assert study.finished() == (4, 40)  # also what no other comparison shares
    assert capsys.readouterr().err.startswith("study: 1 of 120 runs at most, ")


def test_what_was_never_run_has_no_results_and_makes_no_store(tmp_path: Path) -> None:
    study = Study(seeds=2, out=tmp_path)
    with pytest.raises(StudyError, match="no study in"):
        study.results()
    sized = Study(seeds=2, out=tmp_path, sizes=[{"values": [2, 4, 6]}])
    assert sized.finished() == (0, 6)
    assert not any(tmp_path.iterdir())
