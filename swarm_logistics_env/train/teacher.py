"""A teacher: a script that says, upon the rows of all worlds, what it would do in their place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.train.settings import Teaching
from swarm_logistics_env.world.motion.memory import MEMORY
from swarm_logistics_env.world.scenario import Scenario

_COMMANDED = ("heading_x", "heading_y", "held")  # what a robot remembers of its last command


class Teacher:
    """A script in each world, which senses and remembers on its own but does not command.

    What it remembers of its last command is that which the robot was given.

    Args:
        teaching: names the script.
        worlds: whose rows it reads.
    """

    def __init__(self, teaching: Teaching, worlds: SwarmVecEnv) -> None:
        self._scripts = [teaching.new_script for _ in worlds.worlds]
        self._rows = worlds.rows_of_worlds

    def begin(self, world: int, scenario: Scenario, keys: NDArray[np.uint64]) -> None:
        """Begin an episode in a world, of robots whose streams have these keys (N,)."""
        script = self._scripts[world]
        # It says where to drive. How robots on wheels turn there is up to the frame of motion.
        kinds = tuple(kind.replace(drive=None) for kind in scenario.robot_kinds)
        script.configure(scenario.replace(drive="holonomic", robot_kinds=kinds))
        script.begin(keys)

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return its commands (R, 4), once a control step, upon the rows of all worlds (R, D)."""
        commands = np.empty((len(observations), 4))
        for script, rows in zip(self._scripts, self._rows):
            commands[rows] = script.act(observations[rows])
        return commands

    def advise(
        self, observations: NDArray[np.float32], turned: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Act, and return the outputs (R, 3) that would command so, see `motion.OUTPUTS`.

        Args:
            turned: how far each row's frame of motion is turned from its robot's body (R,) [rad].
        """
        forward, left, _, gripper = self.act(observations).T
        cos = np.cos(turned)
        sin = np.sin(turned)
        return np.stack([cos * forward + sin * left, cos * left - sin * forward, gripper], axis=1)

    def note_commands(self, memories: NDArray[np.float64]) -> None:
        """Take what robots were commanded out of the memories (R, N_COLUMNS) of their frames."""
        for script, rows in zip(self._scripts, self._rows):
            remembered = script.memories()  # views of what the script remembers
            for name in _COMMANDED:
                remembered[name][:] = memories[rows, getattr(MEMORY, name)]
