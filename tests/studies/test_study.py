"""A study from end to end: engines agree, failures are kept, a killed study goes on."""

from __future__ import annotations

import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.policies import SwarmDT
from swarm_logistics_env.report.document import document
from swarm_logistics_env.report.report_files import markdown
from swarm_logistics_env.studies import Study
from swarm_logistics_env.studies.indicator_table import INDICATORS
from swarm_logistics_env.studies.metadata import Declaration, notes_of
from swarm_logistics_env.studies.performance_table import PERFORMANCE
from swarm_logistics_env.studies.runs import Run, Shard
from swarm_logistics_env.studies.store import FILE_NAME, Store, export
from swarm_logistics_env.tasks.task import Outcome

DYING = """
import os, pathlib, signal
from swarm_logistics_env.policies import SwarmDT

class Dying(SwarmDT):
    identity = "dying"
    def act(self, observations):
        flag = pathlib.Path(os.environ["DYING_FLAG"])
        if os.environ["DYING_ALWAYS"] == "yes" or not flag.exists():
            flag.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().act(observations)
"""

SCRIPT = """
import json, sys
from swarm_logistics_env.studies import Study

if __name__ == "__main__":
    study = Study(out=sys.argv[1], **json.loads(sys.argv[2]))
    study.run(processes=int(sys.argv[3]))
"""

# Plays the study in a process group of its own per line that it reads, without a new interpreter.
SEVERAL_TIMES = """
import json, os, sys
from swarm_logistics_env.studies import Study

study = Study(**{**json.loads(sys.argv[2]), "seeds": 1, "faults": [], "parameters": []})
study.run()  # loads what is compiled
for _ in sys.stdin:
    child = os.fork()
    if child == 0:
        Study(out=sys.argv[1], **json.loads(sys.argv[2])).run()
        os._exit(0)
    os.setpgid(child, child)
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


class Steady(SwarmDT):
    """Swarm D-T under a name that nothing can load."""

    identity = "steady"


class Dizzy(SwarmDT):
    """Loses its numbers."""

    identity = "dizzy"

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        return np.full((len(observations), 4), np.nan)


ONE: dict[str, Any] = {"sizes": [{"values": [2, 4]}]}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small study, played in this process."""
    directory = tmp_path_factory.mktemp("undisturbed")
    Study(out=directory, **SMALL).run()
    return directory


SMALL: dict[str, Any] = {
    "name": "small",
    "seeds": 3,
    "scenario": {
        "n_robots": 4,
        "n_items": 8,
        "warehouse_width": 3.0,
        "warehouse_height": 3.0,
        "delivery_width": 1.0,
        "duration": 30.0,
    },
    "sizes": [{"values": [2, 4, 6]}],
    "faults": [{"modes": ["FM1", "FM4"], "robots": [1, 2], "onsets": [0.0, 10.0]}],
    "parameters": [{"name": "delivery_width", "values": [1.0, 0.5]}],
    "ablations": [{"policy": "random-walk"}],
}


def exported(directory: Path) -> bytes:
    path = directory / "export.csv"
    with Store.existing(directory) as store:
        export(store, path)
    return path.read_bytes()


def reports(directory: Path) -> list[bytes]:
    return [(directory / name).read_bytes() for name in ("report.md", "cells.csv", "claims.csv")]


def told(directory: Path) -> str:
    return markdown(document(Study.stored(directory).findings()))


def test_swarm_delivers_and_rows_are_sound(undisturbed: Path) -> None:
    with Store.existing(undisturbed) as store:
        rows = list(store.rows())
    assert len(rows) == len(list(Study(**SMALL).plan().runs()))
    assert sum(row["delivered"] for row in rows) > 0
    assert all(len(row["delivery_times"]) == row["delivered"] for row in rows)
    assert all(row["error"] is None for row in rows)


