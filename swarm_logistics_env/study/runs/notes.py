"""Notes: what a store says of its study besides the runs, and one study merged of several."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Self

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import to_json

from swarm_logistics_env.core.errors import StudyError
from swarm_logistics_env.core.fingerprint import UNSTABLE, changes
from swarm_logistics_env.study.questions.declaration import Declaration
from swarm_logistics_env.study.questions.plan import Origin, Plan
from swarm_logistics_env.study.questions.specification import Specification

from .store import Runs

NOTE = "study"


class StoredSpecification(BaseModel):
    """What a stored specification says before its task is known, and the fields that it holds."""

    model_config = ConfigDict(extra="allow", frozen=True)

    name: str
    task: str

    def differing(self, specification: Specification) -> list[str]:
        """Return which fields of what is asked are not those that were declared.

        How far it is played, and how it is judged, may change: `Declaration` tells whether verdicts
        are exploratory then, and `StudyResults.late_margin` whether equivalence is.
        """
        free = {"seeds", "first_seed", "until_clear", "margin", "performance", "reference"}
        new = specification.model_dump(mode="json", exclude=free)
        if new["task"] != self.task:
            return ["task"]  # whose scenarios have other fields
        declared = Specification(**{**self.model_dump(), "task": specification.task})
        stored = declared.model_dump(mode="json", exclude=free)
        return [name for name in new if new[name] != stored[name]]


class StoredStudy(BaseModel):
    """What a store notes of its study.

    Attributes:
        specification: what the study asks.
        code: version of the code that plays it.
        identities: of the policies, by their names in the specification.
        declared: what was declared before the first run.
        imported: the source of imported results; None: the runs were played.
    """

    model_config = ConfigDict(frozen=True)

    specification: StoredSpecification
    code: str
    identities: dict[str, str]
    declared: Declaration
    imported: Origin | None = None

    @classmethod
    def of(cls, runs: Runs) -> Self | None:
        """Return what a store notes; None: nothing yet.

        Raises:
            StudyError: it does not read.
        """
        note = runs.notes().get(NOTE)
        try:
            return None if note is None else cls.model_validate_json(note, strict=True)
        except ValidationError:
            raise StudyError(f"the store {runs.path} is damaged: its note does not read") from None

    @classmethod
    def existing(cls, directory: Path) -> Self:
        """Return what the store of a study that was run or imported notes.

        Raises:
            StudyError: there is none, it notes nothing, or the note does not read.
        """
        with Runs.existing(directory) as runs:
            stored = cls.of(runs)
        if stored is None:
            raise StudyError(
                f"the store in {directory} does not note its study: run the study once more there "
                "(finished runs are kept), then it will"
            )
        return stored

    def changes(self, plan: Plan) -> Iterator[str]:
        """Yield sentences on why stored runs are not those of a plan."""
        if self.code != plan.code:
            yield f"the code of the task {self.specification.task} changed"
        for part, before in self.identities.items():
            now = plan.identities.get(part, before)
            if UNSTABLE in now:
                yield f"{part} is another one each time it is made; an `identity` would name it"
            elif change := changes(before, now):
                yield f"{part}: {change}"


def note(runs: Runs, plan: Plan, declared: Declaration) -> None:
    """Note a study in its store, for `StoredStudy.of`."""
    content = {
        "specification": plan.specification,
        "code": plan.code,
        "identities": plan.identities,
        "declared": declared,
        "imported": plan.origin,
    }
    runs.note(NOTE, to_json(content).decode())


def merge(directories: Sequence[Path], out: Path) -> int:
    """Write the runs of one study's shards into a new store; return how many runs it holds.

    A run that failed in one store and succeeded in another succeeded. Damaged ones are left out.

    Args:
        directories: of the stores.
        out: directory of the merged one; it may hold theirs, but no study of its own.

    Raises:
        StudyError: a store cannot be read, they are not of one study, two of them have different
            results of one run, or `out` holds a study.
    """
    stored = {directory: StoredStudy.existing(directory) for directory in directories}
    first, study = next(iter(stored.items()))
    for directory, other in stored.items():
        if other.imported is not None:
            raise StudyError(f"{directory} was imported: only studies that were run are merged")
        if other != study:
            raise StudyError(f"{first} and {directory} differ: should be shards of one study")
    with Runs.new(out, "merge") as runs:
        for directory in directories:
            with Runs.existing(directory) as shard:
                runs.absorb(shard)
        runs.note(NOTE, study.model_dump_json())
        return len(runs)
