"""Merging: one store from those of shards or machines that played parts of one study."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import notes
from swarm_logistics_env.studies.new_store import new_store, refuse_study_in
from swarm_logistics_env.studies.specification import Specification
from swarm_logistics_env.studies.store import FILE_NAME, Store


def merge(directories: Sequence[Path], out: Path) -> int:
    """Write the runs of several stores into a new one; return how many runs it holds.

    The studies must be one but for their seeds, of which the merged one has the most, and their
    policies, of which it has all. A run that failed in one store and succeeded in another
    succeeded.

    Args:
        directories: of the studies.
        out: directory of the merged one; it may hold theirs, but no study of its own.

    Raises:
        StudyError: a store cannot be read, the studies differ, two stores have different results
            of one run, or `out` holds a study.
    """
    refuse_study_in(out, "merge")
    planned = {directory: _notes(directory) for directory in directories}
    merged = _united(planned)
    with new_store(out) as store:
        for directory in directories:
            store.absorb(directory / FILE_NAME)
        for name, value in merged.items():
            store.set_note(name, value)
        return len(store)


def _notes(directory: Path) -> dict[str, str]:
    with Store.existing(directory) as store:
        if store.note(notes.IMPORTED) is not None:
            raise StudyError(f"{directory} was imported: only studies that were run are merged")
        return notes.planned(store, directory)


def _united(planned: dict[Path, dict[str, str]]) -> dict[str, str]:
    first, *others = planned
    united = dict(planned[first])
    for other in others:
        theirs = planned[other]
        if theirs[notes.CODE] != united[notes.CODE]:
            raise StudyError(
                f"{first} was played under code version {united[notes.CODE]}, {other} under "
                f"{theirs[notes.CODE]}: a verdict never mixes two versions"
            )
        if theirs.get(notes.DECLARED_LOOKS) != united.get(notes.DECLARED_LOOKS):
            raise StudyError(f"{first} and {other} declared different looks")
        united[notes.SPECIFICATION] = _specification(united, theirs, first, other)
        united[notes.IDENTITIES] = _identities(united, theirs, first, other)
        united[notes.DECLARED_SEEDS] = str(
            min(int(united[notes.DECLARED_SEEDS]), int(theirs[notes.DECLARED_SEEDS]))
        )
    return united


def _specification(ours: dict[str, str], theirs: dict[str, str], first: Path, other: Path) -> str:
    mine, yours = (
        Specification.from_json(one[notes.SPECIFICATION]).model_dump(mode="json")
        for one in (ours, theirs)
    )
    free = ("seeds", "policies")
    differing = [name for name in mine if name not in free and mine[name] != yours[name]]
    if differing:
        raise StudyError(f"{first} and {other} differ in {', '.join(differing)}: not one study")
    mine["seeds"] = max(mine["seeds"], yours["seeds"])
    mine["policies"] += [policy for policy in yours["policies"] if policy not in mine["policies"]]
    return Specification(**mine).to_json()


def _identities(ours: dict[str, str], theirs: dict[str, str], first: Path, other: Path) -> str:
    mine: dict[str, Any] = json.loads(ours[notes.IDENTITIES])
    yours: dict[str, Any] = json.loads(theirs[notes.IDENTITIES])
    for part in mine.keys() & yours.keys():
        if mine[part] != yours[part]:
            raise StudyError(f"the {part} of {first} is not the one of {other}: its code differs")
    return json.dumps({**mine, **yours})
