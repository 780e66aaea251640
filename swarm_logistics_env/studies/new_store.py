"""A store that is written at one go: whole, or not there."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.store import FILE_NAME, Store


def refuse_study_in(out: Path, way: str) -> None:
    """Raise StudyError if `out` holds a study; `way`, e.g. "merge", says what was to be done."""
    if (out / FILE_NAME).exists():
        raise StudyError(f"{out} holds a study already: {way} into a new directory")


@contextmanager
def new_store(out: Path) -> Iterator[Store]:
    """Yield an empty store; what was written into it is that of `out` once the block ends well.

    Killed or failed before, it leaves nothing that looks like a store.

    Raises:
        StudyError: `out` cannot be written.
    """
    unfinished = out / f"{FILE_NAME}.unfinished"
    try:
        out.mkdir(parents=True, exist_ok=True)
        unfinished.unlink(missing_ok=True)
    except OSError as error:
        raise StudyError(f"cannot write to {out}: {error.strerror}") from error
    try:
        with Store(unfinished) as store:
            yield store
        unfinished.rename(out / FILE_NAME)
    finally:
        for left in out.glob(f"{unfinished.name}*"):
            left.unlink()
