"""A policy whose robots go to charge before their batteries are empty, and then go on."""

from __future__ import annotations

import copy
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, JsonValue

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.core.errors import PolicyError
from swarm_logistics_env.core.fingerprint import joined
from swarm_logistics_env.policies.driving import HOLD, LET_GO, away_from_neighbours
from swarm_logistics_env.policies.policy import (
    Holding,
    Policy,
    ScriptParameters,
    check_policy,
    identity_parts,
)
from swarm_logistics_env.policies.row_policy import OF_BATTERY, RowPolicy, check_row_policy
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import BODY, MEMORY, N_COLUMNS, bodies_of, length_of
from swarm_logistics_env.world.motion.steering import set_velocity, steer
from swarm_logistics_env.world.scenario import Scenario, of_first_robots

SUFFIX = "+charging"  # of a policy's name
AT = 0.3
UNTIL = 0.95

_WALL_DISTANCE = 0.6  # [m] at which it follows a wall in search of a station
_WALL_GAIN = 1.5  # turn towards that distance, in units of the way along the wall, per m
_AVOID_RANGE = 0.5  # [m] between centres
_AVOID_GAIN = 2.0
_PATIENCE = 1.0  # [s] on a station that does not charge it, after which it takes that for dead
_TURNED_AWAY = 20.0  # [s] for which it then looks for another one


@kernel
def drive_to_charge(
    rows: NDArray[np.float32],
    needs_charge: NDArray[np.bool_],
    side: NDArray[np.float64],
    in_vain: NDArray[np.float64],
    bodies: NDArray[np.float64],
    radii: NDArray[np.float64],
    period: float,
    commands: NDArray[np.float64],
) -> None:
    """Replace the commands (N, 4) of robots that need charge and know where to drive.

    They drive to the nearest free station in view and stand on it. Inside a delivery area without
    one in view they follow the nearest wall, to the left or to the right of it as `side` (N,) says.
    All others are on their way home, and only let go of what nobody asks for.

    Args:
        in_vain: for how long each stood on a station that did not charge it [s], (N,); below 0: it
            looks for another one for so long.
        bodies: memories (N, N_COLUMNS), of which the bodies are read.
        radii: of the robots (N,) [m].
    """
    for robot in range(len(rows)):
        if not needs_charge[robot]:
            continue
        sensed = rows[robot]
        command = commands[robot]
        body = bodies[robot]
        is_inside = sensed[row.IN_DELIVERY_AREA] > 0.5
        is_useless = sensed[row.CARRYING] > 0.5 and sensed[row.CARRYING_REQUESTED] < 0.5
        gripper = LET_GO if is_useless and not is_inside else HOLD
        command[3] = gripper
        battery = len(sensed) - row.N_BATTERY_COLUMNS
        if sensed[battery + row.BATTERY.charging] > 0.5:
            in_vain[robot] = 0.0
            set_velocity(0.0, 0.0, 0.0, gripper, command)
            continue
        station = free_station(sensed, battery + row.BATTERY.stations, radii[robot])
        if in_vain[robot] < 0.0:
            in_vain[robot] += period
            station = -1
        if station >= 0:
            x = float(sensed[station + row.STATION.x])
            y = float(sensed[station + row.STATION.y])
            way = float(length_of(x, y))
            top_speed = float(body[MEMORY.top_speed])
            set_velocity(x, y, min(1.0, way / (2.0 * period * top_speed)), gripper, command)
            steer(body, command)
            in_vain[robot] += period if way < radii[robot] else 0.0
            if in_vain[robot] > _PATIENCE:
                in_vain[robot] = -_TURNED_AWAY
        elif is_inside:
            x, y = along_the_wall(sensed, side[robot])
            push_x, push_y = away_from_neighbours(sensed, _AVOID_RANGE, _AVOID_GAIN)
            set_velocity(x + push_x, y + push_y, 1.0, gripper, command)
            steer(body, command)


@kernel
def free_station(sensed: NDArray[np.float32], first: int, radius: float) -> int:
    """Return the column of the nearest station in view on which no robot is seen; -1: none."""
    for rank in range(row.N_STATIONS_IN_VIEW):
        station = first + rank * row.STATION_WIDTH
        if sensed[station + row.STATION.present] < 0.5:
            return -1
        is_free = True
        for neighbour in range(row.N_NEIGHBOURS):
            start = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * neighbour
            x = sensed[start + row.NEIGHBOUR.x] - sensed[station + row.STATION.x]
            y = sensed[start + row.NEIGHBOUR.y] - sensed[station + row.STATION.y]
            is_there = sensed[start + row.NEIGHBOUR.present] > 0.5
            is_free &= not (is_there and length_of(x, y) < radius)
        if is_free:
            return station
    return -1


@kernel
def along_the_wall(sensed: NDArray[np.float32], side: float) -> tuple[float, float]:
    """Return the direction along the nearest wall, at a distance from it, in a robot's frame."""
    walls = sensed[row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS]
    nearest = int(np.argmin(walls))
    angle = 2.0 * np.pi * nearest / row.N_BEAMS
    towards = _WALL_GAIN * (walls[nearest] - _WALL_DISTANCE)
    x = towards * np.cos(angle) - side * np.sin(angle)
    y = towards * np.sin(angle) + side * np.cos(angle)
    return x, y


class ChargingParameters(ScriptParameters):
    """When robots go to charge and when they go on, and the parameters of their policy."""

    at: Annotated[float, Field(gt=0.0, lt=1.0, description="charge below which it goes")] = AT
    until: Annotated[float, Field(gt=0.0, le=1.0, description="charge at which it goes on")] = UNTIL
    policy: dict[str, JsonValue] = Field({}, description="parameters of the policy, if any")


