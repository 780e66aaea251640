"""Kinds of robots: what the bodies of some robots of a swarm have that differs from the others'.

The counts of the kinds are the parts of a pattern that repeats over the robots. So the kind of
robot i follows from i and the counts alone, whatever the swarm size, and robots that are added or
that leave keep the mix.
"""

from __future__ import annotations

import functools
import json
import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, PlainSerializer, model_validator

from swarm_logistics_env.core.errors import FaultError, ScenarioError
from swarm_logistics_env.core.records import Record

from .ranges import Positive

# What a robot is doing, by which a fault may choose whom it strikes; so no kind has such a name.
Role = Literal[
    "carrier",  # carries a requested item
    "neighbour",  # a carrier sees it with its cameras
    "in_area",  # in the delivery area
    "shuffling",  # carries an item that is not requested
    "searching",  # empty, anywhere else
]
ROLES: tuple[str, ...] = get_args(Role)

_MOST = 10_000  # robots of a kind in the pattern
_NAME = re.compile(r"[A-Za-z]\w{0,29}", re.ASCII)
_TEXT = re.compile(r"(?P<name>\w+)(:(?P<count>-?\d+))?(?P<fields>(\s+\w+=\S+)*)")
_EXAMPLE = '"lifter:4, scout:1 max_speed=1.0 lifts=false"'


class RobotKind(Record):
    """A kind of robots. What it leaves out, it has as the scenario says.

    Its fields after `count` are the table of what a kind may set: each but `lifts` is the field of
    that name of a scenario, with the unit that it has there.

    Args:
        name: a letter, then letters, digits and _; no role of robots, as faults name both.
        count: robots of this kind in the pattern, 1 to 10,000.
        robot_radius: at most the scenario's, for which layouts, floor plans and routes leave room.
        lifts: whether its robots lift items.

    Raises:
        ScenarioError: a field is unknown or out of range.
    """

    error_type = ScenarioError

    name: str
    count: int = 1
    robot_radius: Positive | None = None
    robot_mass: Positive | None = None
    max_speed: Positive | None = None
    max_turn_rate: Positive | None = None
    max_acceleration: Positive | None = None
    drive: Literal["holonomic", "differential"] | None = None
    ranger_range: Positive | None = None
    view_range: Positive | None = None
    lifts: bool | None = None
    battery: Positive | None = None

    @model_validator(mode="after")
    def _has_a_name_and_robots(self) -> Self:
        if not _NAME.fullmatch(self.name) or self.name in ROLES:
            raise ValueError(
                f"RobotKind.name = {self.name!r}: should be a letter, then letters, digits and _, "
                f"30 at most, and no role of robots ({', '.join(ROLES)})"
            )
        if not 1 <= self.count <= _MOST:
            raise ValueError(
                f"RobotKind.count = {self.count} of the kind {self.name!r}: should be 1 to "
                f"{_MOST} robots"
            )
        return self

    @property
    def differing(self) -> dict[str, Any]:
        """The fields that it sets, with their values."""
        return {name: value for name in KIND_FIELDS if (value := getattr(self, name)) is not None}

    def __str__(self) -> str:
        words = [f"{name}={_text_of(value)}" for name, value in self.differing.items()]
        return " ".join([f"{self.name}:{self.count}", *words])


KIND_FIELDS = tuple(name for name in RobotKind.model_fields if name not in ("name", "count"))


def kinds_of(values: object) -> object:
    """Return the kinds of a text, or of a list of tables; what is neither stays as it is.

    Raises:
        ValueError: a text does not read so, or a table is no kind that can be.

    Example:
        >>> [kind.count for kind in kinds_of("lifter:4, scout:1 max_speed=1.0 lifts=false")]
        [4, 1]
    """
    if isinstance(values, str):
        is_any = values.strip() not in ("", "none")  # as it is shown where there are none
        parts = values.split(",") if is_any else []
        values = [_fields_of(part.strip()) for part in parts]
    if isinstance(values, dict):
        raise ValueError("should be a list of tables: [[robot_kinds]] in a TOML file")
    if not isinstance(values, list | tuple):
        return values
    return tuple(RobotKind(**kind) if isinstance(kind, dict) else kind for kind in values)


def kinds_text(kinds: tuple[RobotKind, ...]) -> str:
    """Return the text that `kinds_of` reads."""
    return ", ".join(map(str, kinds))


# They are stored as their text, to which a field that a later version knows adds nothing.
Kinds = Annotated[tuple[RobotKind, ...], BeforeValidator(kinds_of), PlainSerializer(kinds_text)]


def _fields_of(text: str) -> dict[str, Any]:
    match = _TEXT.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} should be NAME[:COUNT] [FIELD=VALUE ..], as in {_EXAMPLE}")
    fields: dict[str, Any] = {"name": match["name"], "count": int(match["count"] or 1)}
    for word in match["fields"].split():
        name, _, value = word.partition("=")
        if name in fields:
            raise ValueError(f"{text!r}: {name} is set twice: should be set once")
        fields[name] = _value_of(value)
    return fields


def _value_of(text: str) -> object:
    try:
        return json.loads(text)
    except ValueError:
        return text


