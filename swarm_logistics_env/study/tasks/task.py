"""What a study plays: a task, a case of it, a run of a case, and the outcome of a run."""

from __future__ import annotations

import hashlib
import importlib
import json
import time
import traceback
from collections.abc import Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Protocol, TypeAlias, runtime_checkable

from swarm_logistics_env.core import streams
from swarm_logistics_env.core.current_folder import allow_import
from swarm_logistics_env.core.errors import RAISED_BY_OTHERS, StudyError, suggest
from swarm_logistics_env.core.records import canonical_json
from swarm_logistics_env.policies.spec import Makers, PolicySpec

from .outcome import Outcome
from .performance import Performance

Fields: TypeAlias = Mapping[str, object]  # of a record, by name


class _Fields(Protocol):
    def model_dump(self, *, mode: str = "python") -> Fields:
        """Return the fields."""


class TaskScenario(_Fields, Protocol):
    """A scenario of a task: a record (`records.Record`) that says how many robots, and how long."""

    @property
    def n_robots(self) -> int:
        """Swarm size N."""

    @property
    def duration(self) -> float:
        """Time at which a run ends at the latest [s]."""

    def conditions(self) -> list[tuple[str, str, str]]:
        """Return rows of name, value, and unit with meaning, for the report."""


class TaskFault(_Fields, Protocol):
    """A fault of a task: a record that says which robots fail, how, and from when on."""

    @property
    def mode(self) -> str:
        """Its failure mode."""

    @property
    def onset(self) -> float:
        """When it begins [s]."""


@runtime_checkable
class Task(Protocol):
    """Something that a policy can be tested in.

    Attributes:
        name: part of a case's identity, but for the warehouse's.
        removed: the failure mode that takes robots away, for the paper's P_S; None: the task cannot
            start without a robot, so FT is not asked.
        performance: what P is, as a sentence for the report.
    """

    name: str
    removed: str | None
    performance: str

    @property
    def default(self) -> TaskScenario:
        """The scenario from which a study's own is varied."""

    @property
    def policies(self) -> Makers:
        """What makes each policy of the task's own, by name; `policies.load` knows the others."""

    @property
    def fields(self) -> Mapping[str, str]:
        """The scenario's numeric fields, but its size, each with unit and meaning."""

    @property
    def failure_modes(self) -> Mapping[str, str]:
        """The failure modes, each with what it does to a robot."""

    def code(self) -> str:
        """Return a text that changes whenever the task's runs may have changed."""

    def vary(self, base: TaskScenario, fields: Fields) -> TaskScenario:
        """Return a scenario with some fields changed.

        Raises:
            SwarmLogisticsError: a field is unknown or cannot be.
        """

    def fault(
        self, mode: str, robots: int, onset: float, duration: float | None, manner: Fields
    ) -> TaskFault:
        """Return the fault of some robots from `onset` on, for `duration` [s] or for good.

        Args:
            manner: further fields of the task's own faults; mostly empty.

        Raises:
            SwarmLogisticsError: the task cannot let robots fail so.
        """

    def play(self, case: Case, seed: int, policy_seed: int) -> Outcome:
        """Play one run of a case, by a policy that no other run has used; return what it gave.

        Args:
            seed: of the world.
            policy_seed: of the policy's own randomness.
        """


@dataclass(frozen=True)
class Case:
    """All of a run but its seed. Cases of equal content have equal keys and share runs.

    Attributes:
        policy: that is played.
        identity: of the policy: two of one identity are one.
        scenario, faults: the conditions, of the task's own types.
        behaviour: 0: the policy's randomness follows from the run's seed; another number: from
            that number as well, so that the same worlds are met by another behaviour.
        task: that plays it.
        performance: what P of a run is; None: what the task counts.
    """

    policy: PolicySpec
    identity: str
    scenario: TaskScenario
    faults: tuple[TaskFault, ...] = ()
    behaviour: int = 0
    _: KW_ONLY
    task: Task = field(compare=False, repr=False)
    performance: Performance | None = field(default=None, compare=False)

    def __hash__(self) -> int:
        return hash(self.key)

    @cached_property
    def content(self) -> tuple[str, ...]:
        """What decides its outcomes: scenario and faults as JSON, identity, behaviour and task."""
        # Behaviour 0 and the warehouse add nothing.
        other = (str(self.behaviour),) if self.behaviour else ()
        if self.task.name != DEFAULT:
            other = (*other, f"task {self.task.name}")
        scenario = canonical_json(self.scenario.model_dump(mode="json"))
        faults = canonical_json([fault.model_dump(mode="json") for fault in self.faults])
        return (scenario, faults, self.identity, *other)

    @cached_property
    def key(self) -> str:
        """Digest of the content, 64 hexadecimal digits."""
        return digest_of(*self.content)

    @cached_property
    def content_text(self) -> str:
        """The content as it stands in the JSON that a run's key is the digest of."""
        return canonical_json(self.content)[1:-1]

    @cached_property
    def trainings(self) -> tuple[Case, ...]:
        """The case of each training of its policy; this one alone if that is one policy."""
        if not self.policy.trainings:
            return (self,)
        # Those that were planned; more files of such names may be there by now.
        return tuple(
            replace(self, policy=self.policy.training(name), identity=identity)
            for name, identity in json.loads(self.identity)
        )


