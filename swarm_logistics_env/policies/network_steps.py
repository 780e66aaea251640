"""Steps of a trained network in compiled code: its inputs, layers, noise and commands.

What a policy keeps from step to step is found at one address, as each array that is handed to a
kernel costs a tenth of a microsecond.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import (
    engine_kernel,
    gaussian,
    kernel,
    pair_key,
    uniform,
)
from swarm_logistics_env.world.motion.classes import (
    DIRECTIONS_ALONG,
    DIRECTIONS_ASIDE,
    N_CLASSES,
    N_DIRECTIONS,
    N_GRIPS,
    N_SPEEDS,
)
from swarm_logistics_env.world.motion.frame import N_OUTPUTS, command_rows, hold_rows
from swarm_logistics_env.world.motion.network_inputs import read_observations
from swarm_logistics_env.world.motion.voices import speak
from swarm_logistics_env.world.warehouse.commands import MESSAGE
from swarm_logistics_env.world.warehouse.stepping import step
from swarm_logistics_env.world.warehouse.structs import World

from .layers import Layers, run_network


class StepArrays(NamedTuple):
    """What a step reads and writes beside observations and commands."""

    period: float  # [s]
    listens: bool
    memories: Annotated[NDArray[np.float64], "n_robots", "n_columns"]
    keys: Annotated[NDArray[np.uint64], "n_robots"]
    counts: Annotated[NDArray[np.int64], "n_robots"]
    turned: Annotated[NDArray[np.float64], "n_robots"]
    outputs: Annotated[NDArray[np.float32], "n_robots", "n_outputs"]
    noise: Annotated[NDArray[np.float32], "n_noise"]  # as `decide` has it
    layers: Layers


@engine_kernel
def act_at(
    address: int, decides: bool, rows: NDArray[np.float32], commands: NDArray[np.float64]
) -> None:
    """Fill the commands (N, 4) of a step upon rows (N, D); the arrays at `address` go on.

    Of a network that talks, commands are (N, 4 + N_MESSAGES).

    Args:
        decides: whether the network decides; if not, its last outputs keep their direction.
    """
    pack = unpacked_at(StepArrays, address)
    if decides:
        layers = Layers(pack.layers.weights, pack.layers.biases, pack.layers.widths)
        decide(
            rows, pack.period, pack.memories, pack.counts, pack.turned, pack.keys, pack.listens,
            layers, pack.noise, pack.outputs,
        )  # fmt: skip
    else:
        hold_rows(rows, pack.period, pack.memories, pack.counts, pack.turned)
    command_rows(pack.outputs, pack.turned, rows, pack.memories, commands)


@engine_kernel
def play_at(
    address: int,
    world_address: int,
    n_before: int,
    decides_every: int,
    rows: NDArray[np.float32],
    positions: NDArray[np.float64],
) -> tuple[int, bool]:
    """Play steps in a world, see `LearnedPolicy._play_steps`.

    Args:
        n_before: steps since the reset of the policy.
    """
    world = unpacked_at(World, world_address)
    now = world.commands.now
    n_messages = unpacked_at(StepArrays, address).outputs.shape[1] - N_OUTPUTS
    n_columns = MESSAGE + n_messages
    commands = np.empty((rows.shape[0], n_columns))
    now[:, n_columns:] = 0.0  # it broadcasts no other messages
    for number in range(positions.shape[0]):
        act_at(address, (n_before + number) % decides_every == 0, rows, commands)
        now[:, :n_columns] = commands
        is_eventful = step(world_address, rows)
        positions[number] = world.robots.position
        if is_eventful:
            return number + 1, True
    return positions.shape[0], False


@kernel
def decide(
    rows: NDArray[np.float32],
    period: float,
    memories: NDArray[np.float64],
    counts: NDArray[np.int64],
    turned: NDArray[np.float64],
    keys: NDArray[np.uint64],
    listens: bool,
    layers: Layers,
    noise: NDArray[np.float32],
    outputs: NDArray[np.float32],
) -> None:
    """Fill the network's outputs (N, 3), with its noise, upon rows (N, D); memories go on.

    Of a network that talks, outputs are (N, 3 + N_MESSAGES).

    Args:
        noise: the deviation of each output; of a network that says classes their temperature alone.
    """
    inputs = np.empty((rows.shape[0], layers.widths[0]), np.float32)
    read_observations(rows, period, memories, keys, counts, listens, inputs, turned)
    counts += 1
    answers = np.empty((rows.shape[0], layers.widths[-1]), np.float32)
    run_network(inputs, layers, answers)
    if layers.widths[-1] >= N_CLASSES:
        choose_outputs(keys, counts, np.float64(noise[0]), answers, outputs)
    else:
        for robot in range(rows.shape[0]):
            for output in range(N_OUTPUTS):
                outputs[robot, output] = answers[robot, output]
        if noise.any():
            explore(keys, counts, noise, outputs)
    if outputs.shape[1] > N_OUTPUTS:
        speak(answers, N_OUTPUTS, outputs)


@kernel
def explore(
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    deviations: NDArray[np.float32],
    outputs: NDArray[np.float32],
) -> None:
    """Add Gaussian noise, from each robot's own stream, to `outputs` (N, 3).

    Args:
        counts: the number of decisions of each robot (N,), this one among them.
    """
    for robot in range(outputs.shape[0]):
        for output in range(N_OUTPUTS):
            noise = gaussian(pair_key(keys[robot], output), counts[robot] - 1)
            outputs[robot, output] += np.float32(np.float64(deviations[output]) * noise)


@kernel
def choose_outputs(
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    temperature: float,
    logits: NDArray[np.float32],
    outputs: NDArray[np.float32],
) -> None:
    """Fill outputs (N, 3) of the classes that logits say, see `motion.classes`.

    Args:
        counts: as `explore` has them.
        logits: (N, N_CLASSES), or with more behind them.
        temperature: what logits are divided by before a class of each group is drawn from their
            softmax, by a number of the robot's own stream; with 0 it is the likeliest.
    """
    for robot in range(outputs.shape[0]):
        robot_logits = logits[robot]
        key = keys[robot]
        number = counts[robot] - 1
        drawn = uniform(pair_key(key, 0), number)
        direction = choose(robot_logits, 0, N_DIRECTIONS, temperature, drawn)
        drawn = uniform(pair_key(key, 1), number)
        speed = choose(robot_logits, N_DIRECTIONS, N_SPEEDS, temperature, drawn) / (N_SPEEDS - 1)
        drawn = uniform(pair_key(key, 2), number)
        grip = choose(robot_logits, N_DIRECTIONS + N_SPEEDS, N_GRIPS, temperature, drawn)
        outputs[robot, 0] = speed * DIRECTIONS_ALONG[direction]
        outputs[robot, 1] = speed * DIRECTIONS_ASIDE[direction]
        outputs[robot, 2] = grip - 1.0


@kernel
def choose(
    logits: NDArray[np.float32], first: int, n_classes: int, temperature: float, drawn: float
) -> int:
    """Return the number of a class in its group, whose logits begin at `first`.

    Args:
        drawn: even in [0, 1).
    """
    likeliest = 0
    for index in range(n_classes):
        if logits[first + index] > logits[first + likeliest]:
            likeliest = index
    if temperature <= 0.0:
        return likeliest
    most = np.float64(logits[first + likeliest])
    total = 0.0
    for index in range(n_classes):
        total += math.exp((np.float64(logits[first + index]) - most) / temperature)
    left = drawn * total
    for index in range(n_classes):
        left -= math.exp((np.float64(logits[first + index]) - most) / temperature)
        if left < 0.0:
            return index
    return likeliest