def _text_of(value: object) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def check_names(kinds: tuple[RobotKind, ...], n_robots: int) -> None:
    """Check that every kind has a name of its own and robots, and that one of them lifts.

    Raises:
        ValueError: one has not.
    """
    names = [kind.name for kind in kinds]
    numbers = np.resize(_pattern(tuple(kind.count for kind in kinds)), n_robots)
    for number, name in enumerate(names):
        if name in names[:number]:
            raise ValueError(f"robot_kinds: name = {name!r} is given twice: should be once")
        if number not in numbers:
            raise ValueError(
                f"robot_kinds: n_robots = {n_robots} has no robot of the kind {name!r}: should be "
                f"more robots, or a larger count than {kinds[number].count}"
            )
    if kinds and all(kind.lifts is False for kind in kinds):
        raise ValueError("robot_kinds: lifts = False in every kind: should be True in one of them")


@functools.lru_cache(maxsize=64)
def _pattern(counts: tuple[int, ...]) -> NDArray[np.int64]:
    # The robots of each kind stand evenly over the pattern, as Webster's method shares out seats.
    kinds = np.repeat(np.arange(len(counts)), counts)
    places = [(np.arange(count) + 0.5) / count for count in counts]
    if not places:
        return np.zeros(1, np.int64)
    return kinds[np.argsort(np.concatenate(places), kind="stable")]


class OfKinds:
    """What a scenario says of its kinds of robots."""

    if TYPE_CHECKING:  # or they would stand before the other fields of a scenario
        n_robots: int
        robot_radius: float
        robot_kinds: tuple[RobotKind, ...]

        def replace(self, **fields: Any) -> Self: ...

    def of_kinds(self, name: str) -> tuple[Any, ...]:
        """Return a field of `RobotKind` for each kind; of one kind if all robots are alike."""
        usual = getattr(self, name)
        if not self.robot_kinds:
            return (usual,)
        values = (getattr(kind, name) for kind in self.robot_kinds)
        return tuple(usual if value is None else value for value in values)

    def of_robots(self, name: str) -> NDArray[Any]:
        """Return a field of `RobotKind` for each robot (N,), without its factor of a mix."""
        values = self.of_kinds(name)
        if len(values) == 1:
            return np.full(self.n_robots, values[0])
        return np.array(values)[self.kind_numbers(self.n_robots)]

    def kind_numbers(self, n_robots: int) -> NDArray[np.int64]:
        """Return the numbers of the kinds of robots 0, 1, ..., from 0 on, shape (n_robots,).

        Any first n robots have about the shares of the counts.
        """
        return np.resize(self.kind_pattern, n_robots)

    def is_of_kind(self, name: str) -> NDArray[np.bool_]:
        """Return which robots are of the kind of that name (N,).

        Raises:
            FaultError: there is no such kind.
        """
        names = [kind.name for kind in self.robot_kinds]
        if name not in names:
            kinds = ", ".join(names) or "robot_kinds has none"
            raise FaultError(
                f"Fault.kind = {name!r}: should be a kind of robots ({kinds}), or, as its role, "
                f"{', '.join(ROLES)}"
            )
        return np.asarray(self.kind_numbers(self.n_robots) == names.index(name))

    @property
    def kind_pattern(self) -> NDArray[np.int64]:
        """The numbers of the kinds of the first robots, which repeat (P,); 0 if all are alike."""
        return _pattern(tuple(kind.count for kind in self.robot_kinds))

    def of_robot(self, number: int) -> Self:
        """Return a scenario in which all robots have the body of the robot of that number.

        Its robots lift, as whoever steers one robot takes it for one whose gripper may fail.
        """
        if not self.robot_kinds:
            return self
        kind = self.robot_kinds[self.kind_pattern[number % len(self.kind_pattern)]]
        fields = {name: value for name, value in kind.differing.items() if name != "lifts"}
        return self.replace(robot_kinds=(), **fields)

    @property
    def lifts(self) -> bool:
        """Whether robots lift items; a kind may not."""
        return True

    @property
    def has_smaller_robots(self) -> bool:
        """Whether the robots of a kind are smaller than `robot_radius`."""
        return any(radius < self.robot_radius for radius in self.of_kinds("robot_radius"))

    @property
    def highest_speed(self) -> float:
        """Top speed of the fastest kind [m/s]."""
        return float(max(self.of_kinds("max_speed")))

    @property
    def highest_turn_rate(self) -> float:
        """Top turn rate of the kind that turns fastest [rad/s]."""
        return float(max(self.of_kinds("max_turn_rate")))

    @property
    def ranger_reach(self) -> float:
        """Range of the rangers of the kind that measures farthest [m]."""
        return float(max(self.of_kinds("ranger_range")))

    @property
    def view_reach(self) -> float:
        """Range of the cameras of the kind that sees farthest [m]."""
        return float(max(self.of_kinds("view_range")))


ScenarioT = TypeVar("ScenarioT", bound=OfKinds)


def of_first_robots(scenario: ScenarioT) -> tuple[ScenarioT, ...]:
    """Return scenarios as `OfKinds.of_robot` does, of the first robots, whose kinds repeat."""
    if not scenario.robot_kinds:
        return (scenario,)
    kinds, first = np.unique(scenario.kind_pattern, return_index=True)
    of_kind = dict(zip(kinds.tolist(), map(scenario.of_robot, first.tolist()), strict=True))
    return tuple(of_kind[kind] for kind in scenario.kind_pattern.tolist())
