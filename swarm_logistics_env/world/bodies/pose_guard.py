"""Stops robots whose poses cannot be trusted: poses that freeze, jump or stay away.

It knows reported poses and who was driven, and no robot, so it guards any testbed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]

# All chosen, in the DotBots' simulator.
STOP_AFTER = 0.5  # [s] without a pose, or driven without motion
LOST_AFTER = 10.0  # [s] without any message
# A robot that does not move may be blocked, and one without a heading has to move to find it. So
# one that still sends messages tries again, for so long, so often, at such a share of its speed.
TRY_EVERY = 2.0  # [s]
TRY_FOR = 0.5  # [s]
TRY_SHARE = 0.3
# A robot that a hand has moved is believed once its poses have agreed for so long.
SETTLED_AFTER = 0.3  # [s]
SLACK = 0.05  # [m] that a pose may be off
HASTE = 1.5  # times max_speed is faster than any robot
# Less than this is no motion.
LEAST_WAY, LEAST_TURN = 0.002, np.radians(2.0)  # [m], [rad]


class PoseGuard:
    """Believed poses of N robots, and how fast each may drive.

    Args:
        position: where the robots begin (N, 2) [m].
        heading: (N,) [rad].
        period: between two calls of `update` [s].
        max_speed: of a robot [m/s].

    Attributes:
        position, heading, velocity: the last believed poses (N, 2) [m], (N,) [rad], (N, 2) [m/s];
            who is stopped has velocity 0.
        age: of the believed poses (N,) [s].
        speed_share: the share of its speed that a robot may drive at next (N,), 0: stop.
        lost: who has been silent for `LOST_AFTER` (N,); for good.
    """

    def __init__(
        self, position: Numbers, heading: Numbers, period: float, max_speed: float
    ) -> None:
        n_robots = len(position)
        self.position = position.copy()
        self.heading = heading.copy()
        self.velocity = np.zeros((n_robots, 2))
        self.age = np.zeros(n_robots)
        self.speed_share = np.ones(n_robots)
        self.lost = np.zeros(n_robots, np.bool_)
        self._period = period
        self._max_speed = max_speed
        self._silence = np.zeros(n_robots)  # [s] since the last message
        self._standing = np.zeros(n_robots)  # [s] driven since the last motion
        self._stopped = np.zeros(n_robots)  # [s]
        self._moved_position = position.copy()
        self._moved_heading = heading.copy()
        self._is_jumping = np.zeros(n_robots, np.bool_)
        self._jump = np.full((n_robots, 2), np.nan)
        self._settled = np.zeros(n_robots)  # [s] for which poses agree with `_jump`

    def update(
        self, position: Numbers, heading: Numbers, is_heard: Flags, is_driven: Flags
    ) -> None:
        """Take what was reported in a period.

        Args:
            position: (N, 2) [m]; nan: not reported.
            heading: (N,) [rad]; nan: not reported.
            is_heard: who sent any message (N,), with a pose or without.
            is_driven: who was driven fast enough that its pose should have changed (N,).
        """
        self.age += self._period
        self._silence = np.where(is_heard, 0.0, self._silence + self._period)
        self.lost |= self._silence >= LOST_AFTER - 1e-9
        has_pose = is_heard & np.isfinite(position).all(axis=1) & np.isfinite(heading)
        is_believed = self._believe(has_pose, position)
        self._take(is_believed, position, heading)
        self._watch_motion(is_driven)
        self._decide()

    def _believe(self, has_pose: Flags, position: Numbers) -> Flags:
        """Return whose pose is believed: where it can have driven, or moved by a hand for sure."""
        is_near = np.linalg.norm(position - self.position, axis=1) <= self._reach()
        is_far = has_pose & ~is_near
        agrees = np.linalg.norm(position - self._jump, axis=1) <= SLACK
        self._settled = np.where(is_far & agrees, self._settled + self._period, 0.0)
        self._jump[is_far & ~agrees] = position[is_far & ~agrees]
        is_moved_by_hand = is_far & (self._settled >= SETTLED_AFTER - 1e-9)
        self._is_jumping = np.where(has_pose, is_far & ~is_moved_by_hand, self._is_jumping)
        return np.asarray(has_pose & ~self._is_jumping, np.bool_)

    def _reach(self) -> Numbers:
        """Return how far each can have driven since its believed pose (N,) [m]."""
        # Longer than that it was not driven, so it is no farther.
        driven_for = np.minimum(self.age, STOP_AFTER + self._period)
        return SLACK + HASTE * self._max_speed * driven_for

    def _take(self, is_believed: Flags, position: Numbers, heading: Numbers) -> None:
        displacement = (position - self.position)[is_believed]
        # A jump is no speed.
        is_driven = np.linalg.norm(displacement, axis=1) <= self._reach()[is_believed]
        velocity = displacement / self.age[is_believed, None]
        self.velocity[is_believed] = velocity * is_driven[:, None]
        self.position[is_believed] = position[is_believed]
        self.heading[is_believed] = heading[is_believed]
        self.age[is_believed] = 0.0

    def _watch_motion(self, is_driven: Flags) -> None:
        """Count how long each was driven since its pose last changed."""
        turn = np.angle(np.exp(1j * (self.heading - self._moved_heading)))
        distance = np.linalg.norm(self.position - self._moved_position, axis=1)
        has_moved = (distance >= LEAST_WAY) | (np.abs(turn) >= LEAST_TURN)
        self._moved_position[has_moved] = self.position[has_moved]
        self._moved_heading[has_moved] = self.heading[has_moved]
        self._standing = np.where(has_moved, 0.0, self._standing + self._period * is_driven)

    def _decide(self) -> None:
        is_silent = self._silence >= STOP_AFTER - 1e-9
        is_frozen = self._standing >= STOP_AFTER - 1e-9
        is_stopped = is_silent | is_frozen | self._is_jumping | (self.age >= STOP_AFTER - 1e-9)
        self._stopped = np.where(is_stopped, self._stopped + self._period, 0.0)
        is_time = np.remainder(self._stopped, TRY_EVERY) >= TRY_EVERY - TRY_FOR
        may_try = is_time & ~is_silent & ~self._is_jumping
        self.speed_share = np.where(is_stopped, np.where(may_try, TRY_SHARE, 0.0), 1.0)
        self.velocity[self.speed_share == 0.0] = 0.0
