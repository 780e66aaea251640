"""Shards: equal parts of a study for machines that share no files, and merging their stores."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any, Self

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.metadata import Metadata, StoredSpecification, rows_of
from swarm_logistics_env.studies.runs import Run
from swarm_logistics_env.studies.store import FILE_NAME, Store, new_store, refuse_study_in


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
    stored = {directory: _played(directory) for directory in directories}
    merged = _united(stored)
    with new_store(out) as store:
        for directory in directories:
            store.absorb(directory / FILE_NAME)
        store.note(merged)
        return len(store)


def _played(directory: Path) -> Metadata:
    with Store.existing(directory) as store:
        found = store.needed_metadata()
    if found.imported is not None:
        raise StudyError(f"{directory} was imported: only studies that were run are merged")
    return found


def _united(stored: dict[Path, Metadata]) -> dict[str, str]:
    """Return the metadata of studies as that of one."""
    # Sort by seeds, so that each study joins the seeds of those before it.
    first, *others = sorted(
        stored, key=lambda directory: stored[directory].specification.first_seed
    )
    one = stored[first]
    fields, identities, declared = one.specification.model_dump(), one.identities, one.declared
    for directory in others:
        other = stored[directory]
        if other.code != one.code:
            raise StudyError(
                f"{first} was played under code version {one.code}, {directory} under "
                f"{other.code}: a verdict never mixes two versions"
            )
        for name in ("looks", "margin"):
            if getattr(other.declared, name) != getattr(declared, name):
                raise StudyError(f"{first} and {directory} declared different {name}")
        fields = _joined(fields, other.specification, first, directory)
        for part in identities.keys() & other.identities.keys():
            if identities[part] != other.identities[part]:
                raise StudyError(
                    f"the {part} of {first} is not the one of {directory}: its code differs"
                )
        identities = {**identities, **other.identities}
        mine, theirs = declared.seeds, other.declared.seeds
        both = range(max(mine.start, theirs.start), min(mine.stop, theirs.stop))
        # Without a common seed any part will do: nobody declared the whole.
        declared = replace(declared, seeds=both or mine)
    return rows_of(fields, one.code, identities, declared)


def _joined(
    fields: dict[str, Any], other: StoredSpecification, first: Path, directory: Path
) -> dict[str, Any]:
    """Return the fields of a specification, with the seeds and the policies of another as well."""
    theirs = other.model_dump()
    free = ("first_seed", "seeds", "policies")
    names = [name for name in {**fields, **theirs} if name not in free]
    differing = [name for name in names if fields.get(name) != theirs.get(name)]
    if differing:
        raise StudyError(f"{first} and {directory} differ in {', '.join(differing)}: not one study")
    stop = fields["first_seed"] + fields["seeds"]
    if other.first_seed > stop:
        raise StudyError(
            f"{directory} has the seeds from {other.first_seed} on, the studies before it end with "
            f"seed {stop - 1}: seeds lie between them that no study has, and to judge them as one "
            "study each seed is needed"
        )
    seeds = max(stop, other.seed_numbers.stop) - fields["first_seed"]
    policies = [*fields["policies"], *theirs["policies"]]
    distinct = [policy for n, policy in enumerate(policies) if policy not in policies[:n]]
    return {**fields, "seeds": seeds, "policies": distinct}
