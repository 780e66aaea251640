"""Several policies in one swarm."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies.code_identity import code_digest, identity
from swarm_logistics_env.policies.policy import Policy
from swarm_logistics_env.scenario import Scenario


class Mixed:
    """Plays the first robots with one policy, the next ones with another, and so on.

    A robot does what it would do upon the same observations in a swarm of its policy alone. A swarm
    of another size than all parts together is shared out in their proportion.

    Args:
        parts: policies, and how many robots play each.

    Raises:
        PolicyError: a part has no robots, or needs the state of the whole swarm.

    Example:
        >>> from swarm_logistics_env import policies
        >>> mixed = policies.load("swarm-dt=20,ppo-delivery=5")
        >>> mixed.rows(25), mixed.rows(10)
        ([slice(0, 20, None), slice(20, 25, None)], [slice(0, 8, None), slice(8, 10, None)])
    """

    def __init__(self, parts: Sequence[tuple[Policy, int]]) -> None:
        for policy, count in parts:
            if count < 1:
                raise PolicyError(
                    f"{count} robots with {type(policy).__name__}: should be at least 1"
                )
            if getattr(policy, "needs_state", False):
                raise PolicyError(
                    f"{type(policy).__name__} commands the whole swarm: should be a policy that "
                    "decides for each robot from its own observations"
                )
        self._policies = [policy for policy, _ in parts]
        self._counts = [count for _, count in parts]

    @property
    def identity(self) -> str:
        """What names its behaviour: that of each part, and how many robots play it."""
        parts = [[count, identity(policy)] for policy, count in zip(self._policies, self._counts)]
        kind: type = type(self)
        return json.dumps({"mixed": parts, "source": code_digest(kind)})

    def rows(self, n_robots: int) -> list[slice]:
        """Return the rows that each part plays in a swarm of this size."""
        shares = np.cumsum(self._counts) / sum(self._counts)
        ends = np.rint(shares * n_robots).astype(int).tolist()
        return [slice(start, end) for start, end in zip([0, *ends], ends)]

    def configure(self, scenario: Scenario) -> None:
        """Tell every part what a robot's maker knows."""
        for policy in self._policies:
            configure = getattr(policy, "configure", None)
            if configure is not None:
                configure(scenario)

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode."""
        # Each part has all rows, so that a robot's stream is that of its row.
        for policy in self._policies:
            policy.reset(n_robots, seed)
        self._rows = self.rows(n_robots)

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4), or (N, 4 + M) if a part broadcasts messages."""
        answers = [np.asarray(policy.act(observations)) for policy in self._policies]
        for policy, answer in zip(self._policies, answers):
            if answer.ndim != 2 or len(answer) != len(observations):
                raise PolicyError(
                    f"{type(policy).__name__} gave commands of shape {answer.shape}: should be "
                    f"({len(observations)}, 4)"
                )
        width = max(answer.shape[1] for answer in answers)
        commands = np.zeros((len(observations), width))
        for rows, answer in zip(self._rows, answers):
            commands[rows, : answer.shape[1]] = answer[rows]
        return commands
