"""Faults: which robots, by seed or by role, fail in which mode, from when and for how long.

Callers write a fault as `Fault`, as the dict of its arguments, or in one word,
MODE[:ROBOTS[:ROLE or KIND]][@ONSET[+DURATION]].
"""

from __future__ import annotations

import functools
import math
import re
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    Field,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from swarm_logistics_env.core.errors import FaultError, SwarmLogisticsError
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.core.streams import generator, row_keys
from swarm_logistics_env.world.scenario import LARGEST, ROLES, Role, Scenario

from .failure_modes import FAILURE_MODES, failure_mode
from .state import WarehouseState, robots_in_role

GRACE = 5e-7  # [s]; times are sums of control periods
_SWITCHES = 32  # beginnings and ends of an intermittent fault that are drawn at a time

Duration = Annotated[float, Field(ge=0.01)]


class Fault(Record):
    """A failure mode that affects some robots, from a time on.

    Args:
        mode: a key of `FAILURE_MODES`.
        robots: how many robots fail (1..N), chosen by the seed alone, so that every mode hits the
            same robots and the sets of m = 1, 2, 3 are nested; or the robots' numbers.
        onset: when it begins [s], from the start of the episode.
        duration: for how long it holds [s]; None: for good. A removed robot does not come back.
            Robots that are `late` begin to work when it ends, and those that are `away` come back.
        factor: for a mode whose `factor` names something: what is left of it, in [0, 1).
        intermittent: for how long [s] it holds, and for how long not, both on average, in turn
            from its onset on; each robot's times are drawn from its own stream (exponential).
            None: it holds without a break.
        role: one of `ROLES`: the robots are chosen at the onset by what they are doing then, see
            `robots_in_role`; None: by the seed.
        kind: the robots are of this kind of the scenario's `robot_kinds`, chosen by the seed; None:
            of any.

    Raises:
        FaultError: an unknown mode or role, a factor, a duration or breaks that the mode does not
            have, `away` without either, a robot that is named twice, a role or a kind beside robots
            that are named, or both.

    Example:
        >>> Fault("FM1", 2, onset=200.0).robots
        2
    """

    error_type = FaultError

    mode: str
    robots: PositiveInt | Annotated[tuple[NonNegativeInt, ...], Field(min_length=1)] = 1
    onset: Annotated[float, Field(ge=0)] = 0.0
    duration: PositiveFloat | None = None
    factor: Annotated[float, Field(ge=0, lt=1)] | None = None
    intermittent: tuple[Duration, Duration] | None = None
    role: Role | None = None
    kind: str | None = None

    def __init__(
        self,
        mode: str,
        robots: int | Sequence[int] = 1,
        onset: float = 0.0,
        duration: float | None = None,
        factor: float | None = None,
        intermittent: tuple[float, float] | None = None,
        role: str | None = None,
        kind: str | None = None,
    ) -> None:
        fields = {"mode": mode, "robots": robots, "onset": onset, "duration": duration}
        super().__init__(**fields, factor=factor, intermittent=intermittent, role=role, kind=kind)

    @model_serializer(mode="wrap")
    def _serialize(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # Without these it is written as before there were any, so that stored runs stay known.
        written: dict[str, Any] = write(self)
        for name in ("role", "kind"):
            if getattr(self, name) is None:
                written.pop(name, None)
        return written

    @model_validator(mode="after")
    def _check_combination(self) -> Self:
        own_mode = failure_mode(self.mode)
        if self.factor is not None and own_mode.factor is None:
            modes = ", ".join(name for name, mode in FAILURE_MODES.items() if mode.factor)
            raise ValueError(f"{self.mode} takes no factor; modes that do: {modes}")
        for name in ("duration", "intermittent"):
            if self.mode == "removed" and getattr(self, name) is not None:
                raise ValueError(f"a removed robot does not come back: {name} should be None")
        if own_mode.returns and self.duration is None and self.intermittent is None:
            raise ValueError(
                f"duration = None: should say when robots that are {self.mode} come back, or "
                "intermittent; robots that never do are removed"
            )
        if isinstance(self.robots, tuple) and len(set(self.robots)) < len(self.robots):
            raise ValueError(f"robots = {self.robots}: should name each robot once")
        for name in ("role", "kind"):
            value = getattr(self, name)
            if value is not None and isinstance(self.robots, tuple):
                raise ValueError(
                    f"{name} = {value!r}: robots should be a number, not {self.robots}"
                )
        if self.role is not None and self.kind is not None:
            raise ValueError(
                f"role = {self.role!r} and kind = {self.kind!r}: should be one of them"
            )
        return self

    def is_active(self, time: float) -> bool:
        """Return whether `time` [s] lies between its onset and its end, breaks included."""
        started = time >= self.onset - GRACE
        ended = self.duration is not None and time >= self.onset + self.duration - GRACE
        return started and not ended


FaultLike: TypeAlias = Fault | Mapping[str, Any] | str

_NUMBER = r"\d+\.?\d*|\.\d+"
_FAULT = re.compile(
    r"(?P<mode>\w+)(:(?P<robots>\d+)(:(?P<whom>\w+))?)?"
    rf"(@(?P<onset>{_NUMBER})(\+(?P<duration>{_NUMBER}))?)?"
)


def checked_faults(
    name: str, faults: Any, refused: type[SwarmLogisticsError] = FaultError
) -> tuple[Fault, ...]:
    """Return faults as a tuple, whichever way each of them is written.

    Args:
        name: of the argument, for errors.
        faults: a sequence of `FaultLike`.
        refused: the error about what is no such sequence.

    Raises:
        FaultError: a text or a dict is not that of a fault that can be.

    Example:
        >>> checked_faults("faults", ["FM1:2", {"mode": "FM1", "robots": 2}])[0].robots
        2
    """
    is_list = isinstance(faults, Sequence) and not isinstance(faults, str)
    if not is_list or not all(isinstance(fault, Fault | Mapping | str) for fault in faults):
        raise refused(
            f'{name} = {faults!r}: should be a list of faults, as [Fault("FM1", 2)], ["FM1:2"] or '
            '[{"mode": "FM1", "robots": 2}]'
        )
    return tuple(_as_fault(name, fault) for fault in faults)


def _as_fault(name: str, fault: FaultLike) -> Fault:
    if isinstance(fault, Fault):
        return fault
    if isinstance(fault, str):
        return fault_of(fault)
    try:
        return Fault(**fault)
    except TypeError as error:  # Python names what is unknown or missing
        raise FaultError(f"{name}: {error}; known: {', '.join(Fault.model_fields)}") from None


def fault_of(text: str) -> Fault:
    """Return the fault that the text describes.

    Raises:
        FaultError: the text does not read so, or there is no such fault.

    Example:
        >>> fault_of("FM4:2:carrier@100+50").duration
        50.0
    """
    match = _FAULT.fullmatch(text)
    if match is None:
        raise FaultError(
            f"fault {text!r}: should be MODE[:ROBOTS[:ROLE or KIND]][@ONSET[+DURATION]], e.g. "
            "FM1:2@200, with ROBOTS a whole number and ONSET and DURATION in seconds"
        )
    parts: dict[str, Any] = match.groupdict()
    whom = parts.pop("whom")
    parts["role" if whom in ROLES else "kind"] = whom
    if parts["mode"] == "late" and parts["onset"] and not parts["duration"]:
        start = f"late:{parts['robots'] or 1}@0+{parts['onset']}"
        raise FaultError(f"fault {text!r}: late robots begin when it ends: should be {start}")
    return Fault(**{name: text for name, text in parts.items() if text is not None})


def text_of(fault: Fault) -> str | None:
    """Return the text that describes the fault; None: none does, as it has a factor, say."""
    digits = functools.partial(np.format_float_positional, trim="-")
    whom = f":{fault.role or fault.kind}" if fault.role or fault.kind else ""
    lasts = f"+{digits(fault.duration)}" if fault.duration else ""
    onset = f"@{digits(fault.onset)}{lasts}" if fault.onset or lasts else ""
    text = f"{fault.mode}:{fault.robots}{whom}{onset}"
    if fault.mode == "late" and onset and not lasts:
        return None
    return text if _FAULT.fullmatch(text) and fault_of(text) == fault else None


class Occurrence:
    """A fault in one episode: which robots it affects, and when.

    Args:
        fault: which.
        seed: the episode's seed.
        scenario: of the episode, for how many robots there are, and of which kinds.

    Attributes:
        mode: the failure mode.
        robots: the numbers of those affected, ascending; none before the onset of a fault that
            strikes by role.

    Raises:
        FaultError: as `failed_robots`, or it is of a battery and there are none.
    """

    def __init__(self, fault: Fault, seed: int, scenario: Scenario) -> None:
        self.fault = fault
        self.mode = failure_mode(fault.mode)
        if self.mode.battery < 1.0 and scenario.battery is None:
            raise FaultError(
                f"Fault.mode = {fault.mode}: should have robots with batteries, as battery = 5000"
            )
        self._seed = seed
        # The times at which an intermittent fault begins, ends, begins, ..., by robot.
        self._switches: dict[int, list[float]] = {}
        affected = failed_robots(fault, seed, scenario)
        self.robots = affected if fault.role is None else affected[:0]

    @property
    def numbered(self) -> Fault:
        """The fault with the numbers of its robots; as it is if they are not chosen yet."""
        if not len(self.robots):
            return self.fault
        return self.fault.replace(robots=tuple(self.robots.tolist()), role=None, kind=None)

    def choose_by_role(self, state: WarehouseState) -> None:
        """Choose the robots of a fault that strikes by role, once it holds."""
        fault = self.fault
        if fault.role is None or len(self.robots) or not fault.is_active(state.time):
            return
        assert isinstance(fault.robots, int)  # no numbers of robots stand beside a role
        self.robots = robots_in_role(state, fault.role, fault.robots)

    def holds_for(self, time: float) -> NDArray[np.int64]:
        """Return the robots for which it holds at `time` [s], ascending."""
        if not self.fault.is_active(time):
            return self.robots[:0]
        if self.fault.intermittent is None:
            return self.robots
        is_on = [self._n_switches(robot, time) % 2 == 1 for robot in self.robots.tolist()]
        return self.robots[is_on]

    def next_change(self, time: float, next_step: float) -> float:
        """Return when after `time` [s] it next changes what robots can do; infinite: never.

        What changes all the time does so at the time of the next step.
        """
        fault = self.fault
        if not fault.is_active(time):
            return fault.onset if fault.onset > time else math.inf
        changes = [math.inf if fault.duration is None else fault.onset + fault.duration]
        if self.mode.wears:
            changes.append(next_step)
        if fault.intermittent is not None:
            for robot in self.robots.tolist():
                n_switches = self._n_switches(robot, time)
                changes.append(self._switches[robot][n_switches])
        return min(changes)

    def remaining_factors(self, time: float, end: float) -> dict[str, float]:
        """Return the factors on speed, view and battery at `time` [s] of an episode until `end`."""
        mode = self.mode
        fault = self.fault
        factors = {name: getattr(mode, name) for name in ("speed", "view", "battery")}
        if fault.factor is not None and mode.factor is not None:
            factors[mode.factor] = fault.factor
        if mode.wears:
            share = (time - fault.onset) / max(end - fault.onset, GRACE)
            for name in ("speed", "battery"):
                factors[name] = 1.0 - (1.0 - factors[name]) * min(max(share, 0.0), 1.0)
        return factors

    def _n_switches(self, robot: int, time: float) -> int:
        """Return how often it has begun or ended for a robot until `time` [s]."""
        fault = self.fault
        switches = self._switches.setdefault(robot, [fault.onset])
        while switches[-1] <= time + GRACE:
            stream = (robot, len(switches) // _SWITCHES)
            rng = generator(self._seed, f"intermittent {fault.mode}", *stream)
            means = np.resize(fault.intermittent or (), _SWITCHES)
            switches += (switches[-1] + np.cumsum(rng.exponential(means))).tolist()
        return bisect_right(switches, time + GRACE)


def failed_robots(fault: Fault, seed: int, scenario: Scenario) -> NDArray[np.int64]:
    """Return the numbers of the robots that `fault` affects, ascending.

    Raises:
        FaultError: it is of more robots than there are, of one that is not there, or of a kind that
            there is not.
    """
    n_robots = scenario.n_robots
    if isinstance(fault.robots, tuple):
        if max(fault.robots) >= n_robots:  # before numpy, whose integers end at 2**63
            raise FaultError(
                f"Fault.robots = {fault.robots}: robots are numbered 0 to {n_robots - 1}"
            )
        return np.unique(np.array(fault.robots, dtype=np.int64))
    if fault.robots > n_robots:
        raise FaultError(f"Fault.robots = {fault.robots}: should be at most n_robots = {n_robots}")
    # Ranked by a key of seed and robot alone: nested in m, the same for every mode and any N.
    order = np.argsort(row_keys(seed, "faulty robots", n_robots), kind="stable")
    if fault.kind is not None:
        order = order[scenario.is_of_kind(fault.kind)[order]]
        if fault.robots > len(order):
            raise FaultError(
                f"Fault.robots = {fault.robots} of kind = {fault.kind!r}: should be at most "
                f"{len(order)}, as so many of the {n_robots} robots are of that kind"
            )
    return np.sort(order[: fault.robots]).astype(np.int64)


def step_of_change(occurrences: Sequence[Occurrence], step: int, period: float) -> int:
    """Return the first control step after `step` that ends when a fault has begun or ended.

    It is beyond the end of any episode if none does.

    Args:
        occurrences: the faults; `apply_faults` has chosen the robots of those that hold.
        step: control steps since the start.
        period: of a control step [s].
    """
    next_step = step + 1
    changes = (fault.next_change(step * period, next_step * period) for fault in occurrences)
    change = min(changes, default=LARGEST)
    return max(math.ceil((min(change, LARGEST) - GRACE) / period), next_step)
