"""Policies as C: one file and a header, of one robot, for small processors.

The file is made of the kernels that decide in Python, so it does what they do, with `float` for
their `double`. It takes no memory but a structure of fixed size, and needs math.h alone.
"""

from __future__ import annotations

import copy
import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import uniform
from swarm_logistics_env.compiler.register_blocks import NARROW
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.homing_stock import HomingStock
from swarm_logistics_env.policies.layers import Layers, hyperbolic_tangent, run_network
from swarm_logistics_env.policies.learned import STREAM, LearnedPolicy
from swarm_logistics_env.policies.network_steps import decide
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.policies.swarm_dt import SwarmDT, decide_swarm_dt
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import OUTPUTS, command_rows, hold_rows
from swarm_logistics_env.world.motion.memory import BODY, N_COLUMNS, body_of, face_anywhere
from swarm_logistics_env.world.motion.network_inputs import random_heading_number
from swarm_logistics_env.world.scenario import Scenario

from .c_program import Program, table_text
from .c_sizes import description_of
from .c_statements import Function
from .c_values import FLOAT, INT, WORD, ArrayOf, Known, Value, number_text

N_COMMANDS = 4  # forward, left, turn, gripper

_UNIFORM_TEXT = """\
/* The output function of SplitMix64 (Steele, Lea, Flood 2014). */
static uint64_t mixed(uint64_t value) {
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
    return value ^ (value >> 31);
}

/* Return a number of a stream in [0, 1). It has 24 bits, as many as a float holds. */
static float uniform(uint64_t key, int32_t counter) {
    const uint64_t bits = mixed(key + ((uint64_t)counter + 1u) * 0x9e3779b97f4a7c15u);
    return (float)(bits >> 40) * 5.9604645e-08f;
}"""

_LAYER = f"""\
/* Fill a layer's sums; weights come in blocks of {NARROW} outputs, input by input. */
static void sum_layer(
        const float *inputs, int32_t n_inputs, const float *weights, const float *biases,
        int32_t n_outputs, float *outputs) {{
    for (int32_t output = 0; output < n_outputs; output += {NARROW}) {{
        float sums[{NARROW}];
        for (int32_t lane = 0; lane < {NARROW}; lane++) {{
            sums[lane] = biases[output + lane];
        }}
        for (int32_t input = 0; input < n_inputs; input++) {{
            for (int32_t lane = 0; lane < {NARROW}; lane++) {{
                sums[lane] += inputs[input] * weights[lane];
            }}
            weights += {NARROW};
        }}
        for (int32_t lane = 0; lane < {NARROW}; lane++) {{
            outputs[output + lane] = sums[lane];
        }}
    }}
}}"""


@dataclass(frozen=True)
class _Step:
    """A policy's step as C is made of it.

    Attributes:
        kernel: what fills the command of one row.
        arguments: its arguments, in the order of its parameters.
        state: what a robot keeps beside its key and its count, by name: how many floats; 0: one
            that is no array.
        stream: the purpose of its random numbers.
        begin: statements of `swarm_reset` for the state.
        by_hand: functions that are not made of kernels.
    """

    kernel: Callable[..., Any]
    arguments: Sequence[Value | Known]
    state: Mapping[str, int]
    stream: str
    begin: str = ""
    by_hand: Mapping[Callable[..., Any], Function] = field(default_factory=dict)


_ROW = Value("row", ArrayOf(FLOAT, (1, row.N_COLUMNS)), root="row")
_COMMAND = Value("command", ArrayOf(FLOAT, (1, N_COMMANDS)), root="command")
_MEMORY = Value("robot->memory", ArrayOf(FLOAT, (1, N_COLUMNS)), root="memory")
_OUTPUTS = Value("robot->outputs", ArrayOf(FLOAT, (1, len(OUTPUTS))), root="outputs")
_KEY = Value("&robot->key", ArrayOf(WORD, (1,)), root="key")
_COUNT = Value("&robot->count", ArrayOf(INT, (1,)), root="count")
_TURNED = Value("&robot->turned", ArrayOf(FLOAT, (1,)), root="turned")
_HEADING = Value("&robot->heading", ArrayOf(FLOAT, (1,)), root="heading")


