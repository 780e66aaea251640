"""Episodes that the checks play through the dict methods, and the errors that checks raise."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from swarm_logistics_env.errors import SetupError
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.policy import Policy, decide, start
from swarm_logistics_env.warehouse import Warehouse


class ConformanceError(AssertionError):
    """An environment does not hold what this package promises of one."""


class DeterminismError(ConformanceError):
    """The same seed gave two trajectories."""


class SpaceError(ConformanceError):
    """An observation or a state that its space does not contain."""


class ConservationError(ConformanceError):
    """An item was lost, doubled or created."""


class OverlapError(ConformanceError):
    """Two robots stand in one place."""


class FaultsError(ConformanceError):
    """A failed robot did what it can no longer do, or nobody failed at all."""


Make = Callable[[], Any]


@dataclass(frozen=True)
class Moment:
    """What a reset or a step returned; `expected` are the agents that it should answer."""

    env: Any
    step: int
    expected: tuple[str, ...]
    observations: dict[str, Any]
    rewards: dict[str, float]
    terminations: dict[str, bool]
    truncations: dict[str, bool]

    @property
    def world(self) -> Warehouse:
        """The warehouse behind the environment and its wrappers."""
        world: Warehouse = self.env.unwrapped.warehouse
        return world


def played(make: Make, policy: Policy | str, seed: int, steps: int) -> Iterator[Moment]:
    """Yield the moments of one episode, until it ends or `steps` are over.

    Args:
        make: returns a new parallel environment: a `SwarmLogisticsEnv` in any wrappers.
        policy: the policy that plays: a name, a path, or the object.
        seed: the seed of the episode and of the policy.
        steps: the largest number of steps to play.

    Raises:
        SetupError: `make` returns no such environment.
        PolicyError: there is no such policy.
    """
    env = make()
    if not isinstance(getattr(env.unwrapped, "warehouse", None), Warehouse):
        raise SetupError(
            f"make() = {env}: should be a SwarmLogisticsEnv (swarm_logistics_v0.parallel_env), "
            "in any parallel wrappers"
        )
    chosen = load(policy) if isinstance(policy, str) else policy
    observations, _ = env.reset(seed=seed)
    world = env.unwrapped.warehouse
    start(chosen, world.scenario, seed)
    yield Moment(env, 0, tuple(env.agents), observations, {}, {}, {})
    for step in range(1, steps + 1):
        if not env.agents:
            break
        agents = tuple(env.agents)
        answer = env.step(_actions(env, chosen, observations))
        observations = answer[0]
        yield Moment(env, step, agents, *answer[:4])
    env.close()


def _actions(env: Any, policy: Policy, observations: dict[str, Any]) -> dict[str, Any]:
    world: Warehouse = env.unwrapped.warehouse
    length = len(next(iter(observations.values())))
    n_robots = world.state.n_robots
    # With `FixedAgents` there may be agents without a robot.
    n_rows = max(n_robots, 1 + max(robot_of(agent) for agent in observations))
    rows = np.zeros((n_rows, length), np.float32)
    for agent, observation in observations.items():
        rows[robot_of(agent)] = observation
    commands = np.asarray(decide(policy, rows[:n_robots], world.state))
    commands = np.pad(commands, ((0, n_rows - n_robots), (0, 0)))
    silent = env.action_space(env.agents[0]).shape[0] - commands.shape[1]
    if silent > 0:  # a policy that broadcasts no message
        commands = np.pad(commands, ((0, 0), (0, silent)))
    return {agent: commands[robot_of(agent)] for agent in env.agents}


def robot_of(agent: str) -> int:
    """Return the number of the robot with this name."""
    return int(agent.removeprefix("robot_"))
