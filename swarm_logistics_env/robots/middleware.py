"""Middleware between a world and its robots: rows and commands that come late or are lost.

All of it happens in simulated time and is drawn from the run's seed, so a run can be repeated.
"""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from swarm_logistics_env.core.errors import RobotError
from swarm_logistics_env.core.records import Record
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.policies.catalogue import load
from swarm_logistics_env.policies.row_policy import Robot, check_row_policy, refuse_messages
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.commands import MESSAGE

Row = NDArray[np.float32]


class Middleware(Record):
    """What happens to a message, be it a row or a command.

    Args:
        loss: the probability that it never arrives.
        delay: the time that it takes [s].
        jitter: it takes up to so much longer [s], uniformly.
        stop_after: a robot whose newest command answers a row older than so many control periods
            stops; until then it obeys that command. Its gripper holds what it holds.

    Raises:
        RobotError: a number is out of its range.
    """

    error_type = RobotError

    loss: float = Field(0.0, ge=0.0, le=1.0)
    delay: float = Field(0.0, ge=0.0, allow_inf_nan=False)
    jitter: float = Field(0.0, ge=0.0, allow_inf_nan=False)
    stop_after: int = Field(5, ge=1)


class Arrival(NamedTuple):
    """A row that arrives at a robot.

    Attributes:
        robot: its number.
        period: the control period in which it was sensed, from 0 on.
        row: (D,).
    """

    robot: int
    period: int
    row: Row


class Link:
    """Carries rows to the robots of a swarm, and commands back.

    In each control period call `deliver`, then `answer` for each arrival, then `commands`. A row
    that arrives within a period is answered at once, the newest alone. A command holds from the
    first period on that begins no earlier than it arrives, so a round trip without delay takes
    none, and one that takes half a period takes a whole one. What is older than what a receiver
    has is dropped.

    Commands travel as float32, which the m/s and rad/s of a motor give back without a loss.

    Args:
        middleware: how messages travel.
        period: the control period [s].
        n_robots: N.
        seed: of the run; robot i's losses depend on nothing else, and not on `middleware`.
    """

    def __init__(self, middleware: Middleware, period: float, n_robots: int, seed: int) -> None:
        self._loss = middleware.loss
        self._delay = middleware.delay / period
        self._jitter = middleware.jitter / period
        self._stop_after = middleware.stop_after
        self._streams = [generator(seed, "middleware", robot) for robot in range(n_robots)]
        self._period = 0
        # By the period in which it arrives, and robot: a row, and when its answer will hold.
        self._rows: defaultdict[int, dict[int, tuple[Arrival, int | None]]] = defaultdict(dict)
        self._answer_periods: dict[tuple[int, int], int | None] = {}  # by robot and row
        # By the period from which it holds: robot, the period of the row, and the command.
        self._answers: defaultdict[int, list[tuple[int, int, Row]]] = defaultdict(list)
        self._newest_rows = [-1] * n_robots
        self._answered = np.full(n_robots, -1 - self._stop_after)  # nobody was steered yet
        self._commands = np.zeros((n_robots, MESSAGE), np.float32)

    def deliver(self, rows: Row) -> list[Arrival]:
        """Send what robots sense in this period (N, D); return what arrives at robots in it."""
        for robot, stream in enumerate(self._streams):
            # Always four, so that settings change no other message's fate.
            row_luck, row_share, command_luck, command_share = stream.random(4).tolist()
            if row_luck < self._loss:
                continue
            arrival = self._period + self._delay + self._jitter * row_share
            back = arrival + self._delay + self._jitter * command_share
            holds_from = None if command_luck < self._loss else _first_period_from(back)
            sent = Arrival(robot, self._period, rows[robot])
            self._rows[_first_period_from(arrival)][robot] = (sent, holds_from)
        arrivals = []
        for arrived, holds_from in self._rows.pop(self._period, {}).values():
            robot, period, _ = arrived
            if period > self._newest_rows[robot]:
                self._newest_rows[robot] = period
                self._answer_periods[robot, period] = holds_from
                arrivals.append(arrived)
        return arrivals

    def answer(self, robot: int, period: int, command: ArrayLike) -> None:
        """Send a robot's command (4,) upon the row of that period; only the first one travels."""
        holds_from = self._answer_periods.pop((robot, period), None)
        if holds_from is not None:
            sent = (robot, period, np.asarray(command, np.float32)[:MESSAGE])
            self._answers[holds_from].append(sent)

    def commands(self) -> NDArray[np.float64]:
        """Return what the motors do in this period (N, 4), and go on to the next one."""
        for holds_from in [moment for moment in self._answers if moment <= self._period]:
            for robot, period, command in self._answers.pop(holds_from):
                if period > self._answered[robot]:
                    self._answered[robot] = period
                    self._commands[robot] = command
        is_steered = self._period - self._answered <= self._stop_after
        self._period += 1
        return np.where(is_steered[:, np.newaxis], self._commands, 0.0).astype(np.float64)


