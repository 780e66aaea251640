from __future__ import annotations

from pathlib import Path

import pytest

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.new_store import new_store, refuse_study_in
from swarm_logistics_env.studies.store import FILE_NAME, Store


def test_store_is_there_once_it_is_whole(tmp_path: Path) -> None:
    with new_store(tmp_path / "new") as store:
        store.set_note("name", "value")
        refuse_study_in(tmp_path / "new", "merge")
    with Store.existing(tmp_path / "new") as store:
        assert store.note("name") == "value"
    assert [path.name for path in (tmp_path / "new").iterdir()] == [FILE_NAME]
    with pytest.raises(StudyError, match="holds a study already: merge into a new directory"):
        refuse_study_in(tmp_path / "new", "merge")


def test_failure_leaves_nothing(tmp_path: Path) -> None:
    def stopped() -> None:
        with new_store(tmp_path) as store:
            store.set_note("name", "value")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert list(tmp_path.iterdir()) == []


def test_directory_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(StudyError, match=f"cannot write to {file / 'in'}"), new_store(file / "in"):
        pass
