"""The contract of a policy: what a robot has to sense for it, when, and what it commands.

Where its words fit they are those of LEAPP (github.com/nvidia-isaac/leapp): name, kind, dtype,
frequency, initial_values.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator, Sequence
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import JsonValue

from swarm_logistics_env.core.errors import RobotError
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.policies.row_policy import check_row_policy, refuse_kinds
from swarm_logistics_env.world.observations import SENSORS, columns, n_columns
from swarm_logistics_env.world.scenario import Scenario

# LEAPP's kinds of tensors; it has none for what else a row holds.
KINDS = {
    "velocity": "state/body/linear_velocity",
    "turn_rate": "state/body/angular_velocity",
    "forward": "target/body/linear_velocity",
    "left": "target/body/linear_velocity",
    "turn": "target/body/angular_velocity",
}
FRAME = "the robot's body: x forward, y left, from its centre; a turn to the left is positive"
STREAM = (
    "row_keys(seed, stream, number + 1)[number] is the key of robot `number` (core/streams.py); "
    "uniform(key, counter) its numbers (compiler/kernels.py)"
)


class _Part(Record):
    error_type = RobotError


class Input(_Part):
    """A named part of a row.

    Args:
        name: of `world.observations.columns`, as all that follows.
        kind: LEAPP's; empty: it has none.
        sensor: what tells it, of `leans_on`.
        used: whether it may change a command of this policy; if not, it may hold any number within
            its limits.
        unit: "flag" means 0 or 1.
        columns: the places of its numbers in a row, from 0 on.
        low, high: limits of its numbers.
        absent: its number where there is nothing to tell; None: there always is.
        flag: the input that is 0 where there is nothing to tell, number by number.
        meaning: in words.
    """

    name: str
    kind: str
    sensor: str
    used: bool
    unit: str
    columns: tuple[int, ...]
    low: float
    high: float
    absent: float | None
    flag: str
    meaning: str


class Output(_Part):
    """A number of a command.

    Args:
        column: its place, from 0 on.
        low, high: its limits.
        high_means: what `high` does, in the unit of the motor; what `low` does is the opposite, or
            nothing where it is 0.
    """

    name: str
    kind: str
    column: int
    low: float
    high: float
    high_means: str


class Contract(_Part):
    """What a robot and a policy have to agree on.

    Args:
        format: the version of a contract's form.
        policy: in words.
        parameters: what its decisions depend on; of a trained one with a digest of its weights.
        period: from one row and command to the next [s]; `frequency` is its inverse [Hz].
        dtype: of a row's numbers.
        frame: of what has a direction.
        body: the fields of the scenario that it reads, which have to be those of the robot.
        stream: what its random numbers are for; `stream_key` says how a robot draws them.
        inputs: they cover a row.
        outputs: a command.
        initial_values: what it remembers before its first row; None: drawn from its stream.
        leans_on: what of the simulator's senses it uses, and what each has to tell.
    """

    format: Literal[1] = 1
    policy: str
    parameters: dict[str, JsonValue]
    period: float
    frequency: float
    dtype: str = "float32"
    frame: str = FRAME
    body: dict[str, JsonValue]
    stream: str
    stream_key: str = STREAM
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    initial_values: dict[str, float | None]
    leans_on: dict[str, str]

    @property
    def width(self) -> int:
        """The length of a row."""
        return sum(len(part.columns) for part in self.inputs)

    def to_yaml(self) -> str:
        """Return it as YAML."""
        return "\n".join([*_yaml_lines(self.model_dump(mode="json"), ""), ""])


class _ReadFields:
    """A scenario that notes which of its fields are read."""

    def __init__(self, scenario: Scenario) -> None:
        self.values: dict[str, JsonValue] = {}
        self._scenario = scenario

    def __getattr__(self, name: str) -> Any:
        self.values[name] = getattr(self._scenario, name)
        return self.values[name]


def contract_of(policy: object, scenario: Scenario) -> Contract:
    """Return the contract of a policy for the robots of a scenario.

    Raises:
        PolicyError: it does not decide from rows alone, or robots are of several kinds.
    """
    refuse_kinds(scenario, "a contract")
    row_policy = copy.copy(check_row_policy(policy))
    body = _ReadFields(scenario)
    row_policy.configure(cast("Scenario", body))
    row_policy.begin(row_keys(0, row_policy.stream, 2))
    body.values.pop("robot_kinds", None)
    inputs = inputs_of(scenario, row_policy.ignores)
    sensors = {part.sensor for part in inputs if part.used}
    parameters = cast("Any", row_policy).parameters
    return Contract(
        policy=repr(policy),
        parameters=parameters.model_dump(mode="json"),
        period=scenario.control_period,
        frequency=1.0 / scenario.control_period,
        body=body.values,
        stream=row_policy.stream,
        inputs=inputs,
        outputs=outputs_of(scenario, row_policy.messages),
        # What two robots begin with alike is fixed; the others draw.
        initial_values={
            name: float(first) if first == second else None
            for name, (first, second) in row_policy.memories().items()
        },
        leans_on={name: about for name, about in SENSORS.items() if name in sensors},
    )


def inputs_of(scenario: Scenario, ignores: frozenset[str]) -> tuple[Input, ...]:
    """Return the parts of a row in `scenario`; those that a policy `ignores` are not used."""
    numbers = np.arange(n_columns(scenario))
    return tuple(
        Input(
            name=column.name,
            kind=KINDS.get(column.name, ""),
            sensor=column.sensor,
            used=column.name not in ignores,
            unit=column.unit,
            columns=numbers[column.columns].tolist(),
            low=column.low,
            high=column.high,
            absent=column.absent,
            flag="" if column.flag == column.name else column.flag,
            meaning=column.meaning,
        )
        for column in columns(scenario)
    )


def outputs_of(scenario: Scenario, messages: Sequence[str] = ()) -> tuple[Output, ...]:
    """Return the parts of a command to the robots of a scenario, and the messages behind it."""
    to_the_left = f"to the left at {scenario.max_speed:g} m/s"
    if not scenario.is_holonomic:
        to_the_left = "nothing: such a drive has no motion to the side, so it is always 0"
    meanings = {
        "forward": f"ahead at {scenario.max_speed:g} m/s",
        "left": to_the_left,
        "turn": f"to the left at {scenario.max_turn_rate:g} rad/s",
        "gripper": "above 0.5 it closes or holds, below -0.5 it opens, else it stays as it is",
        **dict.fromkeys(messages, "its radio tells its neighbours 1: it is there"),
    }
    return tuple(
        Output(
            name=name,
            kind=KINDS.get(name, ""),
            column=column,
            low=0.0 if name in messages else -1.0,
            high=1.0,
            high_means=meaning,
        )
        for column, (name, meaning) in enumerate(meanings.items())
    )


def check_rows(contract: Contract, rows: ArrayLike) -> None:
    """Check a robot's log: rows (T, D), one a period.

    Raises:
        RobotError: it is no table of that width, or a row of it cannot be: a number is not finite
            or beyond its limits, a flag is neither 0 nor 1, something is told although its flag
            says that there is nothing, or a block has a gap. Names the first such row, from 0 on,
            the input and its column.
    """
    try:
        table = np.asarray(rows, np.float32)
    except (TypeError, ValueError) as error:
        raise RobotError(f"rows: should be a table of numbers: {error}") from None
    if table.ndim != 2 or table.shape[1] != contract.width:
        raise RobotError(f"rows of shape {table.shape}: should be (T, {contract.width})")
    problems = [problem for part in contract.inputs for problem in _problems(contract, part, table)]
    if problems:
        number, column, name, words = min(problems)
        value = table[number, column]
        raise RobotError(f"row {number}: {name} in column {column} = {value:g}: {words}")


def _problems(
    contract: Contract, part: Input, table: NDArray[np.float32]
) -> Iterator[tuple[int, int, str, str]]:
    """Yield row, column, name and what would be right of the first number of each kind of fault."""
    values = table[:, part.columns]
    is_within = (values >= np.float32(part.low)) & (values <= np.float32(part.high))
    faults = {f"should be within [{part.low:g}, {part.high:g}]": ~is_within}
    if part.unit == "flag" and part.used:
        faults["should be 0 or 1"] = is_within & (values != 0) & (values != 1)
        if len(part.columns) > 1 and not part.flag:
            is_behind_gap = values[:, 1:] > values[:, :-1]
            faults["should be 0, as the one before is: the nearest come first"] = np.pad(
                is_behind_gap, ((0, 0), (1, 0))
            )
    if part.flag and part.absent is not None and part.used:
        flag = next(sensed for sensed in contract.inputs if sensed.name == part.flag)
        # A robot may leave out a flag that the policy does not use.
        is_absent = (table[:, flag.columns] == 0) & flag.used
        faults[f"should be {part.absent:g}, as {part.flag} is 0"] = (
            is_within & is_absent & (values != np.float32(part.absent))
        )
    for words, is_wrong in faults.items():
        if is_wrong.any():
            number, index = divmod(int(is_wrong.argmax()), len(part.columns))
            yield number, part.columns[index], part.name, words


def _yaml_lines(value: dict[str, Any], indent: str) -> Iterator[str]:
    """Yield the lines of a table; what has no tables in it is JSON, which is YAML as well."""
    for name, part in value.items():
        if isinstance(part, dict) and part:
            yield f"{indent}{name}:"
            yield from _yaml_lines(part, f"{indent}  ")
        elif isinstance(part, list) and part and isinstance(part[0], dict):
            yield f"{indent}{name}:"
            for table in part:
                first, *further = _yaml_lines(table, f"{indent}  ")
                yield f"{indent}- {first.strip()}"
                yield from further
        else:
            yield f"{indent}{name}: {json.dumps(part, ensure_ascii=False)}"