def _first_period_from(moment: float) -> int:
    """Return the first period that begins no earlier than a moment, which is in periods."""
    return math.ceil(moment - 1e-9)


class RobotOverMiddleware:
    """One robot whose rows may be lost, or come late.

    Its memory counts control periods and adds up its turns. So it decides upon a row once for each
    period since the row before, and the last decision is its command.

    Args:
        robot: which it steers by.
        stop_after: the most periods that it catches up with, as the robot stood thereafter.
    """

    def __init__(self, robot: Robot, stop_after: int) -> None:
        self._robot = robot
        self._most = stop_after
        self._has_begun = False

    def step(self, row: ArrayLike, n_periods: int) -> NDArray[np.float64]:
        """Return the command (4,) upon a row (D,) that was sensed `n_periods` after the last one.

        Raises:
            PolicyError: see `Robot.step`.
        """
        n_missed = min(n_periods - 1, self._most) if self._has_begun else 0
        for _ in range(n_missed):
            self._robot.step(row)
        command = self._robot.step(row)
        self._has_begun = True
        return command


class OverMiddleware:
    """Steers each robot by itself, over middleware: what that costs, in any study, without ROS.

    Args:
        policy: a name or a file, as `policies.load` takes it; it has to decide from rows alone.
        settings: the fields of `Middleware`.

    Raises:
        PolicyError: there is no such policy, it does not decide from rows alone, or it talks.
        RobotError: a setting cannot be.

    Example:
        >>> OverMiddleware("homing", loss=0.1, delay=0.05)
        OverMiddleware('homing', loss=0.1, delay=0.05)
    """

    def __init__(self, policy: str, **settings: Any) -> None:
        self._name = policy
        self._middleware = Middleware(**settings)
        self._policy = check_row_policy(load(policy))
        refuse_messages(self._policy, "middleware")
        self._scenario = Scenario.preset("paper")
        self.reset(0, 0)

    def __repr__(self) -> str:
        changed = self._middleware.model_dump(exclude_defaults=True)
        settings = "".join(f", {name}={value!r}" for name, value in changed.items())
        return f"{type(self).__name__}({self._name!r}{settings})"

    def configure(self, scenario: Scenario) -> None:
        """Take what a robot's maker knows."""
        self._scenario = scenario

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode of `n_robots` rows."""
        body = self._scenario
        period = body.control_period
        stop_after = self._middleware.stop_after
        self._link = Link(self._middleware, period, n_robots, seed)
        self._robots = [
            RobotOverMiddleware(Robot(self._policy, body, period, seed, number), stop_after)
            for number in range(n_robots)
        ]
        self._newest_rows = [0] * n_robots

    def act(self, observations: Row) -> NDArray[np.float64]:
        """Return what the motors do now (N, 4), for observation rows (N, D)."""
        for robot, period, row in self._link.deliver(observations):
            n_periods = period - self._newest_rows[robot]
            self._newest_rows[robot] = period
            self._link.answer(robot, period, self._robots[robot].step(row, n_periods))
        return self._link.commands()
