"""Scenario: every condition of one run, frozen and validated, and its presets."""

from __future__ import annotations

from typing import Any, Self

from pydantic import model_validator

from swarm_logistics_env.core.errors import ScenarioError, suggest
from swarm_logistics_env.world.floor import PLAN_SIZES, floor_title, with_plan_sizes

from .battery_fields import BatteryFields, check_batteries
from .checks import check
from .fields import CHANGES_DURING_RUN, CHIPMUNK, SOURCES
from .order_file import orders_text, orders_title
from .ranges import LARGEST
from .robot_kinds import ROLES, RobotKind, Role, kinds_text, of_first_robots

__all__ = [
    "CHANGES_DURING_RUN",
    "CHIPMUNK",
    "LARGEST",
    "ROLES",
    "SCENARIO_PRESETS",
    "SOURCES",
    "RobotKind",
    "Role",
    "Scenario",
    "kinds_text",
    "of_first_robots",
]


class Scenario(BatteryFields):
    """Every condition of one run. The defaults are the paper's set-up.

    Each default ends with where it comes from. "source": see `SOURCES`; "paper" is Milner,
    Sooriyabandara and Hauert, Swarm Performance Indicators; "simulator" its author's early
    simulator, "descendant" a later one that grew from it; "DOTS" the robots' developers. "fitted":
    chosen here, because it brings the paper's tables closest. "chosen": here, without a source and
    fitted to nothing. "off": an addition of this package, which the default leaves out.

    Raises:
        ScenarioError: a field is unknown or out of range, or the whole cannot be built (robots
            or items that do not fit, a delivery area that leaves no storage).
    """

    error_type = ScenarioError

    def replace(self, **fields: Any) -> Self:
        """Return a copy with `fields` changed; with a plan the sizes are those of the plan."""
        values = dict(self)
        if self.floor is not None or fields.get("floor") is not None:
            values = {name: value for name, value in values.items() if name not in PLAN_SIZES}
        return type(self)(**{**values, **fields})

    @model_validator(mode="before")
    @classmethod
    def _with_files(cls, fields: object) -> object:
        if not isinstance(fields, dict):
            return fields
        if isinstance(fields.get("orders"), str):
            fields = {**fields, "orders": _with_orders(fields["orders"])}
        if not isinstance(fields.get("floor"), str):
            return fields
        defaults = {name: field.default for name, field in cls.model_fields.items()}
        return with_plan_sizes({**defaults, **fields}, chosen=fields)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        check(self)
        check_batteries(self)
        return self

    @classmethod
    def preset(cls, name: str) -> Scenario:
        """Return the scenario of that name in `SCENARIO_PRESETS`.

        Raises:
            ScenarioError: there is no such preset.
        """
        if name not in SCENARIO_PRESETS:
            raise ScenarioError(f"no scenario preset {name!r}{suggest(name, SCENARIO_PRESETS)}")
        return SCENARIO_PRESETS[name]

    def conditions(self) -> list[tuple[str, str, str]]:
        """Return name, value and description (unit, meaning; source) of every condition."""
        rows = []
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            mark = "" if value == field.default else f" (default {_as_text(field.default)})"
            rows.append((name, f"{_as_text(value)}{mark}", str(field.description)))
        return rows


def _with_orders(orders: str) -> str:
    try:
        return orders_text(orders)
    except ValueError as error:
        raise ValueError(f"Scenario.orders: {error}") from None


def _as_text(value: object) -> str:
    if isinstance(value, tuple) and all(isinstance(part, RobotKind) for part in value):
        return kinds_text(value) or "none"
    return f"{value:g}" if isinstance(value, float) else orders_title(floor_title(str(value)))


# Robots that could exist. Frozen, so that what is tuned or trained on it can be compared. Each
# number has its source; radius, mass, turn rate and ranges are the defaults.
_REALISTIC: dict[str, Any] = {
    "drive": "differential",  # chosen: harder than DOTS, which drive in every direction
    "max_speed": 1.0,  # DOTS: the developers' documents
    "max_acceleration": 2.0,  # simulator: its header
    "ranger_noise": 0.03,  # chosen: a fourth of a robot's radius
    "position_noise": 0.05,  # chosen: a fifth of a robot's diameter
    "sensor_dropout": 0.02,  # chosen: one reading of 50
    "radio_loss": 0.1,  # chosen: one message of ten
    "heading_drift": 0.05,  # chosen: 3 degrees/s, a gyro that nobody calibrated
    "handling_time": 1.0,  # chosen: to lift, to put down, to deliver
    "dock_capacity": 1.0,  # chosen: whoever takes deliveries needs 1 s for each
}
# Chosen, so that 25 robots are late now and then: three bursts of 30 orders, one every 1.3 s.
_ORDERS: dict[str, Any] = {
    **_REALISTIC,
    "duration": 600.0,
    "restock": True,
    "orders": "bursts",
    "order_rate": 0.15,
    "order_cycle": 200.0,
    "order_due": 60.0,
    "n_requests": 5,
    "request_timeout": 60.0,
}
# Chosen, so that 16 robots are late now and then: eight hours with the orders of a shop's day, one
# every 17 s on average. A battery is that of TurtleBot3 Burger; stations give more than all use.
_DAY: dict[str, Any] = {
    **_REALISTIC,
    "floor": "day",
    "n_robots": 16,
    "robot_kinds": "porter:3, runner:1 max_speed=1.5 max_acceleration=3.0",
    "duration": 28_800.0,
    "restock": True,
    "orders": "day",
    "order_rate": 0.06,
    "order_cycle": 28_800.0,
    "order_due": 300.0,
    "announced": "urgent",
    "n_requests": 5,
    "request_timeout": 180.0,
    "battery": 71_900.0,
    "charging_power": 60.0,
}
SCENARIO_PRESETS: dict[str, Scenario] = {
    "paper": Scenario(),
    # Table I delivers 74 of its items, so it cannot have held 60.
    "paper_scalability": Scenario(n_items=100),
    "dots": Scenario(max_speed=1.0, max_acceleration=2.0),
    "realistic": Scenario(**_REALISTIC),
    "orders": Scenario(**_ORDERS),
    "day": Scenario(**_DAY),
    # DotBots, third version. Published: radius (pydotbot, dotbot.sim.collisions), cruise speed and
    # the spin at 200 mm/s a wheel (DotBot-libs, drv/steering.h). Chosen: all else; ranges are the
    # paper's, smaller as the robots are, and so many requests that a trial has deliveries to count.
    "dotbots": Scenario(
        n_robots=20,
        n_items=20,
        warehouse_width=2.0,
        warehouse_height=2.0,
        delivery_width=0.4,
        duration=120.0,
        restock=True,
        n_requests=5,
        drive="differential",
        robot_radius=0.05,
        robot_mass=0.2,
        max_speed=0.3,
        max_acceleration=2.0,
        max_turn_rate=4.9,
        ranger_range=0.8,
        view_range=0.4,
        radio_range=1.6,
        pickup_range=0.1,
        heading_drift=0.0,
        item_radius=0.05,
    ),
}
