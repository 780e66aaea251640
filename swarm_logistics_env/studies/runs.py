"""Conditions, known by their content, the runs that one condition needs, and shards of runs."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from itertools import islice, pairwise
from typing import Any, Self

from swarm_logistics_env import streams
from swarm_logistics_env.errors import StudyError
from swarm_logistics_env.records import canonical_json
from swarm_logistics_env.tasks.task import DEFAULT, Task


@dataclass(frozen=True)
class StudiedPolicy:
    """A policy as a study knows it.

    Attributes:
        label: how the report calls it.
        identity: stable text of its class, parameters and weights; two of one identity are one.
        source: what makes it, for `policy_choice.policy_of`.
    """

    label: str
    identity: str
    source: object = field(compare=False, repr=False)


@dataclass(frozen=True)
class Condition:
    """All of a run but its seed. Conditions of equal content have equal keys and share runs.

    Attributes:
        policy, scenario, faults: what is played, under which conditions of the task's own types.
        behaviour: 0: the policy's randomness follows from the run's seed; another number: from
            that number as well, so that the same worlds are met by another behaviour.
        task: that plays it.
    """

    policy: StudiedPolicy
    scenario: Any
    faults: tuple[Any, ...] = ()
    behaviour: int = 0
    _: KW_ONLY
    task: Task = field(compare=False, repr=False)

    @property
    def size(self) -> int:
        """Swarm size N."""
        return int(self.scenario.n_robots)

    @property
    def duration(self) -> float:
        """Time at which a run ends at the latest [s]."""
        return float(self.scenario.duration)

    @cached_property
    def scenario_json(self) -> str:
        """The scenario as canonical JSON."""
        return canonical_json(self.scenario.model_dump(mode="json"))

    @cached_property
    def faults_json(self) -> str:
        """The faults as canonical JSON, in the order in which they were given."""
        return canonical_json([fault.model_dump(mode="json") for fault in self.faults])

    @cached_property
    def key(self) -> str:
        """Digest of scenario, faults, policy identity and behaviour, 64 hexadecimal digits."""
        return _digest(*self._content)

    @property
    def _content(self) -> tuple[str, ...]:
        # Behaviour 0 and the warehouse add nothing, so that keys of older stores stay valid.
        other = (str(self.behaviour),) if self.behaviour else ()
        if self.task.name != DEFAULT:
            other = (*other, f"task {self.task.name}")
        return (self.scenario_json, self.faults_json, self.policy.identity, *other)

    def run(self, code: str, seed: int) -> Run:
        """Return the run of this condition at one seed, under one version of the code."""
        return Run(_digest(*self._content, code, str(seed)), self, code, seed)


@dataclass(frozen=True)
class Run:
    """One episode to play. `key` is the digest of everything that decides its outcome."""

    key: str
    condition: Condition
    code: str
    seed: int

    @property
    def policy_seed(self) -> int:
        """Seed of the policy's own randomness."""
        behaviour = self.condition.behaviour
        if not behaviour:
            return self.seed
        # 31 bits: policies hand it to generators of all kinds.
        return streams.key(self.seed, "other behaviour", behaviour) & 0x7FFFFFFF


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


def _digest(*parts: str) -> str:
    return hashlib.sha256(canonical_json(parts).encode()).hexdigest()


def seeds_in_words(seeds: Sequence[int]) -> str:
    """Return ascending seeds as ranges, e.g. "0 to 3, 8"; at least one."""
    breaks = [place for place, (a, b) in enumerate(pairwise(seeds), start=1) if b != a + 1]
    parts = [seeds[a:b] for a, b in pairwise([0, *breaks, len(seeds)])]
    return ", ".join(f"{p[0]}" if len(p) == 1 else f"{p[0]} to {p[-1]}" for p in parts)
