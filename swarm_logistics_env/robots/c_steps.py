"""Steps of policies as C is made of them: the kernel that decides, its arguments, what is kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.register_blocks import NARROW
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.policies.homing import Homing
from swarm_logistics_env.policies.homing_stock import HomingStock
from swarm_logistics_env.policies.layers import Layers, run_network
from swarm_logistics_env.policies.learned import STREAM, LearnedPolicy
from swarm_logistics_env.policies.network_steps import decide
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.policies.row_policy import refuse_messages
from swarm_logistics_env.policies.swarm_dt import SwarmDT, decide_swarm_dt
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import OUTPUTS, command_rows, hold_rows
from swarm_logistics_env.world.motion.memory import N_COLUMNS
from swarm_logistics_env.world.scenario import Scenario

from .c_expressions import python_function
from .c_parts import table_text
from .c_values import DOUBLE, FLOAT, INT, REAL, WORD, ArrayOf, Function, Known, Value

N_COMMANDS = 4  # forward, left, turn, gripper

_UNIFORM_TEXT = """\
/* The output function of SplitMix64 (Steele, Lea, Flood 2014). */
static uint64_t mixed(uint64_t value) {
    value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
    value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
    return value ^ (value >> 31);
}

/* Return a number of a stream in [0, 1), with as many bits as a real holds. */
static real uniform(uint64_t key, int32_t counter) {
    const uint64_t bits = mixed(key + ((uint64_t)counter + 1u) * 0x9e3779b97f4a7c15u);
    return (real)(bits >> (64 - REAL_BITS)) / (real)((uint64_t)1 << REAL_BITS);
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
class Step:
    """A policy's step as C is made of it.

    Attributes:
        kernel: what fills the command of one row.
        arguments: its arguments, in the order of its parameters.
        state: what a robot keeps beside its key and its count: the arguments of such names.
        stream: the purpose of its random numbers.
        begin: statements of `swarm_reset` for the state.
        by_hand: functions that are not made of kernels.
    """

    kernel: Callable[..., Any]
    arguments: Sequence[Value | Known]
    state: Sequence[Value]
    stream: str
    begin: str = ""
    by_hand: Mapping[Callable[..., Any], Function] = field(default_factory=dict)


_ROW = Value("row", ArrayOf(FLOAT, (1, row.N_COLUMNS)), root="row")
_COMMAND = Value("driven", ArrayOf(REAL, (1, N_COMMANDS)), root="driven")
# Of double precision: the time since it first saw a wall, in steps of 0.1 s, is else a thousandth
# off after 100 s, and with it the direction that it remembers.
MEMORY = Value("robot->memory", ArrayOf(DOUBLE, (1, N_COLUMNS)), root="memory")
_OUTPUTS = Value("robot->outputs", ArrayOf(FLOAT, (1, len(OUTPUTS))), root="outputs")
KEY = Value("&robot->key", ArrayOf(WORD, (1,)), root="key")
_COUNT = Value("&robot->count", ArrayOf(INT, (1,)), root="count")
_TURNED = Value("&robot->turned", ArrayOf(DOUBLE, (1,)), root="turned")
_HEADING = Value("&robot->heading", ArrayOf(DOUBLE, (1,)), root="heading")


def step_of(policy: Policy, scenario: Scenario) -> Step:
    """Return the step of a policy that was configured for the scenario.

    Raises:
        PolicyError: none is known of this policy.
    """
    period = Known(scenario.control_period, "PERIOD", is_fixed=True)
    match policy:
        case LearnedPolicy():
            return _network_step(policy, period)
        case Homing() if type(policy) in (Homing, HomingStock):
            values = Known(policy._values, "values", is_fixed=True)
            of_homing = (_ROW, MEMORY, KEY, _COUNT, _TURNED, period, values, _COMMAND)
            return Step(policy._fill_commands, of_homing, (_TURNED, MEMORY), "homing")
        case SwarmDT():
            values = Known(policy._values, "values", is_fixed=True)
            constants = Known(policy._constants, "constants", is_fixed=True)
            count = Value("robot->count", INT)
            of_taxis = (_ROW, KEY, count, values, constants, _HEADING, _COMMAND)
            begin = "    robot->heading = NAN; /* until the first step */"
            return Step(decide_swarm_dt, of_taxis, (_HEADING,), "swarm D-T", begin)
    raise PolicyError(
        f"policy = {type(policy).__name__}: should be homing, homing-stock, a Swarm D-T or a "
        "trained policy, as no other one is written in C"
    )


def _network_step(policy: LearnedPolicy, period: Known) -> Step:
    network = policy.card.network
    refuse_messages(policy, "a controller in C")
    arguments = (
        _ROW, period, MEMORY, _COUNT, _TURNED, KEY, Known(network.listens, "LISTENS", True),
        Known(policy._layers, "layers", True), Known(policy._noise, "noise", True),
        Known(network.decides_every, "DECIDES_EVERY", True), _OUTPUTS, _COMMAND,
    )  # fmt: skip
    by_hand = {python_function(run_network): _network_function(policy)}
    return Step(act_network, arguments, (_TURNED, MEMORY, _OUTPUTS), STREAM, "", by_hand)


def act_network(
    rows: NDArray[np.float32],
    period: float,
    memories: NDArray[np.float64],
    counts: NDArray[np.int64],
    turned: NDArray[np.float64],
    keys: NDArray[np.uint64],
    listens: bool,
    layers: Layers,
    noise: NDArray[np.float32],
    decides_every: int,
    outputs: NDArray[np.float32],
    commands: NDArray[np.float64],
) -> None:
    """Fill the command of a step upon a row, as `network_steps.act_at` does; memory goes on."""
    if counts[0] % decides_every == 0:
        decide(
            rows, period, memories, counts, turned, keys, listens, layers, noise, outputs
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


UNIFORM = Function("uniform", REAL, ((0, WORD), (1, INT)), frozenset(), _UNIFORM_TEXT)
