"""Policies that decide from rows alone, and one robot that such a policy steers."""

from __future__ import annotations

import copy
import math
import operator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.world.observations import columns_of_battery, n_columns
from swarm_logistics_env.world.scenario import LARGEST, Scenario

# Streams count modulo 2**64, and kernels divide as IEEE 754 says; the interpreter would warn of it.
_as_compiled = np.errstate(over="ignore", divide="ignore")


# Columns that only `charging_robots` reads.
OF_BATTERY = frozenset(column.name for column in columns_of_battery(Scenario(battery=LARGEST)))
# Columns that no other policy of this package reads.
UNREAD = frozenset(
    {
        "range_robots",
        "range_items",
        "neighbour_timer_heard",
        "neighbour_timer",
        "neighbour_message",
        *OF_BATTERY,
    }
)


class RowPolicy:
    """A policy whose robots share nothing: each decides from its own row, memory and stream.

    So `robot` gives the same commands as its row in a swarm.

    Attributes:
        stream: what the random numbers are for; robot i draws from the stream of
            `row_keys(seed, stream, n)[i]`.
        ignores: the columns of a row that never change a command (`observations.Column.name`).
        messages: the names of the numbers behind its commands that each robot broadcasts.
    """

    stream: str
    ignores: frozenset[str] = frozenset()
    messages: tuple[str, ...] = ()

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows; what was begun before is not changed."""
        raise NotImplementedError

    def fit_to(self, swarm: Scenario) -> None:
        """Take what all robots of a swarm share, of whatever kind one is; most take nothing."""

    def begin(self, keys: NDArray[np.uint64]) -> None:
        """Begin an episode of robots whose streams have these keys (N,)."""
        raise NotImplementedError

    def memories(self) -> dict[str, NDArray[Any]]:
        """Return all that robots remember, by name: a number for each robot (N,)."""
        raise NotImplementedError

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4) for observation rows (N, D), with `messages` behind them."""
        raise NotImplementedError

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode of `n_robots` rows; see `begin`."""
        self.begin(row_keys(seed, self.stream, n_robots))


def check_row_policy(policy: object) -> RowPolicy:
    """Return `policy`, which has to decide from rows alone.

    Raises:
        PolicyError: it does not, or nobody can tell.
    """
    name = type(policy).__name__
    if getattr(policy, "needs_state", False):
        raise PolicyError(
            f"policy = {name}: sees the state of the whole warehouse, which no robot does; should "
            'decide from rows alone, as policies.load("homing") does'
        )
    if not isinstance(policy, RowPolicy):
        raise PolicyError(
            f"policy = {name}: should be a script or a trained policy of this package "
            "(policies.row_policy.RowPolicy), as of others nobody can tell what robots share"
        )
    return policy


def refuse_kinds(scenario: Scenario, what: str) -> None:
    """Refuse a scenario with robots of several kinds for what holds one body.

    Raises:
        PolicyError: it has some.
    """
    if scenario.robot_kinds:
        names = ", ".join(kind.name for kind in scenario.robot_kinds)
        raise PolicyError(
            f"robot_kinds = {names}: {what} is for one body: should be of scenario.of_robot(i), "
            "where robot i is of the kind that is meant"
        )


def refuse_messages(policy: object, what: str) -> None:
    """Refuse a policy whose robots tell each other messages for what carries none.

    Raises:
        PolicyError: they do.
    """
    messages = getattr(policy, "messages", ())
    if messages:
        raise PolicyError(
            f"policy = {policy!r}: its robots tell each other {' and '.join(messages)}, and {what} "
            "carries no messages: should be a policy that tells none"
        )


class Robot:
    """One robot that a policy steers, with a frame, a memory and random numbers of its own.

    It gives the commands that the policy gives to its row in a swarm: the same bits where kernels
    are compiled, and within 1e-6 where numba is missing.

    Args:
        policy: which is copied, so that it may steer others as well.
        body: a scenario, of which the policy reads what a robot's maker knows. Most read the body
            and its drive, some also how many robots and items there are, so no smaller record does.
            Of several kinds it reads that of the robot's number.
        period: the time from one step to the next [s].
        seed: with `number` it decides all that is random.
        number: of the robot in its swarm, from 0 on.

    Attributes:
        body: as given, with the period and with the body of this robot's kind.

    Raises:
        PolicyError: the policy does not decide from rows alone, or there is no such number.
        ScenarioError: a scenario cannot have that period.
    """

    @_as_compiled
    def __init__(
        self, policy: object, body: Scenario, period: float, seed: int, number: int = 0
    ) -> None:
        if operator.index(number) < 0:
            raise PolicyError(f"number = {number}: should be 0 or more")
        self._policy = copy.copy(check_row_policy(policy))  # configured, it shares constants alone
        swarm = body
        self.body = body = body.of_robot(number)
        if period != body.control_period:
            # Nobody plays physics here, and a scenario wants whole steps of it.
            substeps = max(math.ceil(period / body.physics_period), 1)
            self.body = body.replace(control_period=period, physics_period=period / substeps)
        self._width = n_columns(body)
        self._policy.configure(self.body)
        self._policy.fit_to(swarm)
        self._policy.begin(row_keys(seed, self._policy.stream, number + 1)[number:])

    @property
    def memory(self) -> dict[str, float]:
        """All that it remembers, by name."""
        return {name: float(value[0]) for name, value in self._policy.memories().items()}

    @_as_compiled
    def step(self, row: ArrayLike) -> NDArray[np.float64]:
        """Return the command (4,) upon what it senses now, once a period, its messages behind it.

        Args:
            row: of `n_columns(body)` numbers, see `observations.columns`.

        Returns:
            Forward, left, turn and gripper, each in [-1, 1], then `messages`.

        Raises:
            PolicyError: the row has another length, or a number in it is not finite. The memory
                stays as it was.
        """
        try:
            sensed = np.ascontiguousarray(row, np.float32)
        except (TypeError, ValueError) as error:
            raise PolicyError(f"row: should be numbers: {error}") from None
        if sensed.shape != (self._width,):
            raise PolicyError(f"row of shape {sensed.shape}: should be ({self._width},)")
        if not np.isfinite(sensed).all():
            column = int(np.argmin(np.isfinite(sensed)))
            raise PolicyError(f"row[{column}] = {sensed[column]}: should be finite")
        command: NDArray[np.float64] = self._policy.act(sensed[np.newaxis])[0]
        return command
