"""Policies as C: one file and a header, of one robot, for small processors.

The file is made of the kernels that decide in Python, so it does what they do, with `float` for
their `double`: only what a robot remembers for minutes stays of double precision. Compiled with
SWARM_DOUBLE defined, all that is double in Python is double, so a run of it is the run in Python,
bit for bit. It takes no memory but a structure of fixed size, and needs math.h alone.
"""

from __future__ import annotations

import copy
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarm_logistics_env.compiler.kernels import uniform
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.records import atomic_write
from swarm_logistics_env.policies.layers import hyperbolic_tangent
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.policies.row_policy import refuse_kinds
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import BODY, N_COLUMNS, body_of, face_anywhere, fading
from swarm_logistics_env.world.motion.network_inputs import random_heading_number
from swarm_logistics_env.world.scenario import Scenario

from .c_expressions import python_function
from .c_program import Program
from .c_sizes import description_of
from .c_steps import KEY, MEMORY, N_COMMANDS, UNIFORM, step_of
from .c_values import DOUBLE, FLOAT, ArrayOf, Value, number_text


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


def write_c(policy: Policy, scenario: Scenario, path: Path | str) -> CFiles:
    """Write a policy as a file of C99, and its header beside it.

    Args:
        policy: homing, homing-stock, a Swarm D-T or a trained policy; it stays as it is.
        scenario: of which the files hold the robot's body and the control period.
        path: of the .c file; files of these names are replaced.

    Raises:
        PolicyError: the policy cannot be written in C, or a file cannot be written.
    """
    refuse_kinds(scenario, "a file in C")
    configured: Any = copy.deepcopy(policy)
    if hasattr(configured, "configure"):
        configured.configure(scenario)
    step = step_of(configured, scenario)
    program = Program(
        exact=[python_function(random_heading_number), python_function(fading)],
        functions={python_function(uniform): UNIFORM, **step.by_hand},
    )
    if step.by_hand:
        program.function(hyperbolic_tangent, [Value("x", FLOAT)])
    begin = step.begin
    if MEMORY in step.state:
        face = program.function(face_anywhere, [KEY, MEMORY])
        body = ", ".join(number_text(number, DOUBLE) for number in body_of(scenario))
        begin = _BEGIN_MEMORY.format(
            n_columns=N_COLUMNS, first=BODY.start, body=body, face=face.name
        )
    function = program.function(step.kernel, step.arguments)
    texts = ", ".join(step.arguments[number].text for number, _ in function.parameters)  # type: ignore[union-attr]
    call = f"{function.name}({texts});"
    if MEMORY not in step.state:
        call += "\n    robot->count++;"
    files = CFiles(Path(path), Path(path).with_suffix(".h"), scenario)
    about = f"{policy!r}, for robots of this body and control period"
    header = _HEADER.format(
        about=about, columns=_columns_text(scenario), n_columns=row.N_COLUMNS,
        n_commands=N_COMMANDS, stream=step.stream, state=_fields(step.state),
        period=number_text(scenario.control_period, FLOAT),
    )  # fmt: skip
    source = _SOURCE.format(
        name=files.source.stem, about=about, program=program.text(), begin=begin, call=call
    )
    for file, text in ((files.header, header), (files.source, source)):
        with atomic_write(file, PolicyError) as part:
            part.write_text(text, encoding="utf-8")
    return files


def _fields(state: Sequence[Value]) -> str:
    """Return the declarations of what a robot keeps."""
    lines = []
    for value in state:
        assert isinstance(value.kind, ArrayOf)
        length = f"[{value.kind.shape[1]}]" if len(value.kind.shape) > 1 else ""
        lines.append(f"    {value.kind.element.name} {value.root}{length};")
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


_BEGIN_MEMORY = """\
    static const double body[] = {{{body}}};
    for (int32_t column = 0; column < {n_columns}; column++) {{
        robot->memory[column] = column < {first} ? 0.0 : body[column - {first}];
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

#ifdef __cplusplus
extern "C" {{
#endif

#define SWARM_ROW {n_columns} /* numbers of a row: what a robot senses */
#define SWARM_COMMAND {n_commands} /* forward, left, turn, gripper: each from -1 to 1 */
#ifdef SWARM_DOUBLE
#define SWARM_NUMBER double /* of a command; decided to the bit as in simulation */
#else
#define SWARM_NUMBER float /* of a command */
#endif
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
void swarm_step(swarm_robot *robot, const float row[SWARM_ROW],
                SWARM_NUMBER command[SWARM_COMMAND]);

#ifdef __cplusplus
}}
#endif

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

void swarm_step(swarm_robot *robot, const float row[SWARM_ROW],
                SWARM_NUMBER command[SWARM_COMMAND]) {{
    for (int32_t column = 0; column < SWARM_ROW; column++) {{
        /* Written so that what is no number fails, too. */
        if (!(fabsf(row[column]) <= 1e6f)) {{
            for (int32_t part = 0; part < SWARM_COMMAND; part++) {{
                command[part] = 0;
            }}
            return;
        }}
    }}
    real driven[SWARM_COMMAND];
    {call}
    for (int32_t part = 0; part < SWARM_COMMAND; part++) {{
        command[part] = driven[part];
    }}
}}
"""
