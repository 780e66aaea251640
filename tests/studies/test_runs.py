"""The store of a study: what is finished stays, whatever else is killed, refused or damaged."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from swarm_logistics_env import Scenario
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.studies.runs import FILE_NAME, Runs, export
from swarm_logistics_env.studies.specification import seeds_in_words
from swarm_logistics_env.tasks.task import Case, Outcome, Run
from swarm_logistics_env.tasks.warehouse_task import WAREHOUSE

CASE = Case(PolicySpec(name="swarm-dt", label="mine"), "identity", Scenario(), task=WAREHOUSE)


def run(seed: int) -> Run:
    return CASE.run("code", seed)


def outcome(*times: float) -> Outcome:
    return Outcome(np.array(times), 500.0, False, (3,), 1.5, wall_seconds=0.1)


def test_result_survives_closing(tmp_path: Path) -> None:
    times = [0.1, 1 / 3, 499.99999999999994]
    with Runs(tmp_path / FILE_NAME) as runs:
        runs.add(run(0), outcome(*times))
    with Runs.existing(tmp_path) as runs:
        ((place, kept),) = runs.outcomes([run(0), run(1)]).items()
    assert place == (CASE.key, 0)
    assert kept.delivery_times.tolist() == times
    assert (kept.delivered, kept.ended_at, kept.failed_robots) == (3, 500.0, (3,))
    assert (kept.anchoring_seconds, kept.error) == (1.5, None)


def test_failure_is_kept_until_the_run_succeeds_and_success_for_good() -> None:
    with Runs(None) as runs:
        runs.add(run(0), Outcome(error="Traceback: first"))
        assert runs.succeeded() == set()
        (row,) = runs.frame().to_dict("records")
        assert (row["error"], row["delivered"]) == ("Traceback: first", None)
        for late in (outcome(1.0), Outcome(error="Traceback: late"), outcome(1.0, 2.0)):
            runs.add(run(0), late)
            assert runs.succeeded() == {run(0).key}
        (row,) = runs.frame().to_dict("records")
        assert (row["delivered"], row["error"]) == (1, None)


def test_an_outcome_that_cannot_be_is_refused() -> None:
    for name, values in {
        "delivery_times": ([2.0, 1.0], [-1.0], [float("nan")]),
        "ended_at": (-1.0,),
        "untimed": (float("inf"),),
        "failed_robots": (("x",),),
    }.items():
        for value in values:
            with pytest.raises(ValueError, match=name):
                Outcome(**{name: value})  # type: ignore[arg-type]


def test_csv_says_what_the_store_holds_sorted_and_without_wall_times(
    played: Path, tmp_path: Path
) -> None:
    with Runs.existing(played) as runs:
        frame = runs.frame()
        (count, digest), again = (export(runs, tmp_path / f"{n}.csv") for n in range(2))
        for name in ("rows.xlsx", "rows", "nowhere/rows.csv"):
            with pytest.raises(StudyError, match=r"cannot (export to|write)"):
                export(runs, tmp_path / name)
    assert (count, digest) == (len(frame), again[1])
    text = pd.read_csv(tmp_path / "0.csv")
    assert list(text["run"]) == sorted(text["run"])
    assert "wall_seconds" not in text
    for times, known in zip(text["delivery_times"].fillna(""), frame["delivery_times"]):
        assert list(map(float, times.split())) == known
    assert json.loads(text["scenario"][0])["warehouse_width"] == 3.0
    with Runs(None) as runs:
        runs.add(run(0), Outcome(error="Traceback"))
        export(runs, tmp_path / "failed.csv")
    (row,) = pd.read_csv(tmp_path / "failed.csv").to_dict("records")
    assert (np.isnan(row["delivered"]), row["error"]) == (True, "Traceback")


def spoilt(path: Path, *statements: str) -> Path:
    with Runs(path) as runs:
        for seed in range(50):
            runs.add(run(seed), outcome(*[1.0] * 50))
        for statement in statements:
            runs._connection.execute(statement)
    return path


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda path: path.write_text("run,seed\n" * 200), "not a database"),
        (lambda path: spoilt(path, "PRAGMA user_version = 99"), "store schema 99"),
        (lambda path: spoilt(path, "PRAGMA application_id = 0"), "not the store of a study"),
        (lambda path: path.write_bytes(spoilt(path).read_bytes()[:5000]), "malformed"),
        (
            lambda path: spoilt(path, "UPDATE runs SET outcome = '{\"delivery_times\": [-1.0]}'"),
            "is damaged: a run in it does not read",
        ),
    ],
)
def test_what_is_no_store_is_refused_with_the_reason(
    tmp_path: Path, spoil: Any, words: str
) -> None:
    path = tmp_path / FILE_NAME
    spoil(path)
    before = path.read_bytes()
    with pytest.raises(StudyError, match=words), Runs(path) as runs:
        runs.frame()
    assert path.read_bytes() == before


def test_store_that_is_read_is_left_as_it_is(tmp_path: Path) -> None:
    # A space and the signs that a URI gives a meaning.
    directory = tmp_path / "a study? 100% #1"
    directory.mkdir()
    path = directory / FILE_NAME
    with Runs(path) as runs:
        runs.add(run(0), outcome(1.0))
        # A log holds the latest runs until the last writer closes.
        with Runs.existing(directory) as reader:
            assert reader.succeeded() == {run(0).key}
    before = path.read_bytes()
    with Runs.existing(directory) as runs:
        assert runs.succeeded() == {run(0).key}
        assert runs.notes() == {}
        with pytest.raises(StudyError, match="readonly database"):
            runs.add(run(1), outcome(1.0))
        assert list(directory.iterdir()) == [path]
    assert path.read_bytes() == before


MAKER = """
import pathlib, sys
from swarm_logistics_env.studies.runs import Runs