class Charging(RowPolicy, Holding):
    """Another policy, whose robots go to charge while their batteries are nearly empty.

    A robot with little charge goes home by the policy's own skill, as its row then says that it
    carries a requested item; near the delivery area it looks for a station along the walls. Where
    robots have no batteries, it is the policy itself.

    Args:
        policy: a script or a network that decides from rows, or whatever has `act(observations)`.
        at: the charge, a share, below which a robot goes to charge.
        until: the charge at which it goes on.

    Raises:
        PolicyError: `policy` is none or needs the state, or the shares cannot be.
    """

    ignores: frozenset[str]

    def __init__(self, policy: Policy, at: float = AT, until: float = UNTIL) -> None:
        check_policy(policy)
        if getattr(policy, "needs_state", False):
            raise PolicyError(
                f"policy = {type(policy).__name__}: should decide from rows alone, as a central "
                "controller has to send its robots to charge itself"
            )
        inner = getattr(policy, "parameters", None)
        of_policy = inner.model_dump(mode="json") if isinstance(inner, ScriptParameters) else {}
        self.parameters = ChargingParameters(at=at, until=until, policy=of_policy)
        if at >= until:
            raise PolicyError(f"at = {at}: should be less than until = {until}")
        self.policy = policy
        self.ignores = getattr(policy, "ignores", frozenset()) - OF_BATTERY
        self.messages = getattr(policy, "messages", ())
        self.stream = getattr(policy, "stream", "charging")
        self._has_battery = False
        self._bodies_of_kinds = np.zeros((1, BODY.stop - BODY.start))
        self._radii_of_kinds = np.zeros(1)
        self._set_robots(0)

    def __repr__(self) -> str:
        shares = self.parameters
        return f"Charging({self.policy!r}, at={shares.at}, until={shares.until})"

    def __copy__(self) -> Charging:
        return type(self)(copy.copy(self.policy), self.parameters.at, self.parameters.until)

    def identity_parts(self) -> dict[str, Any]:
        """Return the policy's parts, and the shares."""
        inner = identity_parts(self.policy)
        prints = joined([inner]) if "value" in inner else {}
        policy = {name: part for name, part in inner.items() if name not in prints}
        shares = {"at": self.parameters.at, "until": self.parameters.until}
        return {"class": "Charging", **shares, "policy": policy, **prints}

    def fit_to(self, swarm: Scenario) -> None:
        """Take what the policy takes."""
        if isinstance(self.policy, RowPolicy):
            self.policy.fit_to(swarm)

    def configure(self, scenario: Scenario) -> None:
        """Take what the policy takes, the body, and whether there are batteries."""
        configure = getattr(self.policy, "configure", None)
        if configure is not None:
            configure(scenario)
        self._has_battery = scenario.battery is not None
        self._period = scenario.control_period
        self._radii_of_kinds = np.array([body.robot_radius for body in of_first_robots(scenario)])
        self._bodies_of_kinds = bodies_of(scenario)

    def begin(self, keys: NDArray[np.uint64]) -> None:
        """Begin an episode of robots whose streams have these keys (N,)."""
        check_row_policy(self.policy).begin(keys)
        self._set_robots(len(keys))

    def reset(self, n_robots: int, seed: int) -> None:
        """Begin an episode of `n_robots` rows."""
        self.policy.reset(n_robots, seed)
        self._set_robots(n_robots)

    def _set_robots(self, n_robots: int) -> None:
        self._needs_charge = np.zeros(n_robots, np.bool_)
        self._was_inside = np.zeros(n_robots, np.bool_)
        self._side = np.ones(n_robots)
        self._in_vain = np.zeros(n_robots)
        self._bodies = np.zeros((n_robots, N_COLUMNS))
        self._radii = np.resize(self._radii_of_kinds, n_robots)
        self._bodies[:, BODY] = np.resize(self._bodies_of_kinds, (n_robots, BODY.stop - BODY.start))

    def memories(self) -> dict[str, NDArray[Any]]:
        """Return all that robots remember, the policy's memories among it."""
        of_policy = check_row_policy(self.policy).memories()
        return of_policy | {
            "needs_charge": self._needs_charge,
            "was_inside": self._was_inside,
            "side": self._side,
            "in_vain": self._in_vain,
        }

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return commands (N, 4 or more) for observation rows (N, D)."""
        if not self._has_battery:
            return self.policy.act(observations)
        charge = observations[:, observations.shape[1] - row.N_BATTERY_COLUMNS]
        self._needs_charge |= charge < self.parameters.at
        self._needs_charge &= charge < self.parameters.until
        is_inside = observations[:, row.IN_DELIVERY_AREA] > 0.5
        self._side[self._was_inside & ~is_inside] *= -1.0  # next time it goes the other way round
        self._was_inside = is_inside
        rows = observations
        goes_home = self._needs_charge & ~is_inside
        if goes_home.any():
            rows = observations.copy()
            rows[goes_home, row.CARRYING] = 1.0
            rows[goes_home, row.CARRYING_REQUESTED] = 1.0
        commands = np.array(self.policy.act(rows), np.float64)
        drive_to_charge(
            observations, self._needs_charge, self._side, self._in_vain, self._bodies,
            self._radii, self._period, commands,
        )  # fmt: skip
        return commands


def charging(policy: Policy, at: float = AT, until: float = UNTIL) -> Charging:
    """Return the policy with robots that go to charge; see `Charging`.

    Example:
        >>> from swarm_logistics_env import policies
        >>> charging(policies.load("homing"), at=0.3)
        Charging(Homing(), at=0.3, until=0.95)
    """
    return Charging(policy, at, until)