def test_study_killed_at_ten_random_moments_goes_on(undisturbed: Path, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    out = tmp_path / "out"
    command = [sys.executable, str(script), str(out), json.dumps(SMALL)]
    total = len(list(Study(**SMALL).plan().runs()))
    kept = 0

    def killed(group: int) -> None:
        nonlocal kept
        while stored(out) == kept:
            os.killpg(group, 0)  # it still runs
            time.sleep(0.002)
        time.sleep(random.Random().uniform(0, 0.02))
        os.killpg(group, signal.SIGKILL)

    def counted() -> None:
        nonlocal kept
        assert kept < stored(out) < total
        kept = stored(out)

    with subprocess.Popen(
        [sys.executable, "-c", SEVERAL_TIMES, *command[2:]],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as warm:
        assert warm.stdin is not None
        assert warm.stdout is not None
        for kill in range(10):
            if kill == 5:  # from a new interpreter, with workers of its own
                with subprocess.Popen([*command, "2"], start_new_session=True) as process:
                    killed(process.pid)
            else:
                print(file=warm.stdin, flush=True)
                killed(int(warm.stdout.readline()))
            counted()
    Study(out=out, **SMALL).run()
    assert exported(out) == exported(undisturbed)
    assert told(out) == told(undisturbed)


def stored(directory: Path) -> int:
    path = directory / FILE_NAME
    if not path.is_file():
        return 0
    database = sqlite3.connect(path)
    try:
        return int(database.execute("SELECT count(*) FROM runs").fetchone()[0])
    except sqlite3.OperationalError:  # the table does not exist yet
        return 0
    finally:
        database.close()


def test_finished_runs_are_kept_and_seeds_can_be_added(tmp_path: Path) -> None:
    fields = {**SMALL, "faults": [], "parameters": [], "ablations": []}
    first = Study(out=tmp_path, **{**fields, "seeds": 2})
    assert first.run().played == 3 * 2
    assert first.run().played == 0
    assert not first.findings().exploratory
    more = Study(out=tmp_path, **{**fields, "seeds": 3})
    tally = more.run()
    assert (tally.played, tally.kept) == (3, 6)
    assert more.findings().exploratory
    assert len(more.results()) == 9


def test_seeds_may_start_anywhere_and_others_than_the_declared_ones_are_exploratory(
    tmp_path: Path,
) -> None:
    fields = {**SMALL, "faults": [], "parameters": [], "ablations": [], "seeds": 2}
    first = Study(out=tmp_path, **fields, first_seed=1000)
    first.run()
    assert sorted(set(first.results()["seed"])) == [1000, 1001]
    assert not first.findings().exploratory
    assert not Study.stored(tmp_path).findings().exploratory
    report = first.report()[0].read_text()
    assert "2 seeds (1000 to 1001), the same seeds" in report
    assert "2 paired seeds (1000 to 1001)" in report
    fresh = Study(out=tmp_path, **fields, first_seed=2000)
    assert fresh.run().kept == 0  # as many, but others
    assert fresh.findings().exploratory
    overlapping = Study(out=tmp_path, **fields, first_seed=999)
    assert overlapping.run().kept == 3  # those of seed 1000
    assert overlapping.findings().exploratory
    part = Study(out=tmp_path, **{**fields, "seeds": 1}, first_seed=1000)
    assert part.run().played == 0
    assert part.findings().exploratory  # else one could choose the part that says most
    again = Study(out=tmp_path, **fields, first_seed=1000)
    assert again.run().played == 0
    assert not again.findings().exploratory


def test_another_study_does_not_enter_the_directory_of_this_one(tmp_path: Path) -> None:
    fields = {**SMALL, "faults": [], "parameters": [], "ablations": [], "seeds": 1}
    Study(out=tmp_path, **{**fields, "name": "first"}).run()
    report = Study.stored(tmp_path).report()[0].read_bytes()
    other = Study(out=tmp_path, **{**fields, "name": "second", "seeds": 2})
    with pytest.raises(StudyError, match="holds the study 'first': should be another directory"):
        other.run()
    assert Study.stored(tmp_path).specification.name == "first"
    assert Study.stored(tmp_path).report()[0].read_bytes() == report


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("policies", ["random-walk"]),
        ("faults", [{"modes": ["FM4"], "robots": [1]}]),
        ("sizes", [{"values": [2, 5]}]),
        ("scenario", {**SMALL["scenario"], "n_robots": 5}),
        ("indicators", ["S"]),
    ],
)
def test_a_study_of_the_same_name_that_asks_something_else_is_refused(
    field: str, value: Any, tmp_path: Path
) -> None:
    fields = {**SMALL, "parameters": [], "ablations": [], "seeds": 1}
    declared = Study(out=tmp_path, **fields).specification
    with Store(tmp_path / FILE_NAME) as store:
        covers = Declaration.model_validate(declared)
        store.note(notes_of(declared, declared.played.code(), {}, covers))
        notes = store.notes()
    other = Study(out=tmp_path, **{**fields, field: value})
    for ask in (other.run, other.exploratory_because):
        with pytest.raises(StudyError, match=f"with another {field}: should be as it was declared"):
            ask()
    with Store.existing(tmp_path) as store:
        assert store.notes() == notes
        assert len(store) == 0


def test_stored_study_is_judged_without_its_policies(tmp_path: Path) -> None:
    study = Study(out=tmp_path, policies=[Steady()], seeds=2, scenario=SMALL["scenario"], **ONE)
    study.run()
    study.report()
    written = reports(tmp_path)
    again = Study.stored(tmp_path)
    assert [c.key for c in again.plan().conditions] == [c.key for c in study.plan().conditions]
    again.report()
    assert reports(tmp_path) == written
    with sqlite3.connect(tmp_path / FILE_NAME) as database:
        database.execute("UPDATE notes SET value = 'older' WHERE name = 'code'")
    database.close()
    with pytest.raises(StudyError, match="was played under code version older"):
        Study.stored(tmp_path).run()


def test_only_what_is_asked_is_run() -> None:
    fields = {**SMALL, "faults": [{"modes": ["FM1"], "robots": [1]}], "indicators": ["R"]}
    plan = Study(**fields).plan()
    assert {comparison.indicator for comparison in plan.comparisons} == {"R"}
    assert len(plan.conditions) == 2


