"""A study's faults on a real robot: a layer between its policy and sensors, motors and radio."""

from __future__ import annotations

import csv
import math
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env.core.errors import FaultError
from swarm_logistics_env.core.streams import generator
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.scenario import Scenario
from swarm_logistics_env.world.warehouse.commands import GRIPPER, MESSAGE
from swarm_logistics_env.world.warehouse.failure_modes import failure_mode
from swarm_logistics_env.world.warehouse.faults import FaultLike, Occurrence, checked_faults

HOLD = 0.0  # the gripper's command that neither lifts nor lets go
Row = NDArray[np.float32]
Numbers = NDArray[np.float64]


class Broadcast(NamedTuple):
    """What a robot's radio sends in a control period.

    Attributes:
        timer: [s]; NaN: silent.
        message: numbers in [-1, 1], (M,).
    """

    timer: float
    message: Numbers


class FaultLayer:
    """Lets one robot of a swarm fail as the same faults let it fail in the simulator.

    In each control period its policy decides upon `sensed`, its motors and gripper get `driven`,
    and its radio sends `broadcast`. Each robot of a trial has a layer of its own, with the trial's
    seed.

    Args:
        faults: as texts ("FM4:2@200"), dicts or `Fault`; not by role, which only a simulator knows.
        scenario: of the study beside which the trials stand: robots, duration, period, ranges.
        number: of the robot, from 0 on.
        seed: of the trial; with the number it says whether and when this robot fails.

    Raises:
        FaultError: a fault cannot be, strikes by role, or there is no robot of that number.

    Example:
        >>> layer = FaultLayer(["motor_slow:1@10"], Scenario(n_robots=1), number=0, seed=3)
        >>> layer.driven([1, 0, 0, 1], np.zeros(row.N_COLUMNS), time=12.0).tolist()
        [0.5, 0.0, 0.0, 1.0]
    """

    def __init__(
        self, faults: Sequence[FaultLike], scenario: Scenario, number: int, seed: int
    ) -> None:
        checked = checked_faults("faults", faults)
        roles = [fault.role for fault in checked if fault.role is not None]
        if roles:
            raise FaultError(f"role = {roles[0]!r}: should be None, a robot's role is not known")
        fading = [fault.mode for fault in checked if failure_mode(fault.mode).battery < 1.0]
        if fading:
            raise FaultError(f"mode = {fading[0]}: should be another, no layer weakens a battery")
        if not 0 <= number < scenario.n_robots:
            raise FaultError(f"number = {number}: robots are 0 to {scenario.n_robots - 1}")
        self._scenario = scenario
        self._body = scenario.of_robot(number)
        self._number = number
        self._occurrences = [Occurrence(fault, seed, scenario) for fault in checked]
        self._beams: Row | None = None  # what frozen rangers repeat
        self._message: Numbers | None = None  # what a frozen channel repeats
        latest = max((fault.mode.radio_delay for fault in self._occurrences), default=0.0)
        # Also before the fault, which then sends what was said before it began.
        self._sent: deque[Broadcast] = deque(maxlen=round(latest / scenario.control_period) + 1)
        self._rng = generator(seed, "spoilt messages", number)

    def modes(self, time: float) -> tuple[str, ...]:
        """Return the failure modes that the robot is in at `time` [s] of the trial."""
        return tuple(occurrence.fault.mode for occurrence in self._active(time))

    def counts(self, time: float) -> bool:
        """Return whether what the robot brings counts as delivered; in FM4 it does not."""
        return self._keeps("delivers", time)

    def sensed(self, observation: ArrayLike, time: float) -> Row:
        """Return the row (D,) that its policy gets of the row that its sensors fill."""
        sensed = np.array(observation, np.float32)
        if not self._keeps("present", time):
            return np.zeros_like(sensed)
        hears = self._keeps("hears", time)
        view = self._factor("view", time)
        self._forget_unseen(sensed, view * self._body.view_range, hears)
        if not hears:
            sensed[row.LOWEST_TIMER : row.CARRYING] = 0.0
        if not self._keeps("hears_requests", time):
            first = row.ITEMS + row.ITEM.requested
            sensed[first : row.NEIGHBOURS : row.ITEM_WIDTH] = 0.0
            sensed[row.CARRYING_REQUESTED] = 0.0
        self._spoil_beams(sensed[: row.ITEMS], time)
        return sensed

    def driven(self, command: ArrayLike, observation: ArrayLike, time: float) -> Numbers:
        """Return what motors and gripper get (4,) of its policy's command (4 + M,).

        `observation` is the row (D,): a gripper fails by what it holds and where it is.
        """
        driven = np.clip(np.asarray(command, np.float64)[:MESSAGE], -1.0, 1.0)
        if not (self._keeps("obeys", time) and self._keeps("present", time)):
            return np.zeros(MESSAGE)
        driven[:GRIPPER] *= self._factor("speed", time)
        sensed = np.asarray(observation)
        if not self._keeps("lifts", time) and sensed[row.CARRYING] < 0.5:
            driven[GRIPPER] = min(driven[GRIPPER], HOLD)
        if not self._keeps("releases_inside", time) and sensed[row.IN_DELIVERY_AREA] > 0.5:
            driven[GRIPPER] = max(driven[GRIPPER], HOLD)
        return driven

    def broadcast(self, timer: float, message: ArrayLike, time: float) -> Broadcast | None:
        """Return what its radio sends, once a control period; None: nothing.

        Args:
            timer: its own [s], NaN: silent.
            message: of its policy's command (M,).
        """
        obeys = self._keeps("obeys", time) and self._keeps("present", time)
        words = np.clip(np.asarray(message, np.float64), -1.0, 1.0) * obeys
        if not self._keeps("messages_true", time):
            words = -words
        if not self._keeps("messages_mean", time):
            words = self._rng.uniform(-1.0, 1.0, len(words))
        if not self._keeps("messages_refresh", time) and self._message is not None:
            words = self._message
        self._message = words
        self._sent.append(Broadcast(timer, words))
        delays = [occurrence.mode.radio_delay for occurrence in self._active(time)]
        n_periods = round(max(delays, default=0.0) / self._scenario.control_period)
        if not (self._keeps("sends", time) and self._keeps("present", time)):
            return None
        sent = Broadcast(math.nan, np.zeros_like(words))  # of a time before the trial
        if len(self._sent) > n_periods:
            sent = self._sent[-1 - n_periods]
        return sent if self._keeps("honest", time) else sent._replace(timer=0.0)

    def _active(self, time: float) -> list[Occurrence]:
        return [fault for fault in self._occurrences if self._number in fault.holds_for(time)]

    def _keeps(self, capability: str, time: float) -> bool:
        """Return whether the faults that hold leave it a capability, a field of `FailureMode`."""
        return all(getattr(occurrence.mode, capability) for occurrence in self._active(time))

    def _factor(self, name: str, time: float) -> float:
        """Return the share that is left of its "speed" or "view"."""
        end = self._scenario.duration
        active = self._active(time)
        return math.prod(fault.remaining_factors(time, end)[name] for fault in active)

    def _forget_unseen(self, sensed: Row, view_range: float, hears: bool) -> None:
        """Take out of a row what lies beyond its view [m], but for robots that it hears."""
        self._keep(sensed[row.ITEMS : row.NEIGHBOURS], row.N_ITEMS_IN_VIEW, view_range)
        heard_range = self._scenario.radio_range if hears else 0.0
        neighbours = sensed[row.NEIGHBOURS : row.LOWEST_TIMER]
        end = row.MESSAGES + row.N_NEIGHBOURS * self._scenario.message_size
        if self._scenario.battery is not None:
            first = end + row.BATTERY.stations
            self._keep(sensed[first:], row.N_STATIONS_IN_VIEW, view_range)
        if not hears:
            neighbours[row.NEIGHBOUR.timer_heard :: row.NEIGHBOUR_WIDTH] = 0.0
            neighbours[row.NEIGHBOUR.timer :: row.NEIGHBOUR_WIDTH] = self._scenario.timer_limit
            sensed[row.MESSAGES : end] = 0.0
        order = self._keep(neighbours, row.N_NEIGHBOURS, max(view_range, heard_range))
        messages = sensed[row.MESSAGES : end].reshape(row.N_NEIGHBOURS, -1)
        n_left = len(order)
        messages[:n_left] = messages[order]
        messages[n_left:] = 0.0

    @staticmethod
    def _keep(columns: Row, count: int, reach: float) -> list[int]:
        """Move up those of `count` entries that lie within `reach` [m]; return which these are."""
        block = columns.reshape(count, -1)  # all of them begin with present, x, y
        is_near = np.hypot(block[:, 1], block[:, 2]) <= reach
        order = np.flatnonzero((block[:, 0] > 0.5) & is_near).tolist()
        block[: len(order)] = block[order]
        block[len(order) :] = 0.0
        return order

    def _spoil_beams(self, beams: Row, time: float) -> None:
        """Make of beams (48,) [m] what rangers that have failed report, in place."""
        reach = self._body.ranger_range
        if not self._keeps("rangers", time):
            beams[:] = reach
        bias = math.fsum(occurrence.mode.ranger_bias for occurrence in self._active(time))
        meets = beams < np.float32(reach)
        # As the simulator rounds it.
        beams[meets] = np.clip(beams[meets].astype(np.float64) + bias, 0.0, reach)
        if self._keeps("rangers_refresh", time):
            self._beams = None
        elif self._beams is None:
            self._beams = beams.copy()
        else:
            beams[:] = self._beams


TRIAL_COLUMNS = ("seed", "robots", "fault", "faulty", "onset", "delivered")


def append_trial(
    path: Path | str, faults: Sequence[FaultLike], scenario: Scenario, seed: int, delivered: float
) -> None:
    """Append a trial to a table that `judge` reads; trials of one seed are compared as pairs.

    Args:
        path: of a CSV file, which may be empty or not be there.
        faults: none, or one.
        delivered: P of the trial: items, or any number from 0 on.

    Raises:
        FaultError: there are several faults, which a row cannot tell.
    """
    checked = checked_faults("faults", faults)
    if len(checked) > 1:
        raise FaultError(f"{len(checked)} faults: should be at most 1, a trial's row names it")
    cells: tuple[object, ...] = ("none", 0, "")
    for fault in checked:
        n_faulty = fault.robots if isinstance(fault.robots, int) else len(fault.robots)
        cells = (fault.mode, n_faulty, fault.onset)
    is_new = not Path(path).exists() or Path(path).stat().st_size == 0
    with Path(path).open("a", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if is_new:
            writer.writerow(TRIAL_COLUMNS)
        writer.writerow([seed, scenario.n_robots, *cells, delivered])
