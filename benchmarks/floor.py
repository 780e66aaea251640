"""The floor: the bodies of an episode alone; no sensing, no logistics.

Same robots, walls and items, same substeps, moved by the package's own physics. Robots want the
velocities that they wanted in the episode, and none ever carries an item.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.compiler.addresses import unpacked_at
from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.world.warehouse.physics import advance
from swarm_logistics_env.world.warehouse.structs import World

Numbers = NDArray[np.float64]


class Recording(NamedTuple):
    """A policy from seed 0: what it commanded and how fast that made the robots want to go."""

    scenario: Scenario
    commands: Numbers  # (T, N, 4)
    wanted_velocity: Numbers  # (T, N, 2) [m/s], world frame


def record(scenario: Scenario, n_steps: int, name: str = "swarm-dt") -> Recording:
    """Play the policy of that name for `n_steps` control steps."""
    world, policy = Warehouse(scenario), policies.load(name)
    observations = world.reset(seed=0)
    start(policy, scenario, seed=0)
    commands = np.zeros((n_steps, scenario.n_robots, 4))
    wanted = np.zeros((n_steps, scenario.n_robots, 2))
    for step in range(n_steps):
        commands[step] = policy.act(observations)
        observations = world.step(commands[step])
        wanted[step] = world._world.engine.wanted_velocity
    return Recording(scenario, commands, wanted)


class ForceFloor:
    """Bodies that replay the wanted velocities of a recording, driven by forces.

    `state` is (N, 4): x, y [m] and velocity [m/s] of every robot.
    """

    def __init__(self, recording: Recording) -> None:
        self._wanted = recording.wanted_velocity
        self._world = Warehouse(recording.scenario)
        self._world.reset(seed=0)
        self.state = self._world._world.engine.bodies

    def step(self, index: int) -> None:
        """Take control step `index` of the recording."""
        _drive_by_force(self._world.address, self._wanted[index])


@kernel
def _drive_by_force(address: int, wanted: Numbers) -> None:
    world = unpacked_at(World, address)
    world.engine.wanted_velocity[:] = wanted
    advance(world)
