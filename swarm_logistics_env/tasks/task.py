"""What a study can play: a task, what playing it once gives, and the tasks by name."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, PlainSerializer

from swarm_logistics_env.errors import StudyError, suggest


@dataclass(frozen=True)
class Outcome:
    """What one run gave: an episode's result, or the traceback of the error that ended it.

    Attributes:
        run: key of the run.
        delivery_times: [s], ascending, shape (delivered,); its length is the paper's P.
        ended_at: [s].
        all_delivered: whether no item was left, so that more robots could not have delivered more.
        failed_robots: numbers of the robots that any fault names.
        anchoring_seconds: robot-seconds that working robots spent in contact range of failed ones;
            None: the task does not tell.
        digest: of the trajectory and the deliveries (`Episode.digest`); None: not known.
        error: traceback; None: the run succeeded.
        wall_seconds: time it took [s]; no part of the result.
        untimed: P, 0 or more, where no times are known; None: the number of times is P.
    """

    run: str
    delivery_times: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    ended_at: float = 0.0
    all_delivered: bool = False
    failed_robots: tuple[int, ...] = ()
    anchoring_seconds: float | None = 0.0
    digest: str | None = None
    error: str | None = None
    wall_seconds: float = 0.0
    untimed: float | None = None

    @property
    def delivered(self) -> float:
        """The paper's P, 0 or more: the number of items delivered, or a task's own measure."""
        return len(self.delivery_times) if self.untimed is None else self.untimed


class Playable(Protocol):
    """What a task needs of a condition."""

    @property
    def scenario(self) -> Any:
        """What is held fixed during a run, of the task's own type."""

    @property
    def faults(self) -> tuple[Any, ...]:
        """What fails during a run, of the task's own type."""


@runtime_checkable
class Task(Protocol):
    """Something that a policy can be tested in.

    Its scenarios and faults are records (`records.Record`), so that a store can keep them as JSON.
    A scenario has the fields `n_robots`, the swarm size N, and `duration`, the time at which a run
    ends at the latest [s]; and `conditions()`: rows of name, value, and unit with meaning, for the
    report.

    Attributes:
        name: part of a condition's identity, but for the warehouse's.
        removed: the failure mode that takes robots away, for the paper's P_S; None: the task cannot
            start without a robot, so FT is not asked.
        performance: what P is, as a sentence for the report.
    """

    name: str
    removed: str | None
    performance: str

    @property
    def default(self) -> Any:
        """The scenario from which a study's own is varied."""

    @property
    def policies(self) -> Mapping[str, Callable[..., Any]]:
        """What makes each policy of the task's own, by name; `policies.load` knows the others."""

    @property
    def fields(self) -> Mapping[str, str]:
        """The scenario's numeric fields, but its size, each with unit and meaning."""

    @property
    def failure_modes(self) -> Mapping[str, str]:
        """The failure modes, each with what it does to a robot."""

    def code(self) -> str:
        """Return a text that changes whenever the task's runs may have changed."""

    def vary(self, base: Any, fields: Mapping[str, Any]) -> Any:
        """Return a scenario with some fields changed.

        Raises:
            SwarmLogisticsError: a field is unknown or cannot be.
        """

    def fault(self, mode: str, robots: int, onset: float, duration: float | None) -> Any:
        """Return the fault of some robots from `onset` on, for `duration` [s] or for good.

        Raises:
            SwarmLogisticsError: the task cannot let robots fail so.
        """

    def play(self, policy: object, condition: Playable, seed: int, policy_seed: int) -> Outcome:
        """Play one run of a policy, as `policy_choice` knows it, and return what it gave.

        Args:
            seed: of the world.
            policy_seed: of the policy's own randomness.
        """


DEFAULT = "warehouse"
NAMES = {
    DEFAULT: "swarm_logistics_env.tasks.warehouse_task:WAREHOUSE",
    "recorded trials": "swarm_logistics_env.tasks.recorded_trials:RECORDED",
}


def task_of(source: object) -> Task:
    """Return the task of a name of `NAMES` or of "package.module:OBJECT"; a task as it is.

    Raises:
        StudyError: there is none.
    """
    found: Any = source
    if isinstance(source, str):
        module, colon, attribute = NAMES.get(source, source).partition(":")
        if not colon:
            raise StudyError(
                f"no task {source!r} (a name or 'package.module:OBJECT'){suggest(source, NAMES)}"
            )
        try:
            found = getattr(importlib.import_module(module), attribute)
        except (ImportError, AttributeError, ValueError) as error:
            raise StudyError(f"task {source!r} cannot be imported: {error}") from None
    if not isinstance(found, Task):
        raise StudyError(f"{source!r} is no task: should have the attributes of tasks.Task")
    return found


def refuse_untrusted(source: object, place: object, *, trust_code: bool) -> None:
    """Raise StudyError if a file, `place`, names a task whose module would run when it is loaded.

    Args:
        trust_code: whether it may.
    """
    if isinstance(source, str) and ":" in source and not trust_code:
        raise StudyError(
            f"{place}: task {source!r} is code, which runs when it is loaded: should be a task's "
            "name, or be allowed by --trust-code (trust_code=True)"
        )


def _checked(source: object) -> object:
    task_of(source)
    return source


def _written(source: object) -> str:
    return source if isinstance(source, str) else task_of(source).name


TaskSource = Annotated[Any, BeforeValidator(_checked), PlainSerializer(_written)]
