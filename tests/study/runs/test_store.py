"""The store of a study: what is finished stays, whatever else is killed, refused or damaged."""

from __future__ import annotations

import csv
import json
import re
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_logistics_env import Scenario
from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.records import write_csv
from swarm_logistics_env.policies import PolicySpec
from swarm_logistics_env.policies.swarm_dt import SwarmDT
from swarm_logistics_env.study.runs import store
from swarm_logistics_env.study.runs.rows import COUNTED
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs, export
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.tasks.outcome import Outcome
from swarm_logistics_env.study.tasks.task import Case, Run
from swarm_logistics_env.study.tasks.warehouse_task import WAREHOUSE
from swarm_logistics_env.study.trials import read_trials
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.views.cli.terminal import say_what_was_played
from tests.made_up import delivered

CASE = Case(PolicySpec(name="swarm-dt", label="mine"), "identity", Scenario(), task=WAREHOUSE)


def run(seed: int) -> Run:
    return Run(CASE, "code", seed)


def outcome(*times: float) -> Outcome:
    return Outcome(np.array(times), 500.0, False, (3,), 1.5, wall_seconds=0.1)


def test_failure_is_kept_until_the_run_succeeds_and_success_for_good() -> None:
    with Runs(None) as runs:
        runs.add([(run(0), Outcome(error="Traceback: first"))])
        assert runs.succeeded() == set()
        (row,) = runs.frame().to_dict("records")
        assert (row["error"], row["delivered"]) == ("Traceback: first", None)
        for late in (outcome(1.0), Outcome(error="Traceback: late"), outcome(1.0, 2.0)):
            runs.add([(run(0), late)])
            assert runs.succeeded() == {run(0).key}
        (row,) = runs.frame().to_dict("records")
        assert (row["delivered"], row["error"]) == (1, None)


def test_an_outcome_that_cannot_be_is_refused() -> None:
    for times in ([2.0, 1.0], [-1.0], [float("nan")]):
        with pytest.raises(ValueError, match="delivery_times"):
            Outcome(delivery_times=np.array(times))
    with pytest.raises(ValueError, match="untimed"):
        Outcome(untimed=float("inf"))


def test_csv_says_what_the_store_holds_sorted_and_without_wall_times(
    played: Path, tmp_path: Path
) -> None:
    with Runs.existing(played) as runs:
        frame = runs.frame()
        (count, digest), again = (export(runs, tmp_path / f"{n}.csv") for n in range(2))
        for name, words in (
            ("rows.xlsx", r"cannot export to .*rows\.xlsx: should end in \.csv$"),
            ("nowhere/rows.csv", "cannot write"),
        ):
            with pytest.raises(StudyError, match=words):
                export(runs, tmp_path / name)
    assert (count, digest) == (len(frame), again[1])
    text = pd.read_csv(tmp_path / "0.csv")
    assert list(text["run"]) == sorted(text["run"])
    assert "wall_seconds" not in text
    for times, expected in zip(text["delivery_times"].fillna(""), frame["delivery_times"]):
        assert list(map(float, times.split())) == expected
    assert json.loads(text["scenario"][0])["warehouse_width"] == 3.0


# An empty policy beside another one is refused.
@pytest.mark.unmeasured
@given(text=st.text(st.sampled_from("=+-@'\"a1 ;.\t\r\n"), max_size=5).filter(str.strip))
def test_no_text_in_a_csv_is_a_formula_and_each_is_read_again(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "one.csv")
        write_csv(
            path,
            pd.DataFrame({"policy": [text, "us"], "low": [-1.5, 2.0], "P": [4, 4]}),
            StudyError,
        )
        trials = read_trials(path, ignore=["low"])
        with path.open(newline="") as file:
            _, (cell, number, _), _ = csv.reader(file)
    assert number == "-1.5"
    assert not re.match(r"[=@\t\r\n]|[+-](?!\d*\.?\d*$)", cell)
    cleaned = re.sub(r"[\r\n]+", " ", text.strip())
    assert [trial.policy for trial in trials.rows] == [cleaned or "one", "us"]


