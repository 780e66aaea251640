"""Files that others made: read or refused in one sentence, never run; nothing else is written."""

from __future__ import annotations

import contextlib
import csv
import functools
import json
import random
import sqlite3
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_logistics_env import policies
from swarm_logistics_env.core.errors import SwarmLogisticsError
from swarm_logistics_env.policies.catalogue import WEIGHTS
from swarm_logistics_env.study.runs.notes import NOTE, merge
from swarm_logistics_env.study.runs.recorded import RecordedStudy
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs, export
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.study.trials import read_trials
from swarm_logistics_env.study.verdicts.cell import Cell
from swarm_logistics_env.views.cli import app
from swarm_logistics_env.world.observations import N_COLUMNS
from tests.conftest import SMALL
from tests.made_up import alter, made_old

STUDY = """\
policies = ["swarm-dt", "random-walk"]
seeds = 3
indicators = ["S", "FT", "R", "A"]
scenario = { preset = "paper", n_robots = 4, n_items = 8, duration = 20.0 }
sizes = [{ title = "Sizes", values = [2, 4], superlinear = [[2, 4]] }]
parameters = [{ name = "delivery_width", values = [2.0, 1.0] }]
ablations = [{ policy = "random-walk", fall = 0.1 }]

[[faults]]
modes = ["FM1", "FM4"]
robots = [1, 2]
onsets = [0.0, 5.0]
duration = 3.0
"""
TABLE = """\
table,fault,faulty,robots,delivery_width,seed,delivered
II,none,0,25,2,0,40
II,removed,1,25,2,0,38
II,FM1,1,25,2,0,30
I,none,0,5,2,0,9
III,none,0,25,1,0,10
"""
WIDE = """\
Versuch;Roboter;Fehler;Defekt;Geliefert;Breite
1;8;keine;;12,5;2
2;8;Radbruch;1;10,5;2
3;8;entfernt;1;11;2
4;4;keine;;9,5;1,5
"""
EVENTS = """\
trial,robots,fault,faulty,onset,duration,seed,time
a,8,none,,,60,1,10.5
a,8,none,,,60,1,30
b,8,jam,2,20,60,1,40
c,8,removed,2,20,60,1,
"""
SPICES = [
    "1e999", "-1", "0", "nan", "inf", "99999999999999999999", "''", "[]", "{}", "true", '"', "\0",
    "\n", ",", "=", "[[", "../../x", "1.5", "2026-01-01", "é", "\ufeff", "os:abort", "a" * 200_000,
    "{" * 500, "[" * 5000,
]  # fmt: skip
examples = settings(max_examples=max(40, settings().max_examples // 3))
store_examples = settings(max_examples=max(25, settings().max_examples // 8))


def mangled(source: random.Random, content: bytes) -> bytes:
    """Return the content with some bytes changed, cut out, doubled, or strange text put in."""
    for _ in range(source.randint(1, 4)):
        start = source.randint(0, len(content))
        stop = min(len(content), start + source.choice([0, 1, 1, 2, 5, 30, 3000]))
        put = [b"", source.choice(SPICES).encode(), source.randbytes(stop - start)]
        put += [content[start:stop] * 2, content[: stop - start]]
        content = content[:start] + source.choice(put) + content[stop:]
    return content if source.random() < 0.9 else content[: source.randint(0, len(content))]


def refused_or_done(call: Callable[[], object]) -> None:
    sentences: Sequence[str] = ()
    try:
        call()
    except SwarmLogisticsError as error:
        sentences = error.lines or [str(error)]
    for sentence in sentences:
        assert len(sentence) > 15, sentence
        assert len(sentence.splitlines()) == 1, sentence


def listing(directory: str | Path) -> set[str]:
    return {path.relative_to(directory).as_posix() for path in Path(directory).rglob("*")}


@given(st.randoms(use_true_random=False))
@examples
def test_any_study_file_is_planned_or_refused(source: random.Random) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mine.toml"
        path.write_bytes(mangled(source, STUDY.encode()))
        refused_or_done(lambda: Study.from_file(path).plan())
        assert listing(folder) == {"mine.toml"}


CANARY = "import pathlib\npathlib.Path('it-was-run').touch()\nclass Bird:\n    pass\n"


@pytest.mark.parametrize("field", ["policies=['canary:B']", "[[ablations]]\npolicy='canary:B'"])
def test_a_study_file_runs_no_code_unless_it_is_allowed_to(
    field: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    Path("canary.py").write_text(CANARY)
    Path("mine.toml").write_text(f"seeds = 1\n{field}\n")
    for words in ("plan mine.toml", "run mine.toml --out out"):
        assert app.run(["study", *words.split()]) == 2
        (sentence,) = capsys.readouterr().err.splitlines()
        assert "canary:B" in sentence
        assert "--trust-code" in sentence
        assert listing(tmp_path) == {"canary.py", "mine.toml"}
    assert app.run(["study", "plan", "mine.toml", "--trust-code"]) == 2  # there is no policy B
    assert Path("it-was-run").exists()


@given(st.randoms(use_true_random=False), st.sampled_from([TABLE, WIDE, EVENTS]))
@examples
def test_any_table_is_imported_or_refused(source: random.Random, table: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / "mine.csv", Path(folder) / "out"
        path.write_bytes(mangled(source, table.encode()))
        refused_or_done(lambda: RecordedStudy.of(read_trials(path)).keep(out))
        assert listing(folder) <= {"mine.csv", "out", f"out/{FILE_NAME}"}
        if out.exists():
            refused_or_done(lambda: Study.stored(out).findings())
            header, *rows = csv.reader(path.read_text(encoding="utf-8-sig").splitlines())
            if table == TABLE and header == table.splitlines()[0].split(","):
                # What is kept is each row's number, as plain CSV reads it: nothing is guessed.
                with Runs.existing(out) as store:
                    stored = sorted(store.frame()["delivered"])
                index = header.index("delivered")
                assert stored == sorted(float(row[index]) for row in rows if any(row))


@pytest.fixture(scope="module")
def judged_store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directory of a study of every indicator in few runs, which takes little time to judge."""
    directory = tmp_path_factory.mktemp("judged")
    few = {"sizes": [{"values": [2, 4]}], "faults": [{"modes": ["FM4"], "robots": [1]}]}
    assert Study(out=directory, **{**SMALL, **few, "ablations": []}).run().failed == 0
    return directory


def check_spoilt(original: Path, spoil: Callable[[Path], object]) -> None:
    """Read a copy of the study's store that was spoilt in every way; it stays where it is."""

    def exported(out: Path) -> None:
        with Runs.existing(out) as store:
            export(store, out / "rows.csv")

    with tempfile.TemporaryDirectory() as folder:
        out, store = Path(folder) / "out", Path(folder) / "out" / FILE_NAME
        out.mkdir()
        store.write_bytes((original / FILE_NAME).read_bytes())
        spoil(store)
        refused_or_done(lambda: assert_same_or_missing(original, out))
        refused_or_done(lambda: exported(out))
        refused_or_done(lambda: merge([out], out / "merged"))
        ends = ("", "-wal", "-shm", "-journal")
        allowed = {"rows.csv", "merged", *(f"{FILE_NAME}{end}" for end in ends)}
        assert {path.name for path in out.iterdir()} <= allowed
        assert [path.name for path in Path(folder).iterdir()] == ["out"]


@functools.cache
def cells_of(original: Path) -> Sequence[Cell]:
    """Return what the runs of a study say that nobody spoilt."""
    return Study.stored(original).findings().cells


def assert_same_or_missing(original: Path, out: Path) -> None:
    """P of a damaged store is that of the whole one, seed by seed, or is told to be missing."""
    damaged, sound = Study.stored(out).findings().cells, cells_of(original)
    if [cell.words for cell in damaged] == [cell.words for cell in sound]:  # not another study
        for damaged_cell, sound_cell in zip(damaged, sound, strict=True):
            if damaged_cell.n_seeds == sound_cell.n_seeds:
                assert list(damaged_cell.by_seed) == list(sound_cell.by_seed)


@given(source=st.randoms(use_true_random=False))
@store_examples
def test_any_store_is_read_or_refused(judged_store: Path, source: random.Random) -> None:
    check_spoilt(judged_store, lambda store: store.write_bytes(mangled(source, store.read_bytes())))


COLUMNS = ["key", "run", "failed", "outcome", "wall_seconds"]
VALUES = [None, "x", "{", "[1, 2", -1, 1e300, b"\x01", b"\xff" * 16, "[]", "null", 2**62, "'"]
NOTES = ["", "x", "null", "{}", "[]", "-1", '{"a": 1}', "[[1]]", "1e9", b"\xff", None]


@given(
    column=st.sampled_from(COLUMNS),
    value=st.sampled_from(VALUES),
    index=st.integers(0, 7),
    source=st.randoms(use_true_random=False),
)
@store_examples
def test_a_store_of_wrong_contents_is_read_or_refused(
    judged_store: Path, column: str, value: Any, index: int, source: random.Random
) -> None:
    def spoil(store: Path) -> None:
        with contextlib.closing(sqlite3.connect(store)) as database, database:
            keys = [key for (key,) in database.execute("SELECT key FROM runs ORDER BY key")]
            change = f"UPDATE OR IGNORE runs SET {column} = ? WHERE key = ?"
            database.execute(change, (value, keys[index]))
        if source.random() < 0.5:  # in a store that has no digests
            made_old(store)

    check_spoilt(judged_store, spoil)


@given(
    name=st.sampled_from(["", "specification", "code", "identities", "declared", "imported"]),
    value=st.sampled_from(NOTES),
    source=st.randoms(use_true_random=False),
)
@store_examples
def test_a_store_of_wrong_notes_is_read_or_refused(
    judged_store: Path, name: str, value: str | bytes | None, source: random.Random
) -> None:
    def spoil(store: Path) -> None:
        with contextlib.closing(sqlite3.connect(store)) as database, database:
            ((note,),) = database.execute("SELECT value FROM notes")
            database.execute("DELETE FROM notes")
            spoilt_note: Any = value
            if name:
                text = value.decode("latin-1") if isinstance(value, bytes) else value
                spoilt_note = json.dumps({**json.loads(note), name: text})
            if spoilt_note is not None:
                database.execute("INSERT INTO notes VALUES (?, ?, '')", (NOTE, spoilt_note))
        if source.random() < 0.5:  # as if that had been written
            alter(store, "DELETE FROM notes WHERE value IS NULL")

    check_spoilt(judged_store, spoil)


# A file that carries a pickle is refused unread, see tests/policies/test_files.py.
@given(source=st.randoms(use_true_random=False))
def test_any_policy_file_is_refused_or_plays(source: random.Random) -> None:
    original = (WEIGHTS / "ppo-delivery.safetensors").read_bytes()
    # Mostly where the header is, whose length the first eight bytes tell.
    end = 8 + int.from_bytes(original[:8], "little") if source.random() < 0.8 else len(original)

    def play(path: Path) -> None:
        policy = policies.load(str(path))
        policy.reset(2, 0)
        assert policy.act(np.ones((2, N_COLUMNS), np.float32)).shape == (2, 4)

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mine.safetensors"
        path.write_bytes(mangled(source, original[:end]) + original[end:])
        refused_or_done(lambda: play(path))
        assert listing(folder) == {path.name}
