"""What a study plays: a task, a case of it, a run of a case, and the outcome of a run."""

from __future__ import annotations

import hashlib
import importlib
import json
import math
import time
import traceback
from collections.abc import Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, BeforeValidator, ConfigDict, NonNegativeFloat, PlainSerializer
from pydantic.dataclasses import dataclass as validated

from swarm_logistics_env.core import streams
from swarm_logistics_env.core.current_folder import allow_import
from swarm_logistics_env.core.errors import RAISED_BY_OTHERS, StudyError, suggest
from swarm_logistics_env.core.records import canonical_json
from swarm_logistics_env.policies.spec import Makers, PolicySpec
from swarm_logistics_env.world.warehouse.contacts import ContactMeasures
from swarm_logistics_env.world.warehouse.orders import OrderMeasures

from .performance import Performance

Seconds: TypeAlias = NDArray[np.float64]
Fields: TypeAlias = Mapping[str, object]  # of a record, by name


def _check_ascending(times: Seconds) -> Seconds:
    if times.size and not (np.isfinite(times).all() and (np.diff(times, prepend=0.0) >= 0.0).all()):
        raise ValueError("should ascend")
    return times


Times = Annotated[
    Seconds,
    BeforeValidator(lambda times: np.asarray(times, dtype=np.float64)),
    AfterValidator(_check_ascending),
    PlainSerializer(lambda times: times.tolist()),
]


_LONGEST_ERROR = 20_000  # characters
LAST_PART = 0.2  # of a run: who delivers nothing in it stands still


def _make_storable(error: object) -> object:
    """Return a text as files and databases hold it: no half signs, and not without end."""
    if not isinstance(error, str):
        return error
    text = error.encode(errors="backslashreplace").decode().replace("\0", "\\x00")
    half = _LONGEST_ERROR // 2
    return text if len(text) <= _LONGEST_ERROR else f"{text[:half]} [..] {text[-half:]}"


@dataclass(frozen=True)
class Deliveries:
    """What one run delivered, or the traceback of the error that ended it.

    Attributes:
        delivery_times: [s], ascending, shape (delivered,); its length is the paper's P.
        ended_at: [s].
        all_delivered: whether no item was left, so that more robots could not have delivered more.
        failed_robots: numbers of the robots that any fault names.
        anchoring_seconds: robot-seconds that working robots spent in contact range of failed ones;
            None: the task does not tell.
        digest: of the trajectory and the deliveries (`Episode.digest`); None: not known.
        error: traceback, its middle left out where it is very long; None: the run succeeded.
        wall_seconds: time it took [s]; no part of the result.
        untimed: P, 0 or more, where it is not the number of times; None: it is.
        least: P at least, of a recorded trial that was stopped and not counted, where `untimed` is
            the most that it may be; None: P is known.
    """

    delivery_times: Times = field(default_factory=lambda: np.empty(0))
    ended_at: NonNegativeFloat = 0.0
    all_delivered: bool = False
    failed_robots: tuple[int, ...] = ()
    anchoring_seconds: NonNegativeFloat | None = 0.0
    digest: str | None = None
    error: Annotated[str | None, BeforeValidator(_make_storable)] = None
    wall_seconds: float = 0.0  # a clock may be set back
    untimed: NonNegativeFloat | None = None
    least: NonNegativeFloat | None = None

    @property
    def delivered(self) -> float:
        """The paper's P, 0 or more: the number of items delivered, or a task's own measure."""
        return len(self.delivery_times) if self.untimed is None else self.untimed

    @property
    def longest_standstill(self) -> float | None:
        """The longest time without a delivery, from start to end [s]; None: times are unknown."""
        if self.untimed is not None and not self.delivery_times.size:
            return None
        times = np.concatenate([[0.0], self.delivery_times, [self.ended_at]])
        return float(np.diff(times).max())

    @property
    def stands_still(self) -> bool | None:
        """Whether nothing was delivered in the last fifth, though there was something to deliver.

        None: the times are unknown.
        """
        if self.longest_standstill is None:
            return None
        is_late = self.delivery_times > (1.0 - LAST_PART) * self.ended_at
        return not self.all_delivered and not is_late.any()

    @property
    def time_to_clear(self) -> float:
        """Time until every item was delivered [s]; infinite: not all were when the time was up."""
        return self.ended_at if self.all_delivered else math.inf


# A dataclass has the fields of its last base first.
@validated(
    frozen=True,
    config=ConfigDict(arbitrary_types_allowed=True, allow_inf_nan=False, extra="forbid"),
)
class Outcome(OrderMeasures, ContactMeasures, Deliveries):
    """What one run gave: its deliveries, then what was counted of contacts and orders, validated.

    A measure is None where nobody counted, too, as in runs of version 0.3.
    """

    @property
    def capped(self) -> bool:
        """Whether P would be larger if there had been more to deliver."""
        return bool(self.all_served) or (self.all_delivered and self.untimed is None)


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
