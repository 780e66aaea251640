"""Steps of a trained network in compiled code: its inputs, layers, noise and commands.

What a policy keeps from step to step is found at one address, as each array that is handed to a
kernel costs a tenth of a microsecond.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import engine_kernel, gaussian, kernel, pair_key
from swarm_logistics_env.world.motion.frame import command_rows, hold_rows
from swarm_logistics_env.world.motion.network_inputs import read_observations
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
    deviations: Annotated[NDArray[np.float32], "n_outputs"]
    layers: Layers


@engine_kernel
def act_at(
    address: int, decides: bool, rows: NDArray[np.float32], commands: NDArray[np.float64]
) -> None:
    """Fill the commands (N, 4) of a step upon rows (N, D); the arrays at `address` go on.

    Args:
        decides: whether the network decides; if not, its last outputs keep their direction.
    """
    pack = unpacked_at(StepArrays, address)
    if decides:
        layers = Layers(pack.layers.weights, pack.layers.biases, pack.layers.widths)
        decide(
            rows, pack.period, pack.memories, pack.counts, pack.turned, pack.keys, pack.listens,
            layers, pack.deviations, pack.outputs,
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
    commands = np.empty((rows.shape[0], MESSAGE))
    now = world.commands.now
    now[:, MESSAGE:] = 0.0  # it broadcasts no messages
    for number in range(positions.shape[0]):
        act_at(address, (n_before + number) % decides_every == 0, rows, commands)
        now[:, :MESSAGE] = commands
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
    deviations: NDArray[np.float32],
    outputs: NDArray[np.float32],
) -> None:
    """Fill the network's outputs (N, k), with its noise, upon rows (N, D); memories go on."""
    inputs = np.empty((rows.shape[0], layers.widths[0]), np.float32)
    read_observations(rows, period, memories, keys, counts, listens, inputs, turned)
    counts += 1
    run_network(inputs, layers, outputs)
    if deviations.any():
        explore(keys, counts, deviations, outputs)


@kernel
def explore(
    keys: NDArray[np.uint64],
    counts: NDArray[np.int64],
    deviations: NDArray[np.float32],
    outputs: NDArray[np.float32],
) -> None:
    """Add Gaussian noise, from each robot's own stream, to `outputs` (N, k).

    Args:
        counts: the number of decisions of each robot (N,), this one among them.
    """
    for robot in range(outputs.shape[0]):
        for output in range(outputs.shape[1]):
            noise = gaussian(pair_key(keys[robot], output), counts[robot] - 1)
            outputs[robot, output] += np.float32(np.float64(deviations[output]) * noise)
