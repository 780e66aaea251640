"""Two checks: for a policy of one's own, and for wrappers of one's own.

Each plays short episodes and raises CheckError with a sentence about the first thing that is wrong.

Example:
    >>> from swarm_logistics_env.policies import testing
    >>> testing.check_policy("swarm-dt", steps=20)
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator
from itertools import zip_longest
from typing import Any

import numpy as np
from gymnasium.spaces import Box

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.episode import Play
from swarm_logistics_env.policies.policy import Policy, decide, start
from swarm_logistics_env.world.scenario import Scenario

Moment = dict[str, Any]  # what each agent got at one moment


class CheckError(AssertionError):
    """A policy or a wrapper does not hold what the package needs of it."""


def check_policy(
    policy: Policy | str, scenario: Scenario | None = None, seed: int = 0, steps: int = 200
) -> None:
    """Check that a policy's commands can be taken, and that they follow from the seed alone.

    It plays an episode, another one with another seed, the first one again, and the first one with
    a pickled copy, as worker processes need it.

    Args:
        policy: a name, a path, or the object.
        scenario: None: the paper's.
        steps: the largest number of steps to play.

    Raises:
        CheckError: two episodes of one seed part; it names the first step.
        PolicyError: commands of the wrong shape, or not finite.
    """
    player = load(policy) if isinstance(policy, str) else policy
    conditions = scenario or Scenario()

    def trajectory(player: Policy, seed: int) -> list[bytes]:
        play = Play(conditions, player, seed)
        positions: list[bytes] = []
        while not play.is_over and len(positions) < steps:
            play.step()
            positions.append(play.world.state.robot_position.tobytes())
        return positions

    first = trajectory(player, seed)
    trajectory(player, seed + 1)
    _compare(first, trajectory(player, seed), "after another episode: reset should forget it")
    copy = pickle.loads(pickle.dumps(player))
    _compare(first, trajectory(copy, seed), "with a pickled copy of the policy")


def check_wrapper(
    make: Callable[[], Any], policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 200
) -> None:
    """Check that a wrapped environment keeps to its spaces, and that a seed fixes its episode.

    Args:
        make: returns a new `SwarmLogisticsEnv` in any parallel wrappers.
        policy: who plays: a name, a path, or the object. Where actions are no commands of the
            warehouse they are drawn.
        steps: the largest number of steps to play.

    Raises:
        CheckError: an agent without an observation, an observation outside of its space, or two
            episodes of one seed that part.
    """
    first = list(_moments(make(), policy, seed, steps))
    second, third = (_moments(make(), policy, s, steps) for s in (seed, seed + 1))
    # Both worlds live at the same time; the third has another seed and is not looked at.
    moments = [moment for moment, _ in zip_longest(second, third)][: len(first)]
    _compare(first, moments, "beside another live world")


def _moments(env: Any, policy: Policy | str, seed: int, steps: int) -> Iterator[Moment]:
    if not isinstance(env.unwrapped, SwarmLogisticsEnv):
        raise CheckError(f"make() = {env}: should be a SwarmLogisticsEnv in parallel wrappers")
    player = load(policy) if isinstance(policy, str) else pickle.loads(pickle.dumps(policy))
    observations, _ = env.reset(seed=seed)
    world = env.unwrapped.warehouse
    start(player, world.scenario, seed)
    for step in range(steps):
        yield _check_observations(env, step, observations)
        if not env.agents:
            return
        rows = world.observe()
        commands = np.asarray(decide(player, rows, world.state))
        actions = {}
        for agent in env.agents:
            robot = int(agent.removeprefix("robot_"))
            space = env.action_space(agent)
            if space != env.unwrapped.action_space(agent):  # it has a form of commands of its own
                space.seed(step)
                actions[agent] = space.sample()
                continue
            actions[agent] = np.zeros(space.shape, np.float32)
            if robot < len(commands):  # with FixedAgents there are agents without a robot
                actions[agent][: commands.shape[1]] = commands[robot]
        observations, rewards, *_ = env.step(actions)
        yield {agent: repr(reward) for agent, reward in rewards.items()}


def _check_observations(env: Any, step: int, observations: Moment) -> Moment:
    for agent in env.agents:
        fault = _fault_of(observations.get(agent), env.observation_space(agent))
        if fault:
            raise CheckError(f"{agent}'s observation at step {step} {fault}")
    return {agent: value.tobytes() for agent, value in observations.items()}


def _fault_of(observation: Any, space: Box) -> str:
    """Return what is wrong with an observation, in words; empty: nothing."""
    if not isinstance(observation, np.ndarray):
        return f"is {observation!r:.80}: should be an array"
    if observation.shape != space.shape or not np.can_cast(observation.dtype, space.dtype):
        return (
            f"has shape {observation.shape} and type {observation.dtype}: should have "
            f"{space.shape} and {space.dtype}, as observation_space says; a wrapper that adds "
            "numbers overrides that, too"
        )
    is_outside = ~((space.low <= observation) & (observation <= space.high))
    if not is_outside.any():
        return ""
    places = np.argwhere(is_outside)
    first = tuple(places[0].tolist())
    more = f", and {len(places) - 1} more columns" if len(places) > 1 else ""
    return (
        f"has {observation[first]} in column {', '.join(map(str, first))}{more}: should be "
        f"{space.low[first]} to {space.high[first]}, as observation_space says"
    )


def _compare(first: list[Any], second: list[Any], situation: str) -> None:
    for step, (moment, other) in enumerate(zip_longest(first, second)):
        if moment != other:
            raise CheckError(
                f"the same seed gives another episode {situation}: they part at {step}"
            )