_as_json = lru_cache(100)(canonical_json)  # of the versions of code that runs are of


@dataclass(frozen=True)
class Run:
    """One episode to play: a case at a seed, by one version of the code."""

    case: Case
    code: str
    seed: int

    @cached_property
    def key(self) -> str:
        """Digest of everything that decides its outcome, 64 hexadecimal digits."""
        # As `digest_of` of the content, the code and the seed; a study may have a million of them.
        text = f'[{self.case.content_text},{_as_json(self.code)},"{self.seed}"]'
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def policy_seed(self) -> int:
        """Seed of the policy's own randomness."""
        behaviour = self.case.behaviour
        if not behaviour:
            return self.seed
        # 31 bits: policies hand it to generators of all kinds.
        return streams.key(self.seed, "other behaviour", behaviour) & 0x7FFFFFFF

    def play(self) -> Outcome:
        """Play it; whatever goes wrong in it is its outcome."""
        start = time.perf_counter()
        task = self.case.task
        try:
            if self.code != (code := task.code()):
                raise StudyError(
                    f"this process runs code version {code}, the study {self.code}: "
                    "the package changed while the study ran"
                )
            outcome = task.play(self.case, self.seed, self.policy_seed)
        except RAISED_BY_OTHERS:  # kept as the run's outcome, and blocks the verdict
            outcome = Outcome(error=traceback.format_exc())
        return replace(outcome, wall_seconds=time.perf_counter() - start)


def digest_of(*parts: str) -> str:
    """Return the digest of texts, 64 hexadecimal digits."""
    return hashlib.sha256(canonical_json(parts).encode()).hexdigest()


DEFAULT = "warehouse"
TASKS = {
    DEFAULT: "swarm_logistics_env.study.tasks.warehouse_task:WAREHOUSE",
    "clearing": "swarm_logistics_env.study.tasks.warehouse_task:CLEARING",
    "recorded trials": "swarm_logistics_env.study.tasks.warehouse_task:RECORDED",
}


def task_of(source: object) -> Task:
    """Return the task of a name of `TASKS` or of "package.module:OBJECT"; a task as it is.

    Raises:
        StudyError: there is none.
    """
    task = source
    if isinstance(source, str):
        module, colon, attribute = TASKS.get(source, source).partition(":")
        if not colon:
            raise StudyError(
                f"no task {source!r} (a name or 'package.module:OBJECT'){suggest(source, TASKS)}"
            )
        allow_import(module)
        try:
            task = getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError, ValueError, SystemExit) as error:
            raise StudyError(f"task {source!r} cannot be imported: {error}") from None
    if not isinstance(task, Task):
        raise StudyError(f"{source!r} is no task: should have the attributes of tasks.Task")
    return task


def refuse_untrusted(
    path: Path,
    task: str | None,
    policies: tuple[PolicySpec, ...] = (),
    bodies: Iterable[object] = (),
    *,
    trust_code: bool,
) -> None:
    """Raise StudyError if what a file names would run code when it is loaded.

    Args:
        path: of the file.
        task, policies, bodies: that it names.
        trust_code: whether they may.
    """
    names_of_code = [f"task {task!r}"] if isinstance(task, str) and ":" in task else []
    names_of_code += [f"policy {policy.name!r}" for policy in policies if policy.runs_code]
    names_of_code += [f"bodies {name!r}" for name in bodies if ":" in str(name)]
    if names_of_code and not trust_code:
        raise StudyError(
            f"{path}: {names_of_code[0]} is code, which runs when it is loaded: should be a name "
            "that the package knows, or be allowed by --trust-code (trust_code=True)"
        )


Outcomes = Mapping[tuple[str, int], Outcome]  # by the key of the case, and the seed
