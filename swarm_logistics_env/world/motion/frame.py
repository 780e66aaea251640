"""A robot's motion: network inputs from observation rows, and commands from a network's outputs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import inlined_kernel, kernel
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import (
    BODY,
    N_COLUMNS,
    MemoryColumns,
    bodies_of,
    face_anywhere,
    length_of,
    note_command,
    remember_observation,
    to_frame,
)
from swarm_logistics_env.world.motion.steering import clear_the_way, steer
from swarm_logistics_env.world.motion.voices import N_MESSAGES
from swarm_logistics_env.world.scenario import Scenario

from .network_inputs import COSINES, SINES, TURNS, input_names, read_observations

OUTPUTS = ("along", "aside", "gripper")
N_OUTPUTS = len(OUTPUTS)


class MotionView:
    """Makes network inputs from observation rows, and commands from outputs, row by row.

    Each row has a memory of its own (see `memory`), begun anew by `begin`.

    Args:
        scenario: for its control period and for what robots know of their bodies.
        listens: whether the lowest timer heard is read; zeros if not, so that no liar leads.
        has_role: whether `ROLE_INPUTS` stand behind `INPUTS`.
        talks: whether rows have messages, `VOICE_INPUTS` stand behind all other inputs, and
            `MESSAGES` behind the outputs.
        sees_items: whether `SIGHT_INPUTS` stand right behind `INPUTS`.

    Attributes:
        keys: of each row's stream (N,).
        counts: the decisions of each row in its episode so far (N,).
        period: the scenario's control period [s].
        rows: the observations last read (N, D).
        turned: how far each row's frame is turned from its robot's body (N,) [rad].
    """

    def __init__(
        self,
        scenario: Scenario,
        listens: bool = True,
        has_role: bool = False,
        talks: bool = False,
        sees_items: bool = False,
    ) -> None:
        self.period = scenario.control_period
        self._bodies = bodies_of(scenario)
        self._listens = listens
        self._n_columns = row.MESSAGES + (row.N_NEIGHBOURS * N_MESSAGES if talks else 0)
        self._n_inputs = len(input_names(has_role, talks, sees_items))
        self.begin(np.empty(0, np.uint64))

    def begin(self, keys: NDArray[np.uint64], bodies: NDArray[np.float64] | None = None) -> None:
        """Begin an episode of as many rows as there are keys, which are those of their streams.

        Args:
            bodies: (N, 4) of robots that are not all as the scenario has them (`memory.body_of`);
                else row i is robot i, which may be of a kind.
        """
        n = len(keys)
        self.keys = np.empty(n, np.uint64)
        self.counts = np.empty(n, np.int64)
        self.memory = np.empty((n, N_COLUMNS))
        self.turned = np.zeros(n)
        self.begin_rows(np.arange(n), keys, bodies)

    def begin_rows(
        self,
        rows: NDArray[np.int64],
        keys: NDArray[np.uint64],
        bodies: NDArray[np.float64] | None = None,
    ) -> None:
        """Begin an episode in these rows alone."""
        self.keys[rows] = keys
        self.counts[rows] = 0
        fresh = np.zeros((len(rows), N_COLUMNS))
        fresh[:, BODY] = self._bodies[rows % len(self._bodies)] if bodies is None else bodies
        face_anywhere(keys, fresh)
        self.memory[rows] = fresh

    def memories(self) -> dict[str, NDArray[Any]]:
        """Return what is remembered, by the names of `MemoryColumns`, and counted: (N,) each."""
        columns = zip(MemoryColumns._fields, self.memory.T, strict=True)
        return {**dict(columns), "turned_by": self.turned, "decisions": self.counts}

    def read(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the inputs (N, k) of the next decision; memories and time go on.

        Raises:
            PolicyError: there are more or fewer rows than keys at `begin`, or columns are missing.
        """
        self.check(observations)
        inputs = self._inputs(observations, self.memory, self.keys, self.counts, self.turned)
        self.counts += 1
        self.rows = observations
        return inputs

    def hold(self, observations: NDArray[np.float32]) -> None:
        """Let memories and time go on between two decisions; outputs keep their direction.

        Raises:
            PolicyError: there are more or fewer rows than keys at `begin`, or columns are missing.
        """
        self.check(observations)
        hold_rows(observations, self.period, self.memory, self.counts, self.turned)
        self.rows = observations

    def check(self, observations: NDArray[np.float32]) -> None:
        """Raise PolicyError if there are more or fewer rows than keys, or columns are missing."""
        if len(observations) != len(self.keys):
            raise PolicyError(
                f"observations of {len(observations)} robots: reset was told {len(self.keys)}"
            )
        if observations.shape[1] < self._n_columns:
            raise PolicyError(
                f"observations of {observations.shape[1]} columns: should be at least "
                f"{self._n_columns}"
            )

    def peek(
        self, observations: NDArray[np.float32], rows: NDArray[np.int64]
    ) -> NDArray[np.float32]:
        """Return the inputs that observations of these rows would make, without going on."""
        memory = self.memory[rows]
        keys = self.keys[rows]
        counts = self.counts[rows]
        return self._inputs(observations, memory, keys, counts, np.empty(len(rows)))

    def _inputs(
        self,
        observations: NDArray[np.float32],
        memory: NDArray[np.float64],
        keys: NDArray[np.uint64],
        counts: NDArray[np.int64],
        turned: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        inputs = np.empty((len(observations), self._n_inputs), np.float32)
        period = self.period
        listens = self._listens
        read_observations(observations, period, memory, keys, counts, listens, inputs, turned)
        return inputs

    def command(self, outputs: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return the commands (N, 4) that outputs (N, 3) ask for upon the rows last read.

        A robot that is caged by items clears its way instead.
        A differential robot turns its body to where it wants to drive. Messages behind the outputs
        stand behind the commands.
        """
        commands = np.empty((len(outputs), outputs.shape[1] + 1))
        command_rows(outputs, self.turned, self.rows, self.memory, commands)
        return commands


@kernel
def hold_rows(
    rows: NDArray[np.float32],
    period: float,
    memories: NDArray[np.float64],
    counts: NDArray[np.int64],
    turned: NDArray[np.float64],
) -> None:
    """Take what rows (N, D) tell into the memories; count, and let frames stay as bodies turn."""
    remember_observation(rows, period, memories)
    for robot in range(rows.shape[0]):
        turned[robot] -= np.float32(period) * rows[robot, row.TURN_RATE]
        counts[robot] += 1


@kernel
def command_rows(
    outputs: NDArray[np.floating],
    turned: NDArray[np.float64],
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
    commands: NDArray[np.float64],
) -> None:
    """Fill the commands (N, 4) of outputs (N, 3) upon rows; memories take note of them.

    Messages behind the outputs stand behind the commands.
    """
    for robot in range(outputs.shape[0]):
        along = float(outputs[robot, 0])
        aside = float(outputs[robot, 1])
        gripper = float(outputs[robot, 2])
        turn_outputs(along, aside, gripper, turned[robot], commands[robot])
        finish_command(rows[robot], memories[robot], commands[robot])
        if outputs.shape[1] > N_OUTPUTS:
            commands[robot, N_OUTPUTS + 1 :] = outputs[robot, N_OUTPUTS:]  # a turn is between


@kernel
def command_own_frames(
    commands: NDArray[np.float64],
    turned: NDArray[np.float64],
    rows: NDArray[np.float32],
    memories: NDArray[np.float64],
) -> None:
    """Do as `command_rows` with commands (N, 4) in the robots' own frames; turns are left out."""
    for robot in range(commands.shape[0]):
        beams = round(turned[robot] / (2.0 * math.pi / row.N_BEAMS))
        x = commands[robot, 0]
        y = commands[robot, 1]
        gripper = commands[robot, 3]
        # There and back: outputs are clipped in the frame of motion.
        along, aside = to_frame((COSINES[beams], SINES[beams]), x, y)
        turn_outputs(along, aside, gripper, turned[robot], commands[robot])
        finish_command(rows[robot], memories[robot], commands[robot])


@inlined_kernel
def finish_command(
    sensed: NDArray[np.float32],
    memory: NDArray[np.float64],
    command: NDArray[np.float64],
) -> None:
    """Change a command (4,) where the robot is caged, and take note of it."""
    clear_the_way(sensed, memory, command)
    note_command(sensed, command, memory)
    steer(memory, command)


@kernel
def turn_outputs(
    along: float, aside: float, gripper: float, turned: float, command: NDArray[np.float64]
) -> None:
    """Fill the command (4,) of outputs; clipped, no turn."""
    along = min(max(along, -1.0), 1.0)
    aside = min(max(aside, -1.0), 1.0)
    longer = max(length_of(along, aside), 1.0)
    cosine, sine = cosine_and_sine(turned)
    x, y = to_frame((cosine, -sine), along, aside)
    command[0] = x / longer
    command[1] = y / longer
    command[2] = 0.0
    command[3] = min(max(gripper, -1.0), 1.0)


@inlined_kernel
def cosine_and_sine(turned: float) -> tuple[float, float]:
    """Return those of a frame's turn [rad], out of a table if it is turned by whole beams."""
    beams = round(turned / (2.0 * math.pi / row.N_BEAMS))
    if 0 <= beams < row.N_BEAMS and turned == TURNS[beams]:
        return COSINES[beams], SINES[beams]
    return math.cos(turned), math.sin(turned)