for line in sys.stdin:
    with Runs(pathlib.Path(line.strip())) as runs:
        runs.note({sys.argv[1]: "here"})
    print("made", flush=True)
"""


def test_two_processes_may_make_the_store_at_once(tmp_path: Path) -> None:
    pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    makers = [subprocess.Popen([sys.executable, "-c", MAKER, name], **pipes) for name in "01"]
    with makers[0], makers[1]:
        for attempt in range(8):
            directory = tmp_path / str(attempt)
            directory.mkdir()
            for maker in makers:
                print(directory / FILE_NAME, file=maker.stdin, flush=True)
            assert [maker.stdout and maker.stdout.readline() for maker in makers] == ["made\n"] * 2
            with Runs.existing(directory) as runs:
                assert runs.notes() == {"0": "here", "1": "here"}


def test_a_new_store_is_there_once_it_is_whole_and_never_in_part(tmp_path: Path) -> None:
    out = tmp_path / "new"
    with pytest.raises(StudyError, match="no study in"):
        Runs.existing(tmp_path)

    def made(*, stopped: bool) -> None:
        with Runs.new(out, "merge") as runs:
            runs.note({"name": "value"})
            assert not (out / FILE_NAME).exists()
            if stopped:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        made(stopped=True)
    assert list(out.iterdir()) == []
    made(stopped=False)
    with Runs.existing(out) as runs:
        assert runs.notes() == {"name": "value"}
    assert [path.name for path in out.iterdir()] == [FILE_NAME]
    with pytest.raises(StudyError, match="holds a study already: merge into a new directory"):
        made(stopped=False)
    out = out / FILE_NAME / "in"
    with pytest.raises(StudyError, match=f"cannot write to {out}"):
        made(stopped=False)


def test_seeds_are_told_as_ranges() -> None:
    for seeds, words in ((range(20), "0 to 19"), ([7], "7"), ((1, 3, 4, 9), "1, 3 to 4, 9")):
        assert seeds_in_words(seeds) == words
