"""Notes: what a store says of its study besides the runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.records import Record

if TYPE_CHECKING:
    from swarm_logistics_env.studies.store import Store

SPECIFICATION = "specification"  # JSON
CODE = "code"  # version
IDENTITIES = "identities"  # of policies, JSON
DECLARED_SEEDS = "declared_seeds"  # how many, at the first run
DECLARED_FIRST_SEED = "declared_first_seed"  # at the first run; absent: 0
DECLARED_LOOKS = "declared_looks"  # JSON, at the first run
IMPORTED = "imported"  # where the runs came from; absent: they were run

_NEEDED = (SPECIFICATION, CODE, IDENTITIES, DECLARED_SEEDS)


# Written with digits alone, as int() reads it.
_Count = Annotated[int, Field(gt=0, strict=True)]
_Seed = Annotated[int, Field(ge=0, strict=True)]


class _Origin(Record):
    file: str
    digest: str
    paired: bool
    seeds: tuple[int, ...] = ()


# What is read as JSON; the specification says itself what is wrong with it.
_FORMS: dict[str, TypeAdapter[Any]] = {
    IDENTITIES: TypeAdapter(dict[str, str]),
    DECLARED_SEEDS: TypeAdapter(_Count),
    DECLARED_FIRST_SEED: TypeAdapter(_Seed),
    DECLARED_LOOKS: TypeAdapter(tuple[_Count, ...]),
    IMPORTED: TypeAdapter(_Origin),
}


def reads(name: str, value: object) -> bool:
    """Return whether a store's note is of the form that it should have."""
    if not isinstance(value, str):
        return False
    try:
        if name in _FORMS:
            _FORMS[name].validate_json(value)
    except ValidationError:
        return False
    return True


def planned(store: Store, directory: Path) -> dict[str, str]:
    """Return the notes from which the plan of a stored study follows.

    Raises:
        StudyError: one is missing.
    """
    found = {name: store.note(name) for name in (*_NEEDED, DECLARED_FIRST_SEED, DECLARED_LOOKS)}
    for name in _NEEDED:
        if found[name] is None:
            raise StudyError(
                f"the store in {directory} does not note its {name}: run the study once more "
                "there (finished runs are kept), then it will"
            )
    return {name: value for name, value in found.items() if value is not None}
