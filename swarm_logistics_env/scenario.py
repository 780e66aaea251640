"""Scenario: every condition of one run, frozen and validated, each with its unit and source."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from swarm_logistics_env.errors import ScenarioError, suggest
from swarm_logistics_env.floor import (
    PLAN_SIZES,
    FloorPlan,
    floor_plan,
    floor_title,
    with_plan_sizes,
)
from swarm_logistics_env.records import Record
from swarm_logistics_env.scenario_checks import check

# The public addresses of the sources that defaults were taken from.
SOURCES = {
    "paper": "https://arxiv.org/abs/2311.01944",
    "simulator": "https://github.com/emmilner/swarm_sim",
    "descendant": "https://github.com/suet-lee/swarm-warehouse",
    "DOTS": "https://arxiv.org/abs/2203.13809",
}

CHIPMUNK = "chipmunk"  # the engine of the package, which pymunk brings

# Where `demand` is "zipf", item i is asked for with a weight of 1 / (i + 1) ** ZIPF_EXPONENT.
ZIPF_EXPONENT = 1.0

# Numbers beyond these do not survive in float32 observations, or vanish when squared.
SMALLEST, LARGEST = 1e-9, 1e9
Positive = Annotated[float, Field(ge=SMALLEST, le=LARGEST)]
NonNegative = Annotated[float, Field(ge=0, le=LARGEST)]
Count = Annotated[int, Field(ge=1, le=LARGEST)]
Probability = Annotated[float, Field(ge=0, le=1)]
Mix = Annotated[tuple[Annotated[float, Field(gt=0, le=1)], ...], Field(min_length=1)]

# These may change while robots are at work; the others are built into arena, bodies and spaces.
CHANGES_DURING_RUN = frozenset(
    {
        "delivery_width",
        "duration",
        "restock",
        "max_speed",
        "max_turn_rate",
        "ranger_range",
        "view_range",
        "radio_range",
        "pickup_range",
        "timer_limit",
        "relay",
        "drive",
        "speed_mix",
        "sensing_mix",
        "ranger_noise",
        "position_noise",
        "sensor_dropout",
        "radio_loss",
        "demand",
        "dock_capacity",
    }
)


class Scenario(Record):
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

    n_robots: Count = Field(25, description="swarm size N [robots]; source: paper")
    n_items: Count = Field(60, description="items in storage at the start; source: paper")
    floor: str | None = Field(
        None, description="plan of walls, racks and docks: a shipped name, a file, or its rows; off"
    )
    cell_size: Positive = Field(0.5, description="side of a plan's cell [m]; chosen")
    warehouse_width: Positive = Field(10.0, description="along x [m]; source: paper")
    warehouse_height: Positive = Field(10.0, description="along y [m]; source: paper")
    delivery_width: Positive = Field(
        2.0,
        description="delivery area: strip along the wall at the highest x [m]; source: simulator",
    )
    duration: Positive = Field(500.0, description="episode [s]; source: paper")
    restock: bool = Field(
        False, description="a delivered item returns to storage and requests never end; off"
    )
    n_requests: Count = Field(
        1, description="items asked for at a time, delivered in any order; source: paper"
    )
    demand: Literal["closed", "independent", "zipf"] = Field(
        "closed",
        description="closed: every item once in a random order, then anew; independent: each "
        "request is a uniform draw of its own; zipf: as that, but item i is (i + 1) times as rare "
        "as item 0; source: simulator",
    )
    request_docks: Literal["any", "random"] = Field(
        "any", description="random: each request names a dock, which alone takes its item; off"
    )
    dock_capacity: Positive | None = Field(
        None,
        description="deliveries that are taken in all [1/s], the oldest request first; the others "
        "wait; none: any number at once; off",
    )
    handling_time: NonNegative = Field(
        0.0, description="a robot stands so long to lift, to put down and to deliver [s]; off"
    )
    n_obstacles: Annotated[int, Field(ge=0, le=LARGEST)] = Field(0, description="static discs; off")
    obstacle_radius: Positive = Field(0.3, description="[m], if there are any; off")
    bodies: str = Field(
        CHIPMUNK,
        description="what moves the robots: chipmunk, the engine of the package; mujoco; dotbots; "
        "package.module:Class or my.py:Class, which runs its code; chosen",
    )

    robot_radius: Positive = Field(0.125, description="[m]; source: DOTS, simulator")
    robot_mass: Positive = Field(3.0, description="[kg]; source: DOTS")
    max_speed: Positive = Field(
        2.0, description="[m/s], DOTS drive 1; source: simulator, descendant"
    )
    max_acceleration: Positive = Field(20.0, description="[m/s^2], nearly at once; fitted")
    max_turn_rate: Positive = Field(6.0, description="[rad/s]; source: DOTS")
    ranger_range: Positive = Field(2.0, description="16 laser rangers [m]; source: DOTS")
    view_range: Positive = Field(
        1.0, description="items and robots in view of the cameras [m]; source: DOTS"
    )
    radio_range: Positive = Field(4.0, description="how far a robot is heard [m]; fitted")
    pickup_range: Positive = Field(
        0.25,
        description="lifts an item this near, centre to centre [m]; source: simulator, descendant",
    )
    drive: Literal["holonomic", "differential"] = Field(
        "holonomic", description="differential: no sideways motion, `left` is ignored; source: DOTS"
    )
    heading_drift: NonNegative = Field(
        0.02,
        description="every robot's body turns at a constant rate that nobody tells it, normal with "
        "this standard deviation [rad/s]: a poor gyro; chosen",
    )
    speed_mix: Mix = Field(
        (1.0,), description="robot i has factor i (repeating) of max_speed and turn rate; off"
    )
    sensing_mix: Mix = Field(
        (1.0,), description="robot i has factor i (repeating) of ranger and view range; off"
    )
    memory_size: Annotated[int, Field(ge=0, le=16)] = Field(
        2, description="items last put down, not lifted again until a delivery; source: simulator"
    )
    timer_limit: Positive = Field(
        10.0, description="timer since the delivery area falls silent at [s]; source: paper"
    )
    relay: Literal["none", "gossip"] = Field(
        "none", description="robots tell their own timer, or the lowest heard, aged; source: paper"
    )

    ranger_noise: NonNegative = Field(
        0.0, description="standard deviation of every beam [m]; not published, so 0; off"
    )
    position_noise: NonNegative = Field(
        0.0, description="standard deviation of x and of y of neighbours and items [m]; off"
    )
    sensor_dropout: Probability = Field(
        0.0, description="a beam, or a thing in view, is missed in a step [probability]; off"
    )
    radio_loss: Probability = Field(
        0.0, description="what one robot sends another is lost in a step [probability]; fitted"
    )
    message_size: Annotated[int, Field(ge=0, le=64)] = Field(
        0, description="numbers in [-1, 1] that each robot broadcasts as it likes; off"
    )

    item_radius: Positive = Field(0.125, description="[m]; source: simulator, descendant")
    control_period: Positive = Field(0.1, description="one command per [s]; fitted")
    physics_period: Positive = Field(0.02, description="one physics step per [s]; fitted")

    @property
    def storage_width(self) -> float:
        """Width of the storage, everything left of the delivery area [m]."""
        return self.warehouse_width - self.delivery_width

    @property
    def longest_way(self) -> float:
        """No way to a delivery area is longer [m]."""
        if self.plan is None:
            return self.warehouse_width
        return float(self.plan.kind.size * 2.0**0.5 * self.cell_size)  # over all cells, askew

    @property
    def n_steps(self) -> int:
        """Control steps in an episode."""
        return math.ceil(self.duration / self.control_period - 1e-9)

    @property
    def n_substeps(self) -> int:
        """Physics steps in a control step."""
        return round(self.control_period / self.physics_period)

    @property
    def handling_steps(self) -> int:
        """Control steps in `handling_time`."""
        return math.ceil(self.handling_time / self.control_period - 1e-9)

    @property
    def dock_period(self) -> float:
        """The least time between two deliveries [s]; 0: none."""
        return 0.0 if self.dock_capacity is None else 1.0 / self.dock_capacity

    @property
    def is_independent(self) -> bool:
        """Whether each request is drawn for itself."""
        return self.demand != "closed"

    @property
    def names_docks(self) -> bool:
        """Whether each request names its dock."""
        return self.request_docks == "random"

    @property
    def popularity_exponent(self) -> float:
        """How fast the items' popularity falls with their numbers, where it is drawn."""
        return ZIPF_EXPONENT if self.demand == "zipf" else 0.0

    @property
    def is_gossip(self) -> bool:
        """Whether robots tell on what they heard."""
        return self.relay == "gossip"

    @property
    def is_holonomic(self) -> bool:
        """Whether robots can move sideways."""
        return self.drive == "holonomic"

    @property
    def plan(self) -> FloorPlan | None:
        """The floor plan, checked; None: an empty room."""
        if self.floor is None:
            return None
        return floor_plan(self.floor, self.cell_size, 2.0 * self.robot_radius)

    def replace(self, **fields: Any) -> Self:
        """Return a copy with `fields` changed; with a plan the sizes are those of the plan."""
        values = dict(self)
        if self.floor is not None or fields.get("floor") is not None:
            values = {name: value for name, value in values.items() if name not in PLAN_SIZES}
        return type(self)(**{**values, **fields})

    @model_validator(mode="before")
    @classmethod
    def _with_plan(cls, fields: object) -> object:
        if not isinstance(fields, dict) or not isinstance(fields.get("floor"), str):
            return fields
        defaults = {name: field.default for name, field in cls.model_fields.items()}
        return with_plan_sizes({**defaults, **fields}, given=fields)

    @model_validator(mode="after")
    def _possible(self) -> Self:
        check(self)
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


def _as_text(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else floor_title(str(value))


SCENARIO_PRESETS: dict[str, Scenario] = {
    "paper": Scenario(),
    # Table I delivers 74 of its items, so it cannot have held 60.
    "paper_scalability": Scenario(n_items=100),
    "dots": Scenario(max_speed=1.0, max_acceleration=2.0),
    # Frozen, so that what is tuned or trained on it can be compared. Each number has its source;
    # radius, mass, turn rate and ranges are the defaults.
    "realistic": Scenario(
        drive="differential",  # chosen: harder than DOTS, which drive in every direction
        max_speed=1.0,  # DOTS: the developers' documents
        max_acceleration=2.0,  # simulator: its header
        ranger_noise=0.03,  # chosen: a fourth of a robot's radius
        position_noise=0.05,  # chosen: a fifth of a robot's diameter
        sensor_dropout=0.02,  # chosen: one reading of 50
        radio_loss=0.1,  # chosen: one message of ten
        heading_drift=0.05,  # chosen: 3 degrees/s, a gyro that nobody calibrated
        handling_time=1.0,  # chosen: to lift, to put down, to deliver
        dock_capacity=1.0,  # chosen: whoever takes deliveries needs 1 s for each
    ),
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
