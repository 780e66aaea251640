"""The fields of a scenario, each with its unit, range, meaning and source, and what follows."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from swarm_logistics_env.core.records import Record
from swarm_logistics_env.world.floor import FloorPlan, floor_plan

from .order_file import NEXT, ORDER_SHAPES, OrderFile, order_file
from .ranges import LARGEST, Count, Mix, NonNegative, Positive, Probability
from .robot_kinds import Kinds, OfKinds

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
        "request_timeout",
        "request_delay",
        "request_loss",
        "order_rate",
        "order_cycle",
        "order_due",
        "charging_power",
        "dead_stations",
    }
)

# Left out of what is written while they are off, as before there were such fields, so that stored
# runs stay known.
UNWRITTEN_WHEN_OFF = {
    "robot_kinds": ("robot_kinds",),
    "battery": (
        "battery", "idle_power", "driving_energy", "lifting_energy", "charging_power",
        "n_stations", "dead_stations",
    ),
}  # fmt: skip


class ScenarioFields(OfKinds, Record):
    """What a `Scenario` consists of, whose docstring says how a description ends.

    Each value is within its range; `checks` compares the values with each other.
    """

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
    request_timeout: Positive | None = Field(
        None,
        description="a request that is not served so long [s] is put back, and the next item is "
        "asked for; none: it waits for ever, as in the paper; off",
    )
    request_delay: NonNegative = Field(
        0.0, description="a robot is told of a request so long after it is asked for [s]; off"
    )
    request_loss: Probability = Field(
        0.0, description="a robot is never told of a request [probability]; off"
    )
    orders: str = Field(
        NEXT,
        description="next: an item is asked for when one was delivered; poisson, bursts, day: "
        "orders come at random, and wait; a CSV file with the columns time and item, or its rows; "
        "source: paper",
    )
    order_rate: Positive = Field(
        0.1, description="orders that come on average, where they are drawn [1/s]; chosen"
    )
    order_cycle: Positive = Field(
        100.0, description="time from burst to burst, or the length of a day [s]; chosen"
    )
    order_due: Positive | None = Field(
        None, description="an order is due so long after it came [s]; none: never; off"
    )
    announced: Literal["oldest", "urgent", "all"] = Field(
        "oldest",
        description="which of the orders that wait is asked for where one of n_requests is free: "
        "the oldest; the one of the highest priority that is due first; or all at once; off",
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
    robot_kinds: Kinds = Field(
        (),
        description="kinds of robots, each with a name, its count in a pattern that repeats over "
        "the robots, and the fields that differ; none: all are alike; off",
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

    @model_serializer(mode="wrap")
    def _serialize(self, write: SerializerFunctionWrapHandler) -> dict[str, Any]:
        written: dict[str, Any] = write(self)
        for switch, names in UNWRITTEN_WHEN_OFF.items():
            is_on = bool(getattr(self, switch))
            for name in names:
                if not is_on and getattr(self, name) == type(self).model_fields[name].default:
                    written.pop(name, None)
        return written

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
    def draws_docks(self) -> bool:
        """Whether the dock of a request is drawn."""
        return self.request_docks == "random"

    @property
    def names_docks(self) -> bool:
        """Whether requests name their docks."""
        return self.draws_docks or (self.order_file is not None and self.order_file.names_docks)

    @property
    def has_orders(self) -> bool:
        """Whether orders come by themselves, and wait."""
        return self.orders != NEXT

    @property
    def order_file(self) -> OrderFile | None:
        """The orders of a file, checked; None: there is none."""
        if self.orders in (NEXT, *ORDER_SHAPES):
            return None
        return order_file(self.orders)

    @property
    def order_shape(self) -> tuple[float, ...]:
        """Factors of `order_rate` in equal parts of `order_cycle`, with mean 1."""
        return ORDER_SHAPES.get(self.orders, (0.0,))

    @property
    def n_open(self) -> int:
        """The most requests that are open at a time."""
        return self.n_items if self.has_orders and self.announced == "all" else self.n_requests

    @property
    def is_urgent_first(self) -> bool:
        """Whether the most urgent order is asked for first."""
        return self.announced == "urgent"

    @property
    def longest_request(self) -> float:
        """The time after which a request is put back [s]; infinite: never."""
        return math.inf if self.request_timeout is None else self.request_timeout

    @property
    def due_after(self) -> float:
        """The time from an order to when it is due [s]; infinite: never."""
        return math.inf if self.order_due is None else self.order_due

    @property
    def has_due_times(self) -> bool:
        """Whether an order may be late."""
        listed = self.order_file  # a file says itself what is due
        return self.order_due is not None if listed is None else listed.has_due_times

    @property
    def tells_all(self) -> bool:
        """Whether every robot is told of every request at once."""
        return self.request_delay == 0.0 and self.request_loss == 0.0

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
    def dock_names(self) -> tuple[str, ...]:
        """Letters of the docks; none in an empty room, whose delivery area has no name."""
        return () if self.plan is None else self.plan.dock_names

    @property
    def plan(self) -> FloorPlan | None:
        """The floor plan, checked; None: an empty room."""
        if self.floor is None:
            return None
        return floor_plan(self.floor, self.cell_size, 2.0 * self.robot_radius)