def test_labels_and_errors_are_exported_without_formulas(tmp_path: Path) -> None:
    evil = Case(PolicySpec(name="swarm-dt", label="=1+1"), "id", Scenario(), task=WAREHOUSE)
    with Runs(None) as runs:
        runs.add([(Run(evil, "code", 0), Outcome(error="@SUM(1)\r=2"))])
        export(runs, tmp_path / "rows.csv")
    with (tmp_path / "rows.csv").open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["policy"], row["error"]) == ("'=1+1", "'@SUM(1)\n=2")


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        ("", "malformed"),
        ("PRAGMA user_version = 99", "store schema 99"),
        ("PRAGMA application_id = 0", "not the store of a study"),
        ("PRAGMA user_version = 4", r"is damaged \(schema 4 with other columns\)"),
    ],
)
def test_what_is_no_store_is_refused_with_the_reason(
    tmp_path: Path, spoil: str, words: str
) -> None:
    path = tmp_path / FILE_NAME
    with Runs(path) as runs:
        for seed in range(50):
            runs.add([(run(seed), outcome(*[1.0] * 50))])
        runs._connection.execute(spoil)
    before = path.read_bytes()[: None if spoil else 5000]
    path.write_bytes(before)
    with pytest.raises(StudyError, match=words), Runs(path) as runs:
        runs.frame()
    assert path.read_bytes() == before


def test_of_the_runs_of_a_store_those_whose_keys_are_given_are_shown(tmp_path: Path) -> None:
    all_runs = [run(seed) for seed in range(3)]
    first, second, third = sorted(run.key for run in all_runs)
    with Runs(None) as runs:
        assert export(runs, tmp_path / "none.csv")[0] == 0
        runs.add((run, delivered(run.seed, ended_at=60.0)) for run in all_runs)
        rows = runs.frame()
        assert rows["run"].tolist() == [first, second, third]
        assert runs.frame([third, first, "nobody"])["run"].tolist() == [first, third]
        assert len(runs.frame([])) == 0
    assert rows["policy_identity"].tolist() == ["identity"] * 3
    by_seed = rows.sort_values("seed")
    assert by_seed["longest_standstill"].tolist() == [60.0, 60.0, 59.0]


def test_store_keeps_outcomes_exactly_and_reading_leaves_it_as_it_is(tmp_path: Path) -> None:
    # A space and the signs that a URI gives a meaning.
    directory, times = tmp_path / "a study? 100% #1", [0.1, 1 / 3, 499.99999999999994]
    directory.mkdir()
    path = directory / FILE_NAME
    with Runs(path) as runs:
        runs.add([(run(0), outcome(*times))])
        # A log holds the latest runs until the last writer closes.
        with Runs.existing(directory) as reader:
            assert reader.succeeded() == {run(0).key}
    before = path.read_bytes()
    with Runs.existing(directory) as runs:
        ((run_key, stored),) = runs.outcomes([run(0), run(1)]).items()
        with pytest.raises(StudyError, match="readonly database"):
            runs.add([(run(1), outcome(1.0))])
        assert list(directory.iterdir()) == [path]
    assert path.read_bytes() == before
    assert (run_key, stored.delivery_times.tolist()) == ((CASE.key, 0), times)
    assert (stored.ended_at, stored.failed_robots, stored.anchoring_seconds) == (500.0, (3,), 1.5)