def test_failed_run_is_a_row_and_blocks_the_verdict(tmp_path: Path) -> None:
    fields: dict[str, Any] = {
        **SMALL,
        "policies": [Failing()],
        "faults": [],
        "parameters": [],
        "ablations": [],
    }
    study = Study(out=tmp_path, **fields)
    tally = study.run()
    assert tally.failed == tally.played == 9
    assert tally.error == "RuntimeError: a wheel came off"
    errors = study.results()["error"]
    assert errors.str.contains("RuntimeError: a wheel came off").all()
    assert errors.str.contains("Traceback").all()
    tests = study.indicators()
    assert tests[["value", "verdict", "verdict_holm"]].isna().all(axis=None)
    assert tests["problem"].str.contains("3 of 3 runs failed").all()
    study.report()
    assert "blocked" in (tmp_path / "report.md").read_text()
    Failing.broken = False
    try:
        assert study.run().failed == 0
    finally:
        Failing.broken = True
    assert study.results()["error"].isna().all()
    assert study.indicators()["value"].notna().all()


def test_one_failed_run_blocks_its_family_under_holm(tmp_path: Path) -> None:
    fields = {**SMALL, "faults": [], "parameters": [], "ablations": []}
    study = Study(out=tmp_path, **fields)
    study.run()
    largest = next(c for c in study.plan().conditions if c.scenario.n_robots == 6)
    with sqlite3.connect(tmp_path / FILE_NAME) as database:
        database.execute(
            "UPDATE runs SET error = 'Traceback', delivered = NULL WHERE run = ?",
            (largest.run(study.plan().code, 1).key,),
        )
    database.close()
    tests = study.indicators()
    assert tests["value"].notna().tolist() == [True, False]
    assert tests["verdict_holm"].isna().all()
    assert tests["problem"].tolist() == [None, "N = 6: 1 of 3 runs failed"]


def test_policy_that_returns_nan_fails_in_words_and_spoils_nothing_else() -> None:
    study = Study(**{**SMALL, **ONE, "policies": [Dizzy(), "swarm-dt"], "faults": []})
    tally = study.run()
    assert 0 < tally.failed < tally.played
    results = study.results()
    dizzy = results["policy"] == "Dizzy"
    assert results.loc[dizzy, "error"].str.contains("PolicyError: Dizzy at 0 s").all()
    assert results.loc[~dizzy, "error"].isna().all()


def test_disk_that_fills_up_stops_the_study_in_words_and_keeps_what_is_finished(
    undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add = Store.add

    def add_until_full(store: Store, run: Run, outcome: Outcome) -> None:
        if len(store) == 5:
            (pages,) = store._connection.execute("PRAGMA page_count").fetchone()
            store._connection.execute(f"PRAGMA max_page_count = {pages}")
        add(store, run, outcome)

    with monkeypatch.context() as patched:
        patched.setattr(Store, "add", add_until_full)
        with pytest.raises(StudyError, match="disk is full"):
            Study(out=tmp_path, **SMALL).run()
    before = stored(tmp_path)
    assert before >= 5
    study = Study(out=tmp_path, **SMALL)
    assert study.run().kept == before
    assert exported(tmp_path) == exported(undisturbed)


@pytest.mark.parametrize("always", ["no", "yes"])
def test_run_whose_worker_is_killed_is_tried_again_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, always: str
) -> None:
    (tmp_path / "dying_policy.py").write_text(DYING)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("DYING_FLAG", str(tmp_path / "flag"))
    monkeypatch.setenv("DYING_ALWAYS", always)
    study = Study(
        out=tmp_path / "out",
        policies=["dying_policy:Dying"],
        seeds=1,
        scenario=SMALL["scenario"],
        sizes=[{"values": [2, 4]}],
    )
    # One run is enough where it ends its workers for good.
    tally = study.run("process", processes=1, shard=Shard(1, 2) if always == "yes" else None)
    if always == "no":
        assert (tally.played, tally.failed) == (2, 0)
    else:
        assert (tally.played, tally.failed) == (1, 1)
        assert study.results()["error"].str.contains("SIGKILL").all()


def test_policy_that_cannot_travel_is_refused(tmp_path: Path) -> None:
    class Local(SwarmDT):
        identity = "local"

    study = Study(
        out=tmp_path, policies=[Local()], seeds=1, scenario=SMALL["scenario"], sizes=SMALL["sizes"]
    )
    with pytest.raises(StudyError, match="use one process"):
        study.run("process", processes=1)
    assert study.run(processes=1).failed == 0


def test_study_in_memory() -> None:
    study = Study(**{**SMALL, "seeds": 2})
    with pytest.raises(StudyError, match="nothing has been run"):
        study.results()
    study.run()
    table = study.indicators()
    assert list(table["indicator"].unique()) == ["S", "FT", "R", "A", "change"]
    assert table["problem"].isna().all()
    assert list(table.columns) == list(INDICATORS)
    performance = study.performance()
    assert list(performance.columns) == list(PERFORMANCE)
    assert [p.mean() for p in performance["by_seed"]] == performance["mean"].tolist()
    with pytest.raises(StudyError, match="report needs a path"):
        study.report()
