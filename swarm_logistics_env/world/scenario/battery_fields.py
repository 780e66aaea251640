"""Batteries and charging stations: the fields of a scenario that say them, and what must hold.

A battery is off unless `battery` is set. Then a robot's electronics, its way, its gain of speed and
its lifts take energy, and one that has none left stands where it is.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from swarm_logistics_env.world.floor.floor_plan import STATION, STORAGE

from .fields import ScenarioFields
from .ranges import LARGEST, NonNegative, Positive

_N_STATIONS = 4  # in a room without a plan
_FROM_WALL = 2.0  # robot radii from the wall to a station's centre, so that a robot gets onto it
_GRID = 21  # points along each side of the room from which the way to a station is looked at

Stations = Annotated[int, Field(ge=0, le=LARGEST)]


class BatteryFields(ScenarioFields):
    """The fields of batteries and stations, after all others."""

    battery: Positive | None = Field(
        None,
        description="energy in a full battery [J]; at the start each holds half of that to all; "
        "none: no robot has a battery, and energy is not looked at; off",
    )
    idle_power: NonNegative = Field(
        5.0, description="what a robot's electronics take, driving or not [W]; chosen"
    )
    driving_energy: NonNegative = Field(
        10.0,
        description="what a way takes [J/m]; to gain speed takes the kinetic energy besides, which "
        "braking does not give back; chosen",
    )
    lifting_energy: NonNegative = Field(20.0, description="what lifting an item takes [J]; chosen")
    charging_power: NonNegative = Field(
        300.0, description="what a robot gets whose centre is on a station [W]; chosen"
    )
    n_stations: Stations | None = Field(
        None,
        description="charging stations along the wall of the delivery area; none: 4, or those of "
        'the plan ("*"); chosen',
    )
    dead_stations: Stations = Field(
        0, description="stations that charge nobody, which no robot sees from afar; off"
    )

    @property
    def has_batteries(self) -> bool:
        """Whether robots have batteries."""
        return self.battery is not None

    @property
    def stations(self) -> NDArray[np.float64]:
        """Centres of the charging stations [m], (S, 2); none without batteries."""
        if self.battery is None:
            return np.zeros((0, 2))
        if self.plan is not None:
            rows, columns = np.nonzero(self.plan.kind == STATION)
            cells = np.column_stack([columns, rows]).astype(np.float64)
            return (cells + 0.5) * self.cell_size
        count = _N_STATIONS if self.n_stations is None else self.n_stations
        x = self.warehouse_width - _FROM_WALL * self.robot_radius
        y = (np.arange(count) + 0.5) * self.warehouse_height / max(count, 1)
        return np.column_stack([np.full(count, x), y])


def check_batteries(scenario: BatteryFields) -> None:
    """Check stations against the plan, and that a full battery brings a robot to one of them.

    Raises:
        ValueError: names the field, its value and what would be right.
    """
    if scenario.battery is None:
        if scenario.dead_stations:
            raise ValueError(
                f"dead_stations = {scenario.dead_stations}: should have batteries, as battery = "
                "5000, or be 0"
            )
        if scenario.n_stations is not None:
            raise ValueError(
                f"n_stations = {scenario.n_stations}: should have batteries, as battery = 5000, or "
                "be left out"
            )
        kinds = [kind for kind in scenario.robot_kinds if kind.battery is not None]
        if kinds:
            raise ValueError(
                f"robot_kinds: battery = {kinds[0].battery:g} of the kind {kinds[0].name!r}: "
                "should stand beside the scenario's battery, which is that of the other robots"
            )
        return
    n_stations = len(scenario.stations)
    if scenario.plan is not None and scenario.n_stations not in (None, n_stations):
        raise ValueError(
            f"n_stations = {scenario.n_stations} should be left out, as the plan has {n_stations}"
        )
    if scenario.plan is not None and n_stations == 0 and scenario.n_stations is None:
        raise ValueError(
            'n_stations: the plan has no charging station ("*"): should have at least one, or '
            "n_stations be 0, so that robots work until their batteries are empty"
        )
    if scenario.dead_stations > n_stations:
        raise ValueError(
            f"dead_stations = {scenario.dead_stations}: should be at most {n_stations}, as there "
            "are no more stations"
        )
    if n_stations:
        _check_reach(scenario)


def _check_reach(scenario: BatteryFields) -> None:
    """Check that a full battery lasts for the straight way from where items lie to a station.

    Robots of each kind have to get there, so that a swarm of one of the kinds alone may be, too.
    """
    if scenario.plan is None:
        width = np.linspace(0.0, scenario.storage_width, _GRID)
        height = np.linspace(0.0, scenario.warehouse_height, _GRID)
        x, y = map(np.ravel, np.meshgrid(width, height))
    else:
        rows, columns = np.nonzero(scenario.plan.kind == STORAGE)
        x = np.asarray((columns + 0.5) * scenario.cell_size, np.float64)
        y = np.asarray((rows + 0.5) * scenario.cell_size, np.float64)
    # One station after the other, as a plan may have a million cells.
    nearest = np.full(len(x), np.inf)
    for station_x, station_y in scenario.stations.tolist():
        np.minimum(nearest, np.hypot(x - station_x, y - station_y), out=nearest)
    way = float(nearest.max())
    names = [f" of the kind {kind.name!r}" for kind in scenario.robot_kinds] or [""]
    energies = scenario.of_kinds("battery")
    speeds = scenario.of_kinds("max_speed")
    radii = scenario.of_kinds("robot_radius")
    for name, energy, speed, radius in zip(names, energies, speeds, radii, strict=True):
        # Of smaller robots alone, the stations stand nearer to the wall.
        farther = _FROM_WALL * (scenario.robot_radius - radius)
        needed = (way + farther) * (scenario.driving_energy + scenario.idle_power / speed)
        if energy < needed:
            raise ValueError(
                f"battery = {energy:g} J does not bring a robot{name} the {way:.1f} m from the "
                f"storage to a station: should be at least {needed:.0f} J, or a station be nearer"
            )