def test_contacts_that_nobody_counted_are_missing_and_never_0(tmp_path: Path) -> None:
    counted = replace(outcome(1.0), contacts_per_robot_minute=0.0, overlap_share=0.25, on_time=3)
    with Runs(tmp_path / FILE_NAME) as runs, Runs(None) as other:
        runs.add([(run(0), outcome(1.0))])  # as an older version, which knew none of the fields
        runs.add([(run(1), counted)])
        written = [row.outcome for row in sorted(runs._rows(), key=lambda row: row.rowid)]
        assert not any(name in written[0] for name in COUNTED)
        older, newer = (runs.outcomes([run(seed)])[CASE.key, seed] for seed in range(2))
        assert [getattr(older, name) for name in COUNTED] == [None] * 13
        assert (newer.contacts_per_robot_minute, newer.fast_contacts) == (0.0, None)
        other.absorb(runs)
        assert other.outcomes([run(1)])[CASE.key, 1].overlap_share == 0.25
        export(runs, tmp_path / "rows.csv")
    table = pd.read_csv(tmp_path / "rows.csv").sort_values("seed")
    assert table["contacts_per_robot_minute"].isna().tolist() == [True, False]
    assert table["overlap_share"].iloc[1] == 0.25
    assert table["mean_acceleration"].isna().all()
    assert table["on_time"].iloc[1] == 3
    assert "longest_queue" not in table  # of orders, which no run had


@pytest.mark.unmeasured
@pytest.mark.parametrize(
    "text", ["\udc80a\0b\x1b[2J\u2028", "x" * 5_000_000, "line\n" * 30_000, "\n", ""]
)
def test_a_policy_that_fails_with_any_text_leaves_a_study_that_is_finished_and_reported(
    sizes: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    class Complaining(SwarmDT):
        identity = f"complaining of {text[:5]}"

        def act(self, observations: Any) -> Any:
            raise ValueError(text)

    fields = {**sizes, "sizes": [{"values": [2, 4]}], "seeds": 1, "policies": [Complaining()]}
    study = Study(out=tmp_path, **fields)
    tally = study.run()
    assert (tally.played, tally.failed) == (2, 2)
    assert tally.error
    say_what_was_played(tally)
    for words in (["report"], ["export", "--to", str(tmp_path / "rows.csv")]):
        assert app.run(["study", words[0], str(tmp_path), *words[1:]]) == 0
    assert "\x1b" not in (printed := capsys.readouterr().out)
    assert len(printed) < 20_000
    errors = study.results()["error"]
    assert errors.str.contains("ValueError").all()
    assert max(map(len, errors)) < 21_000
    with Runs.existing(tmp_path) as runs:
        assert runs.damage() is None
        assert len(runs) == 2


MAKER = """
import pathlib, sys
from swarm_logistics_env.study.runs.rows import COUNTED
from swarm_logistics_env.study.runs.store import Runs

for line in sys.stdin:
    with Runs(pathlib.Path(line.strip())) as runs:
        runs.note(sys.argv[1], "here")
    print("made", flush=True)
"""


def test_a_ctrl_c_at_the_start_of_a_transaction_lets_the_store_close(tmp_path: Path) -> None:
    """Where it comes before the block's first line, Python ends the transaction after the store."""
    runs = Runs(tmp_path / FILE_NAME)
    begun = runs._transaction()
    begun.__enter__()
    runs.close()
    del begun  # an error in it would be printed, which fails every test here
    with Runs(tmp_path / FILE_NAME) as reopened:
        reopened.note("name", "written")


@pytest.mark.daily
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


def test_a_store_waits_for_whoever_makes_it_but_not_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / FILE_NAME
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("BEGIN IMMEDIATE")
        with monkeypatch.context() as patch:
            patch.setattr(store, "TIMEOUT", -1.0)
            with pytest.raises(StudyError, match=rf"use the store {path}: database is locked"):
                Runs(path)
        monkeypatch.setattr("time.sleep", lambda _: database.rollback())
        with Runs(path) as runs:
            assert len(runs) == 0


def test_a_new_store_is_there_once_it_is_whole_and_never_in_part(tmp_path: Path) -> None:
    out = tmp_path / "new"
    with pytest.raises(StudyError, match="no study in"):
        Runs.existing(tmp_path)

    def made(*, stopped: bool) -> None:
        with Runs.new(out, "merge") as runs:
            runs.note("name", "value")
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
