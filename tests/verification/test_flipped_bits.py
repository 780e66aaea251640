"""Files of ours with a bit flipped: what is read is what was written, or the damage is told."""

from __future__ import annotations

import random
import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from swarm_logistics_env import policies
from swarm_logistics_env.core.errors import PolicyError, StudyError, TrainingError
from swarm_logistics_env.policies.catalogue import WEIGHTS
from swarm_logistics_env.policies.files import read_policy
from swarm_logistics_env.study.runs.store import FILE_NAME, Runs
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.views.cli import app
from tests.made_up import made_old

FLIPS = max(40, settings().max_examples // 10)  # 200 at night


def flipped(data: bytes, first: int = 0) -> Iterator[bytes]:
    """Yield the content with one bit flipped, at places that are the same every time.

    Args:
        first: the byte from which on most of them lie; the others lie anywhere.
    """
    source = random.Random(51)
    for number in range(FLIPS):
        at = source.randrange(first if number % 4 else 0, len(data))
        yield (data[:at] + bytes([data[at] ^ (1 << source.randrange(8))]) + data[at + 1 :])


@pytest.mark.parametrize("part", ["header", "numbers"])
def test_a_policy_file_with_a_flipped_bit_is_refused_or_the_same(part: str, tmp_path: Path) -> None:
    file = WEIGHTS / "ppo-robust.safetensors"
    valid, sound = file.read_bytes(), read_policy(file)
    end = 8 + int.from_bytes(valid[:8], "little")
    path, refused = tmp_path / "mine.safetensors", 0
    changed, rest = (valid[:end], valid[end:]) if part == "header" else (valid, b"")
    for content in flipped(changed, 0 if part == "header" else end):
        path.write_bytes(content + rest)
        problem = None
        try:
            policy: Any = policies.load(str(path))
        except PolicyError as error:
            problem = str(error)
        if problem is None:
            assert policy.card == sound.card
            assert policies.identity(policy) == policies.identity(sound)
        else:
            assert str(path) in problem
            assert len(problem.splitlines()) == 1
            refused += 1
    assert refused > 0.9 * FLIPS


def test_a_checkpoint_with_a_flipped_bit_is_refused_before_it_is_unpickled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("stable_baselines3")
    from swarm_logistics_env.train import Training, learner
    from swarm_logistics_env.train.training_worlds import NetworkView

    fields: dict[str, Any] = {
        "worlds": [{"n_robots": 2}],
        "network": {"hidden": (4,)},
        "scenario": {"n_items": 2},
        "threads": 1,
    }
    training = Training(**fields)
    trained = learner.make_learner(NetworkView(training), training.network, training.ppo, 0, "cpu")
    trained.env.reset()
    learner.save_checkpoint(tmp_path, trained, log={})
    path = tmp_path / learner.CHECKPOINT
    valid, unpickled = path.read_bytes(), []
    assert learner.read_checkpoint(tmp_path) is not None
    monkeypatch.setattr("torch.load", lambda *_, **__: unpickled.append(1))
    for content in (*flipped(valid), *flipped(valid[:100]), valid[:-1], b"", valid + b"x"):
        path.write_bytes(content)
        with pytest.raises(TrainingError, match=r"checkpoint.pt is damaged .*begin anew"):
            learner.read_checkpoint(tmp_path)
    assert not unpickled


Content = dict[str, Any]


def content_of(store: Runs) -> Content:
    return {str(row["run"]): row for row in store.frame().to_dict("records")}


@pytest.mark.parametrize("old", [False, True], ids=["with digests", "of version 0.3.0"])
def test_a_store_with_a_flipped_bit_is_refused_or_the_same_but_for_rows_that_are_told(
    played: Path, tmp_path: Path, old: bool
) -> None:
    path, seen = tmp_path / FILE_NAME, Counter[str]()
    path.write_bytes((played / FILE_NAME).read_bytes())
    with Runs.existing(tmp_path) as store:
        sound, notes = content_of(store), store.notes()
    if old:
        made_old(path)
    valid = path.read_bytes()
    for content in flipped(valid):
        path.write_bytes(content)
        try:
            with Runs.existing(tmp_path) as store:
                rows, damage = content_of(store), store.damage()
                assert len(store) == len(sound)
                if not old:
                    assert store.notes() == notes
        except StudyError as error:
            problem = str(error)
        else:
            problem = damage or ""
            if not old:
                assert all(sound[key] == row for key, row in rows.items())
            assert (len(rows) < len(sound)) == bool(damage)
            seen["rows" if damage else "same"] += 1
        assert not problem or str(path) in problem
        assert len(problem.splitlines()) <= 1
    assert old or seen["rows"] > 0.5 * FLIPS


def test_a_damaged_run_is_told_everywhere_and_played_again(
    small: dict[str, Any], played: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / FILE_NAME
    path.write_bytes((played / FILE_NAME).read_bytes())
    with Runs.existing(tmp_path) as store:
        sound = content_of(store)
    first, second = sorted(sound)[:2]
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("UPDATE runs SET outcome = '{}' WHERE key = ?", (first,))
        database.execute("UPDATE runs SET run = '{}' WHERE key = ?", (second,))
        database.execute("UPDATE runs SET key = 'x' WHERE key = ?", (second,))
    warning = f"2 runs of {path} are damaged and left out ({first[:12]}, x)"
    out, to = str(tmp_path), tmp_path / "rows.csv"
    assert app.run(["study", "export", out, "--to", str(to)]) == 1
    assert warning in capsys.readouterr().err
    assert len(to.read_text().splitlines()) == len(sound) - 1
    for words in (["report", out], ["plan", out], ["compare", out, str(played)]):
        assert app.run(["study", *words]) == 0
        # A terminal folds a long path at its hyphens.
        assert "".join(warning.split()) in "".join(capsys.readouterr().out.split())
    assert warning in (tmp_path / "report.md").read_text()
    assert app.run(["study", "merge", out, "--out", str(tmp_path / "merged")]) == 0
    assert warning in capsys.readouterr().err
    study = Study(out=tmp_path, **small)
    with pytest.warns(UserWarning, match="2 runs of"):
        assert len(study.results()) == len(sound) - 2
    tally = study.run()
    assert (tally.played, tally.kept, tally.changes) == (2, len(sound) - 2, (warning,))
    with Runs.existing(tmp_path) as store:
        assert (content_of(store), store.damage()) == (sound, None)


def test_an_unknown_or_missing_field_of_an_old_store_is_damage_and_never_no_delivery(
    played: Path, tmp_path: Path
) -> None:
    path = tmp_path / FILE_NAME
    path.write_bytes((played / FILE_NAME).read_bytes())
    made_old(path)
    with Runs.existing(tmp_path) as store:
        sound = content_of(store)
        keys = sorted(sound)
    changes = (
        ("outcome", '"delivery_times"', '"delivery_timer"'),
        ("outcome", '"digest":', '"digesu":'),
        ("outcome", ',"untimed":null', ""),
        ("run", '"scenario"', '"scenarin"'),
        ("failed", "0", "1"),
    )
    with closing(sqlite3.connect(path)) as database, database:
        for key, (column, before, after) in zip(keys, changes, strict=False):
            change = f"UPDATE runs SET {column} = replace({column}, ?, ?) WHERE key = ?"
            database.execute(change, (before, after, key))
    unread = path.read_bytes()
    for reading in (True, False):  # and with digests, after it was opened to write
        with Runs(path, read_only=reading) as store:
            rest = {key: sound[key] for key in keys[len(changes) :]}
            assert content_of(store) == rest
            assert f"{len(changes)} runs of" in (store.damage() or "")
        assert (path.read_bytes() == unread) == reading