def _step_of(policy: Policy, scenario: Scenario) -> _Step:
    """Return the step of a policy that was configured for the scenario.

    Raises:
        PolicyError: none is known of this policy.
    """
    period = Known(scenario.control_period, "PERIOD", is_fixed=True)
    motion = {"turned": 0, "memory": N_COLUMNS}
    match policy:
        case LearnedPolicy():
            return _network_step(policy, period, motion)
        case Homing() if type(policy) in (Homing, HomingStock):
            values = Known(policy._values, "values", is_fixed=True)
            arguments = (_ROW, _MEMORY, _KEY, _COUNT, _TURNED, period, values, _COMMAND)
            return _Step(policy._fill_commands, arguments, motion, "homing")
        case SwarmDT():
            values = Known(policy._values, "values", is_fixed=True)
            constants = Known(policy._constants, "constants", is_fixed=True)
            count = Value("robot->count", INT)
            arguments = (_ROW, _KEY, count, values, constants, _HEADING, _COMMAND)
            begin = "    robot->heading = NAN; /* until the first step */"
            return _Step(decide_swarm_dt, arguments, {"heading": 0}, "swarm D-T", begin)
    raise PolicyError(
        f"policy = {type(policy).__name__}: should be homing, homing-stock, a Swarm D-T or a "
        "trained policy, as no other one is written in C"
    )


def _network_step(policy: LearnedPolicy, period: Known, motion: Mapping[str, int]) -> _Step:
    network = policy.card.network
    arguments = (
        _ROW, period, _MEMORY, _COUNT, _TURNED, _KEY, Known(network.listens, "LISTENS", True),
        Known(policy._layers, "layers", True), Known(policy._deviations, "deviations", True),
        Known(network.decides_every, "DECIDES_EVERY", True), _OUTPUTS, _COMMAND,
    )  # fmt: skip
    state = {**motion, "outputs": len(OUTPUTS)}
    by_hand = {_python(run_network): _network_function(policy)}
    return _Step(act_network, arguments, state, STREAM, "", by_hand)


def act_network(
    rows: NDArray[np.float32],
    period: float,
    memories: NDArray[np.float64],
    counts: NDArray[np.int64],
    turned: NDArray[np.float64],
    keys: NDArray[np.uint64],
    listens: bool,
    layers: Layers,
    deviations: NDArray[np.float32],
    decides_every: int,
    outputs: NDArray[np.float32],
    commands: NDArray[np.float64],
) -> None:
    """Fill the command of a step upon a row, as `network_steps.act_at` does; memory goes on."""
    if counts[0] % decides_every == 0:
        decide(
            rows, period, memories, counts, turned, keys, listens, layers, deviations, outputs
        )  # fmt: skip
    else:
        hold_rows(rows, period, memories, counts, turned)
    command_rows(outputs, turned, rows, memories, commands)


