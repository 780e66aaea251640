"""Shards: equal parts of a study for machines that share no files, and merging their stores."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Self

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies import metadata
from swarm_logistics_env.studies.runs import Run
from swarm_logistics_env.studies.store import FILE_NAME, Store, new_store, refuse_study_in
from swarm_logistics_env.tasks.task_choice import DEFAULT


@dataclass(frozen=True)
class Shard:
    """Part `number` of `count`, counted from 1.

    Raises:
        StudyError: there is no such part.
    """

    number: int
    count: int

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise StudyError(f"shard {self}: should be i/n with i from 1 to n")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the shard that "i/n" means."""
        match = re.fullmatch(r"(\d+)/(\d+)", text)
        if match is None:
            raise StudyError(f"shard {text}: should be i/n, e.g. 2/8")
        return cls(int(match[1]), int(match[2]))

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    @property
    def directory(self) -> str:
        """Name of the directory of its store: shards on one disk never share a file."""
        return f"shard-{self.number}-of-{self.count}"

    def of(self, runs: Iterable[Run]) -> Iterator[Run]:
        """Yield every n-th run from the i-th on."""
        # Count all runs, not the missing ones, so that a shard depends on nothing but the plan.
        return islice(runs, self.number - 1, None, self.count)


def merge(directories: Sequence[Path], out: Path) -> int:
    """Write the runs of several stores into a new one; return how many runs it holds.

    The studies must be one but for their seeds and their policies, of which the merged one has
    all. A run that failed in one store and succeeded in another succeeded. Only the seeds that
    every study declared count as declared, so verdicts over more of them are exploratory.

    Args:
        directories: of the studies.
        out: directory of the merged one; it may hold theirs, but no study of its own.

    Raises:
        StudyError: a store cannot be read, the studies differ, seeds lie between theirs that none
            has, two stores have different results of one run, or `out` holds a study.
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
        if store.note(metadata.IMPORTED) is not None:
            raise StudyError(f"{directory} was imported: only studies that were run are merged")
        return metadata.planned(store, directory)


def _united(planned: dict[Path, dict[str, str]]) -> dict[str, str]:
    # Sort by seeds, so that each study joins the seeds of those before it.
    first, *others = sorted(planned, key=lambda directory: _seeds(planned[directory]).start)
    united = dict(planned[first])
    for other in others:
        theirs = planned[other]
        if theirs[metadata.CODE] != united[metadata.CODE]:
            raise StudyError(
                f"{first} was played under code version {united[metadata.CODE]}, {other} under "
                f"{theirs[metadata.CODE]}: a verdict never mixes two versions"
            )
        if theirs.get(metadata.DECLARED_LOOKS) != united.get(metadata.DECLARED_LOOKS):
            raise StudyError(f"{first} and {other} declared different looks")
        united[metadata.SPECIFICATION] = _specification(united, theirs, first, other)
        united[metadata.IDENTITIES] = _identities(united, theirs, first, other)
        declared = _declared(united, theirs)
        united[metadata.DECLARED_FIRST_SEED] = str(declared.start)
        united[metadata.DECLARED_SEEDS] = str(len(declared))
    return united


def _seeds(planned: dict[str, str]) -> range:
    fields = _fields(planned)
    return range(fields["first_seed"], fields["first_seed"] + fields["seeds"])


def _fields(planned: dict[str, str]) -> dict[str, Any]:
    # Older stores know neither of the two.
    return {"first_seed": 0, "task": DEFAULT, **json.loads(planned[metadata.SPECIFICATION])}


def _declared(ours: dict[str, str], theirs: dict[str, str]) -> range:
    mine, yours = (
        range(first, first + int(one[metadata.DECLARED_SEEDS]))
        for one in (ours, theirs)
        for first in [int(one.get(metadata.DECLARED_FIRST_SEED, 0))]
    )
    both = range(max(mine.start, yours.start), min(mine.stop, yours.stop))
    # Without a common seed any part will do: nobody declared the whole.
    return both or mine


def _specification(ours: dict[str, str], theirs: dict[str, str], first: Path, other: Path) -> str:
    mine, yours = _fields(ours), _fields(theirs)
    free = ("first_seed", "seeds", "policies")
    names = [name for name in {**mine, **yours} if name not in free]
    differing = [name for name in names if mine.get(name) != yours.get(name)]
    if differing:
        raise StudyError(f"{first} and {other} differ in {', '.join(differing)}: not one study")
    seeds, further = _seeds(ours), _seeds(theirs)
    if further.start > seeds.stop:
        raise StudyError(
            f"{other} has the seeds from {further.start} on, the studies before it end with seed "
            f"{seeds.stop - 1}: seeds lie between them that no study has, and to judge them as "
            "one study each seed is needed"
        )
    mine["seeds"] = max(seeds.stop, further.stop) - seeds.start
    mine["policies"] += [policy for policy in yours["policies"] if policy not in mine["policies"]]
    return json.dumps(mine)


def _identities(ours: dict[str, str], theirs: dict[str, str], first: Path, other: Path) -> str:
    mine: dict[str, Any] = json.loads(ours[metadata.IDENTITIES])
    yours: dict[str, Any] = json.loads(theirs[metadata.IDENTITIES])
    for part in mine.keys() & yours.keys():
        if mine[part] != yours[part]:
            raise StudyError(f"the {part} of {first} is not the one of {other}: its code differs")
    return json.dumps({**mine, **yours})
