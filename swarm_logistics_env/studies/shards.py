"""Shards: equal parts of a study for machines that know nothing of each other."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Self

from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.studies.conditions import Run


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
        # Of all runs, not of the missing ones: what a shard plays depends on nothing but the plan.
        return islice(runs, self.number - 1, None, self.count)