def _network_function(policy: LearnedPolicy) -> Function:
    """Return the layers of a network as a function of C with its numbers."""
    widths = policy.card.network.widths
    tables = [_LAYER]
    lines = []
    source = "inputs"
    for layer, (n_in, n_out) in enumerate(pairwise(widths)):
        n_lanes = -(-n_out // NARROW) * NARROW
        weights = np.zeros((n_in, n_lanes), np.float32)
        weights[:, :n_out] = policy.tensors[f"layers.{layer}.weight"].T
        biases = np.zeros(n_lanes, np.float32)
        biases[:n_out] = policy.tensors[f"layers.{layer}.bias"]
        blocks = weights.reshape(n_in, -1, NARROW).transpose(1, 0, 2).ravel()
        tables += [table_text(f"WEIGHTS_{layer}", blocks), table_text(f"BIASES_{layer}", biases)]
        sums = f"sums_{layer}"
        lines.append(f"    float {sums}[{n_lanes}];")
        numbers = f"WEIGHTS_{layer}, BIASES_{layer}, {n_lanes}"
        lines.append(f"    sum_layer({source}, {n_in}, {numbers}, {sums});")
        is_last = layer == len(widths) - 2
        target = "outputs" if is_last else sums
        value = f"{sums}[index]" if is_last else f"hyperbolic_tangent({sums}[index])"
        lines.append(f"    for (int32_t index = 0; index < {n_out}; index++) {{")
        lines.append(f"        {target}[index] = {value};")
        lines.append("    }")
        source = sums
    head = "/* Fill the outputs of the network. */\nstatic void run_network"
    definition = "\n".join([f"{head}(const float *inputs, float *outputs) {{", *lines, "}"])
    parameters = (0, ArrayOf(FLOAT, (1, widths[0]))), (2, ArrayOf(FLOAT, (1, widths[-1])))
    text = "\n\n".join([*tables, definition])
    return Function("run_network", None, parameters, frozenset({2}), text)


def _python(kernel: Any) -> Callable[..., Any]:
    """Return the Python function of a kernel, compiled or not."""
    function: Callable[..., Any] = getattr(kernel, "py_func", kernel)
    return function


_UNIFORM = Function("uniform", FLOAT, ((0, WORD), (1, INT)), frozenset(), _UNIFORM_TEXT)


@dataclass(frozen=True)
class CFiles:
    """The files that were written; as text, what they take of a processor.

    Attributes:
        source: the .c file.
        header: the .h file, which says what there is to call.
        scenario: whose body and control period they hold.
    """

    source: Path
    header: Path
    scenario: Scenario

    def __str__(self) -> str:
        n_lines = len(self.source.read_text(encoding="utf-8").splitlines())
        written = f"{self.source} ({n_lines:,} lines) and {self.header.name}"
        return f"{written}\n{description_of(self.source, self.scenario)}"


def write_c(policy: Policy, scenario: Scenario, folder: Path | str) -> CFiles:
    """Write a policy as a file of C99 and its header, named after it.

    Args:
        policy: homing, homing-stock, a Swarm D-T or a trained policy; it stays as it is.
        scenario: of which the files hold the robot's body and the control period.
        folder: where the files go; files of these names are replaced.

    Raises:
        PolicyError: the policy cannot be written in C, or a file cannot be written.
    """
    configured: Any = copy.deepcopy(policy)
    if hasattr(configured, "configure"):
        configured.configure(scenario)
    step = _step_of(configured, scenario)
    program = Program(
        exact=[_python(random_heading_number)],
        functions={_python(uniform): _UNIFORM, **step.by_hand},
    )
    if step.by_hand:
        program.function(hyperbolic_tangent, [Value("x", FLOAT)])
    begin = step.begin
    if "memory" in step.state:
        face = program.function(face_anywhere, [_KEY, _MEMORY])
        body = ", ".join(number_text(number, FLOAT) for number in body_of(scenario))
        begin = _BEGIN_MEMORY.format(
            n_columns=N_COLUMNS, first=BODY.start, body=body, face=face.name
        )
    function = program.function(step.kernel, step.arguments)
    texts = ", ".join(step.arguments[number].text for number, _ in function.parameters)  # type: ignore[union-attr]
    call = f"{function.name}({texts});"
    if "heading" in step.state:
        call += "\n    robot->count++;"
    name = _file_name(policy)
    about = f"{policy!r}, for robots of this body and control period"
    header = _HEADER.format(
        about=about, columns=_columns_text(scenario), n_columns=row.N_COLUMNS, n_commands=N_COMMANDS, stream=step.stream,
        period=number_text(scenario.control_period, FLOAT), state=_fields(step.state),
    )  # fmt: skip
    source = _SOURCE.format(name=name, about=about, program=program.text(), begin=begin, call=call)
    files = CFiles(Path(folder) / f"{name}.c", Path(folder) / f"{name}.h", scenario)
    for path, text in ((files.header, header), (files.source, source)):
        with atomic_write(path, PolicyError) as part:
            part.write_text(text, encoding="utf-8")
    return files


def _fields(state: Mapping[str, int]) -> str:
    """Return the declarations of what a robot keeps."""
    lines = [
        f"    float {name}[{length}];" if length else f"    float {name};"
        for name, length in state.items()
    ]
    return "\n".join(lines)


def _columns_text(scenario: Scenario) -> str:
    """Return the lines of a comment that say what stands in which columns of a row."""
    lines = []
    for column in row.columns(scenario.replace(message_size=0)):
        numbers = range(row.N_COLUMNS)[column.columns]
        place = f"{numbers[0]}"
        if len(numbers) > 1:
            step = f", every {numbers.step}th" if numbers.step > 1 else ""
            place = f"{numbers[0]} to {numbers[-1]}{step}"
        text = f"{place}: {column.name} [{column.unit}], {column.meaning}"
        lines += textwrap.wrap(text, 94, initial_indent="  ", subsequent_indent="      ")
    return "\n".join(f" * {line}" for line in lines)


def _file_name(policy: Policy) -> str:
    name = policy.card.name if isinstance(policy, LearnedPolicy) else type(policy).__name__
    words = re.sub("(?<=[a-z])(?=[A-Z])", "_", name).lower()
    return re.sub(r"\W+", "_", words)


_BEGIN_MEMORY = """\
    static const float body[] = {{{body}}};
    for (int32_t column = 0; column < {n_columns}; column++) {{
        robot->memory[column] = column < {first} ? 0.0f : body[column - {first}];
    }}
    {face}(&robot->key, robot->memory);"""

_HEADER = """\
/* {about}.
 *
 * A robot is a swarm_robot, which its program sets up once by swarm_reset. Then it calls swarm_step
 * once a control period, with what the robot senses, and does what the command says.
 *
 * The columns of a row, of each thing in view the nearest first:
{columns}
 */
#ifndef SWARM_ROBOT_H
#define SWARM_ROBOT_H

#include <stdint.h>

#define SWARM_ROW {n_columns} /* numbers of a row: what a robot senses */
#define SWARM_COMMAND {n_commands} /* forward, left, turn, gripper: each from -1 to 1 */
#define SWARM_PERIOD {period} /* from one step to the next [s] */
#define SWARM_STREAM "{stream}" /* which random numbers of the simulator these are */

typedef struct swarm_robot {{
    uint64_t key; /* of its random numbers */
    int32_t count; /* of its steps */
{state}
}} swarm_robot;

/* Begin anew: `seed` is the same for all robots of a swarm, `number` counts them from 0. */
void swarm_reset(swarm_robot *robot, uint64_t seed, uint32_t number);

/* Fill the command upon a row. If a number in it is none, or is larger than 1e6, that is no row of
 * a robot's: the robot stands, leaves its gripper as it is, and remembers nothing of it. */
void swarm_step(swarm_robot *robot, const float row[SWARM_ROW], float command[SWARM_COMMAND]);

#endif
"""

_SOURCE = """\
/* {about}. Made of the kernels that decide in simulation. */
#include "{name}.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

{program}

void swarm_reset(swarm_robot *robot, uint64_t seed, uint32_t number) {{
    robot->key = mixed(seed + ((uint64_t)number + 1u) * 0x9e3779b97f4a7c15u);
    robot->count = 0;
{begin}
}}

void swarm_step(swarm_robot *robot, const float row[SWARM_ROW], float command[SWARM_COMMAND]) {{
    for (int32_t column = 0; column < SWARM_ROW; column++) {{
        /* Written so that what is no number fails, too. */
        if (!(fabsf(row[column]) <= 1e6f)) {{
            for (int32_t part = 0; part < SWARM_COMMAND; part++) {{
                command[part] = 0.0f;
            }}
            return;
        }}
    }}
    {call}
}}
"""
