"""Failure modes as lost capabilities, with onset and recovery."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, NonNegativeInt, PositiveFloat, PositiveInt, model_validator

from swarm_logistics_env.errors import FaultError, SwarmLogisticsError, suggest
from swarm_logistics_env.records import Record
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.streams import row_keys
from swarm_logistics_env.warehouse.state import WarehouseState


@dataclass(frozen=True)
class FailureMode:
    """What a robot that fails in this mode has lost.

    `speed` and `view` are factors in [0, 1] on its top speed and its cameras' range; where
    `factor` names one of them, a fault's own factor replaces it.
    """

    description: str
    speed: float = 1.0
    view: float = 1.0
    rangers: bool = True
    lifts: bool = True
    delivers: bool = True
    sends: bool = True
    hears: bool = True
    honest: bool = True
    obeys: bool = True
    present: bool = True
    factor: str | None = None


FAILURE_MODES: dict[str, FailureMode] = {
    "FM1": FailureMode("always tells timer 0, as if in the delivery area", honest=False),
    "FM2": FailureMode("never picks up", lifts=False),
    "FM3": FailureMode("neither sends nor hears", sends=False, hears=False),
    "FM3_send": FailureMode("does not send", sends=False),
    "FM3_hear": FailureMode("does not hear", hears=False),
    "FM4": FailureMode("its entering the delivery area delivers nothing", delivers=False),
    "motor_slow": FailureMode(
        "drives and turns at half its speed, or at the fault's factor of it",
        speed=0.5,
        factor="speed",
    ),
    "motor_dead": FailureMode("stands still", speed=0.0),
    "view_reduced": FailureMode(
        "sees half as far with its cameras, or the fault's factor of it", view=0.5, factor="view"
    ),
    "rangers_blind": FailureMode("its rangers report nothing near", rangers=False),
    "dead": FailureMode(
        "stands still, senses, sends and lifts nothing, keeps what it carries",
        speed=0.0,
        view=0.0,
        rangers=False,
        lifts=False,
        delivers=False,
        sends=False,
        hears=False,
        obeys=False,
    ),
    "removed": FailureMode(
        "out of the arena, what it carried is put down where it was", present=False
    ),
}


class Fault(Record):
    """A failure mode that befalls some robots, from a time on.

    Args:
        mode: a key of `FAILURE_MODES`.
        robots: how many robots fail (1..N), chosen by the seed alone, so that every mode hits the
            same robots and the sets of m = 1, 2, 3 are nested; or the robots' numbers.
        onset: when [s], from the start of the episode.
        duration: for how long [s]; None: for good. A removed robot does not come back.
        factor: for `motor_slow` and `view_reduced`: what is left, in [0, 1).

    Raises:
        FaultError: an unknown mode, a factor or a duration that the mode does not have, a robot
            that is named twice.

    Example:
        >>> Fault("FM1", 2, onset=200.0).robots
        2
    """

    error_type: ClassVar[type[SwarmLogisticsError]] = FaultError

    mode: str
    robots: PositiveInt | tuple[NonNegativeInt, ...] = 1
    onset: Annotated[float, Field(ge=0)] = 0.0
    duration: PositiveFloat | None = None
    factor: Annotated[float, Field(ge=0, lt=1)] | None = None

    def __init__(
        self,
        mode: str,
        robots: int | Sequence[int] = 1,
        onset: float = 0.0,
        duration: float | None = None,
        factor: float | None = None,
    ) -> None:
        if isinstance(robots, Sequence) and not isinstance(robots, str):
            robots = tuple(robots)
        super().__init__(mode=mode, robots=robots, onset=onset, duration=duration, factor=factor)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        if self.mode not in FAILURE_MODES:
            raise ValueError(f"no failure mode {self.mode!r}{suggest(self.mode, FAILURE_MODES)}")
        if self.factor is not None and FAILURE_MODES[self.mode].factor is None:
            able = ", ".join(name for name, mode in FAILURE_MODES.items() if mode.factor)
            raise ValueError(f"{self.mode} takes no factor; modes that do: {able}")
        if self.mode == "removed" and self.duration is not None:
            raise ValueError("a removed robot does not come back: duration should be None")
        if isinstance(self.robots, tuple) and not self.robots:
            raise ValueError("robots = (): should name at least one robot")
        if isinstance(self.robots, tuple) and len(set(self.robots)) < len(self.robots):
            raise ValueError(f"robots = {self.robots}: should name each robot once")
        return self

    def is_active(self, time: float) -> bool:
        """Return whether the fault holds at `time` [s]."""
        # Half a microsecond of grace: times are sums of control periods.
        started = time >= self.onset - 5e-7
        ended = self.duration is not None and time >= self.onset + self.duration - 5e-7
        return started and not ended

    def changes(self) -> tuple[float, ...]:
        """Return the times [s] at which it begins and, if ever, ends."""
        if self.duration is None:
            return (self.onset,)
        return (self.onset, self.onset + self.duration)


def failed_robots(fault: Fault, seed: int, n_robots: int) -> NDArray[np.int64]:
    """Return the numbers of the robots that `fault` befalls, ascending.

    Raises:
        FaultError: it is no fault, of more robots than there are, or of one that is not there.
    """
    if not isinstance(fault, Fault):
        raise FaultError(f'faults hold {fault!r}: should be a list of faults, as [Fault("FM1", 2)]')
    if isinstance(fault.robots, tuple):
        if max(fault.robots) >= n_robots:  # before numpy, whose integers end at 2**63
            raise FaultError(
                f"Fault.robots = {fault.robots}: robots are numbered 0 to {n_robots - 1}"
            )
        return np.unique(np.array(fault.robots, dtype=np.int64))
    if fault.robots > n_robots:
        raise FaultError(f"Fault.robots = {fault.robots}: should be at most n_robots = {n_robots}")
    # Ranked by a key of seed and robot alone: nested in m, the same for every mode and any N.
    order = np.argsort(row_keys(seed, "faulty robots", n_robots), kind="stable")
    return np.sort(order[: fault.robots]).astype(np.int64)


def apply_faults(
    state: WarehouseState,
    scenario: Scenario,
    faults: Sequence[Fault],
    struck: Sequence[NDArray[np.int64]],
) -> NDArray[np.bool_]:
    """Give every robot what the faults that hold at `state.time` leave it.

    Args:
        struck: per fault, the robots it befalls.

    Returns:
        Which robots a fault takes out of the arena, (N,).
    """
    speed = np.resize(scenario.speed_mix, state.n_robots)
    sensing = np.resize(scenario.sensing_mix, state.n_robots)
    state.max_speed[:] = scenario.max_speed * speed
    state.max_turn_rate[:] = scenario.max_turn_rate * speed
    state.ranger_range[:] = scenario.ranger_range * sensing
    state.view_range[:] = scenario.view_range * sensing
    for able in (state.lifts, state.delivers, state.sends, state.hears, state.honest, state.obeys):
        able[:] = True
    gone = np.zeros(state.n_robots, np.bool_)
    modes: list[tuple[str, ...]] = [()] * state.n_robots
    for fault, robots in zip(faults, struck, strict=True):
        if not fault.is_active(state.time):
            continue
        mode = FAILURE_MODES[fault.mode]
        left = {"speed": mode.speed, "view": mode.view}
        if mode.factor is not None and fault.factor is not None:
            left[mode.factor] = fault.factor
        state.max_speed[robots] *= left["speed"]
        state.max_turn_rate[robots] *= left["speed"]
        state.view_range[robots] *= left["view"]
        state.ranger_range[robots] *= mode.rangers
        state.lifts[robots] &= mode.lifts
        state.delivers[robots] &= mode.delivers
        state.sends[robots] &= mode.sends
        state.hears[robots] &= mode.hears
        state.honest[robots] &= mode.honest
        state.obeys[robots] &= mode.obeys
        gone[robots] |= not mode.present
        for robot in robots.tolist():
            modes[robot] = (*modes[robot], fault.mode)
    state.failure_modes = tuple(modes)
    state.failed = np.array([bool(names) for names in modes])
    return gone
