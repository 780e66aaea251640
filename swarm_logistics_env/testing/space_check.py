"""What an environment returns lies in the spaces that it announces."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box

from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.testing.playing import Make, Moment, SpaceError, played


def check_spaces(
    make: Make, policy: Policy | str = "swarm-dt", seed: int = 0, steps: int = 200
) -> None:
    """Check that every agent gets a float32 observation in its space, and the state is in its own.

    Args:
        make: returns a new parallel environment.
        policy: the policy that plays: a name, a path, or the object.
        seed: the episode's seed.
        steps: the largest number of steps to play.

    Raises:
        SpaceError: the first value, and the bounds it should be within.
    """
    spaces: dict[str, Box] = {}
    for moment in played(make, policy, seed, steps):
        _check_agents(moment)
        for agent, observation in moment.observations.items():
            space = moment.env.observation_space(agent)
            if spaces.setdefault(agent, space) != space:
                raise SpaceError(f"{agent}'s observation space changed before step {moment.step}")
            _check(observation, space, f"{agent}'s observation", moment.step)
        _check(moment.env.state(), moment.env.state_space, "the state", moment.step)


def _check_agents(moment: Moment) -> None:
    got, expected = set(moment.observations), set(moment.expected)
    if got != expected:
        raise SpaceError(
            f"step {moment.step} answers {sorted(got)}: should be the agents {sorted(expected)}"
        )
    if strangers := expected - set(moment.env.possible_agents):
        raise SpaceError(f"agents {sorted(strangers)} should be among possible_agents")


def _check(value: Any, space: Box, what: str, step: int) -> None:
    if not isinstance(value, np.ndarray) or value.dtype != np.float32:
        kind = getattr(value, "dtype", type(value).__name__)
        raise SpaceError(f"{what} at step {step} is {kind}: should be an array of float32")
    if value.shape != space.shape:
        raise SpaceError(f"{what} at step {step} is {value.shape}: should be {space.shape}")
    outside = np.argwhere(~((value >= space.low) & (value <= space.high)))
    if len(outside):
        place = tuple(outside[0].tolist())
        raise SpaceError(
            f"{what} at step {step} leaves its space: entry {place} = {value[place]}, should be "
            f"within [{space.low[place]}, {space.high[place]}]"
        )
