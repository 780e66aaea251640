"""Random worlds for as long as one likes, every invariant checked at every step.

    python -m verification.soak --minutes 10
    python -m verification.soak --first 4711 --worlds 1    # that world again
    python -m verification.soak --plans --worlds 5000 --steps 60    # each with a floor plan

Ends with 1 at the first broken promise, naming the world that shows it.
"""

import contextlib
import pickle
import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import typer
from numpy.typing import NDArray
from scipy import ndimage

from swarm_logistics_env import Fault, Scenario, Warehouse, policies
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.policies.policy import decide, start
from swarm_logistics_env.world.floor import PLAN_SIZES
from swarm_logistics_env.world.scenario.checks import LONGEST_STRIDE
from swarm_logistics_env.world.scenario.order_file import NEXT, ORDER_SHAPES
from swarm_logistics_env.world.warehouse import FAILURE_MODES
from verification.invariants import BrokenPromiseError, Watch

Steer = Callable[[Warehouse, NDArray[np.float32]], NDArray[np.float64]]

POLICIES = ("swarm-dt", "swarm-dt-follow", "random-walk", "central", "anything", "crowd")


N_COPIED = 10  # steps for which a pickled copy of a world is played beside it


@dataclass
class Tally:
    """What was played: numbers of worlds, steps and items, and the greatest overlap [m]."""

    worlds: int = 0
    steps: int = 0
    delivered: int = 0
    deepest: float = 0.0
    no_room: int = 0  # scenarios whose things found none at the reset

    def __str__(self) -> str:
        return (
            f"{self.steps} steps of {self.worlds} worlds, {self.delivered} items delivered, "
            f"greatest overlap {1000 * self.deepest:.1f} mm, {self.no_room} without room"
        )


# Lengths are drawn around the robot's own, so that things meet; the rest within what may be built.
CHANGEABLE = ("delivery_width", "max_speed", "view_range", "radio_range", "pickup_range", "relay",
              "timer_limit", "drive", "ranger_noise", "sensor_dropout", "radio_loss",
              "restock", "demand", "request_timeout", "request_delay", "request_loss", "order_rate",
              "order_due", "charging_power", "dead_stations")  # fmt: skip


def some_scenario(source: random.Random) -> Scenario:
    """Return a scenario, drawn again until one can be."""
    while True:
        with contextlib.suppress(ScenarioError):
            return Scenario(**_fields(source))


def _fields(source: random.Random) -> dict[str, Any]:
    def number(low: float, high: float) -> float:
        return float(low * (high / low) ** source.random())

    def rarely(value: Any, otherwise: Any) -> Any:
        return value if source.random() < 0.25 else otherwise

    radius = number(0.05, 0.3)
    width = number(1.0, 12.0)
    physics_period = source.choice([0.01, 0.02, 0.005])
    control_period = physics_period * source.randint(1, 5)
    n_items = int(number(1, 60))
    return {
        "robot_radius": radius,
        "item_radius": number(0.03, 0.3),
        "warehouse_width": width,
        "warehouse_height": number(0.8, 12.0),
        "delivery_width": width * source.uniform(0.05, 0.6),
        "n_robots": int(number(1, 40)),
        "n_items": n_items,
        "n_requests": rarely(source.randint(1, n_items), 1),
        "demand": source.choice(["closed", "closed", "independent", "zipf"]),
        "dock_capacity": rarely(number(0.1, 1.0 / control_period), None),
        "request_timeout": rarely(number(0.1, 20.0), None),
        "request_delay": rarely(number(0.1, 5.0), 0.0),
        "request_loss": rarely(source.random(), 0.0),
        "orders": rarely(source.choice([*ORDER_SHAPES, some_orders(source, n_items)]), NEXT),
        "order_rate": number(0.01, 2.0),
        "order_cycle": number(1.0, 100.0),
        "order_due": rarely(number(0.1, 20.0), None),
        "announced": source.choice(["oldest", "urgent", "all"]),
        "handling_time": rarely(number(0.02, 3.0), 0.0),
        "duration": 1e6,
        "restock": source.random() < 0.5,
        "n_obstacles": rarely(source.randint(1, 6), 0),
        "obstacle_radius": number(0.05, 0.6),
        # A robot sinks into nothing only where drives are of a robot's strength.
        "robot_mass": number(0.1, 50.0),
        "max_speed": min(number(0.2, 4.0), LONGEST_STRIDE * radius / physics_period),
        "max_acceleration": number(0.5, 40.0),
        "max_turn_rate": number(0.5, 20.0),
        "ranger_range": number(0.2, 6.0),
        "view_range": number(0.1, 4.0),
        "radio_range": number(0.2, 8.0),
        "pickup_range": number(0.05, 1.0),
        "drive": rarely("differential", "holonomic"),
        "speed_mix": rarely((1.0, 0.5, 0.2), (1.0,)),
        "sensing_mix": rarely((1.0, 0.3), (1.0,)),
        "robot_kinds": rarely(
            f"plain, other robot_radius={0.6 * radius} max_speed=0.2 drive=differential "
            "lifts=false",
            "",
        ),
        "memory_size": source.randint(0, 4),
        "timer_limit": number(0.5, 20.0),
        "relay": rarely("gossip", "none"),
        "ranger_noise": rarely(number(0.01, 1.0), 0.0),
        "position_noise": rarely(number(0.01, 1.0), 0.0),
        "sensor_dropout": rarely(source.random(), 0.0),
        "radio_loss": rarely(source.random(), 0.0),
        "heading_drift": rarely(number(0.01, 1.0), 0.02),
        "message_size": rarely(source.randint(1, 4), 0),
        "control_period": control_period,
        "physics_period": physics_period,
        "battery": rarely(number(20.0, 5000.0), None),
        "idle_power": rarely(number(1.0, 100.0), 5.0),
        "driving_energy": rarely(number(1.0, 100.0), 10.0),
        "charging_power": number(10.0, 1000.0),
        "dead_stations": rarely(1, 0),
        "floor": None,
    }


def some_orders(source: random.Random, n_items: int) -> str:
    """Return the rows of a file of orders, each for another item or for a class."""
    rows = ["time,item,due,priority"]
    for item in source.sample(range(n_items), source.randint(1, min(n_items, 5))):
        time = source.uniform(0.0, 20.0)
        due = source.choice(["", f"{time + source.uniform(0.0, 20.0)}"])
        rows.append(f"{time},{item},{due},{source.randint(0, 2)}")
    return "/".join(rows)


def some_planned_scenario(source: random.Random) -> Scenario:
    """Return a scenario with a random floor plan, drawn again until one can be."""
    while True:
        fields = _fields(source)
        sizes = {name: fields.pop(name) for name in PLAN_SIZES}
        fields["request_docks"] = source.choice(["any", "random"])
        cell_size = source.uniform(1.0, 5.0) * fields["robot_radius"]
        shape = [max(3, int(sizes[name] / cell_size)) for name in PLAN_SIZES[:2]]
        with contextlib.suppress(ScenarioError):
            return Scenario(
                **fields | {"floor": random_plan(source, *shape), "cell_size": cell_size}
            )


def random_plan(source: random.Random, n_columns: int, n_rows: int) -> str:
    """Return the rows of a plan of that size: solid cells anywhere, one dock or more."""
    share = source.choice([0.0, 0.1, 0.2, 0.3])
    free = source.choice([":", ":.", ":.+"])
    kinds = np.array([["#="[source.random() < 0.5] if source.random() < share
                       else source.choice(free) for _ in range(n_columns)]
                      for _ in range(n_rows)])  # fmt: skip
    if source.random() < 0.3:
        kinds[source.randrange(n_rows), source.randrange(n_columns)] = "*"
    for letter in "ABC"[: source.randint(1, 3)]:
        row, column = source.randrange(n_rows), source.randrange(n_columns)
        kinds[row : row + 2, column : column + 2] = letter
    # What no way leads to becomes solid.
    parts, _ = ndimage.label(~np.isin(kinds, ["#", "="]))
    docks = np.unique(parts[np.isin(kinds, list("ABC"))])
    kinds[~np.isin(parts, [part for part in docks if (kinds[parts == part] == ":").any()])] = "#"
    return "\n".join("".join(row) for row in kinds.tolist())


def drawn_faults(source: random.Random, scenario: Scenario, seconds: float) -> list[Fault]:
    """Return up to three faults that begin, and some of which end, within `seconds`."""
    faults = []
    for _ in range(source.choice([0, 0, 1, 2, 3])):
        modes = sorted(FAILURE_MODES)
        if scenario.battery is None:
            modes.remove("cell_fades")
        mode = source.choice(modes)
        onset = source.choice([0.0, source.uniform(0.0, seconds)])
        passes = mode == "away" or (mode != "removed" and source.random() < 0.5)
        duration = source.uniform(0.1, seconds) if passes else None
        robots = source.randint(1, scenario.n_robots)
        breaks = (source.uniform(0.05, 2.0), source.uniform(0.05, 2.0))
        is_steady = mode == "removed" or source.random() < 0.7
        intermittent = None if is_steady else breaks
        faults.append(Fault(mode, robots, onset, duration, intermittent=intermittent))
    return faults


def play(source: random.Random, steps: int, tally: Tally, plans: bool = False) -> None:
    """Play one random world and look at it after every step; `plans`: one with a floor plan."""
    draw = some_planned_scenario if source.random() < 0.4 or plans else some_scenario
    scenario = draw(source)
    seconds, seed = steps * scenario.control_period, source.randrange(2**32)
    world = Warehouse(scenario)
    tally.worlds += 1
    try:
        observations = world.reset(seed, drawn_faults(source, scenario, seconds))
    except ScenarioError:
        tally.no_room += 1
        return
    watch = Watch(world)
    watch.look()
    steer = _steered(source.choice(POLICIES), scenario, seed)
    copied_at, copy = source.randrange(steps), None
    try:
        for step in range(steps):
            if source.random() < 3.0 / steps:
                _disturb(source, world, seconds)
                watch.faults_changed()
                copy = None
            if step == copied_at:
                copy = pickle.loads(pickle.dumps(world))
            elif step == copied_at + N_COPIED:
                copy = None
            commands = steer(world, observations)
            observations = world.step(commands)
            watch.look()
            if copy is not None and copy.step(commands).tobytes() != observations.tobytes():
                raise BrokenPromiseError(f"a copy senses otherwise than its world at step {step}")
            tally.steps += 1
            if world.all_delivered:
                break
    except ScenarioError:  # an item that comes back finds no room
        tally.no_room += 1
    tally.delivered += world.state.delivered
    tally.deepest = max(tally.deepest, watch.deepest)


def _disturb(source: random.Random, world: Warehouse, seconds: float) -> None:
    """Set other faults, or change one or two fields; what these cannot be is refused."""
    if source.random() >= 0.5:
        world.set_faults(drawn_faults(source, world.scenario, seconds))
        return
    fields = _fields(source)
    fields["delivery_width"] = world.scenario.warehouse_width * source.uniform(0.05, 0.6)
    fields["max_speed"] = world.scenario.max_speed * source.uniform(0.3, 1.0)
    changeable = [n for n in CHANGEABLE if world.scenario.floor is None or n not in PLAN_SIZES]
    names = source.sample(changeable, source.randint(1, 2))
    with contextlib.suppress(ScenarioError):
        world.change(**{name: fields[name] for name in names})


def _steered(name: str, scenario: Scenario, seed: int) -> Steer:
    width = 4 + scenario.message_size
    rng = np.random.default_rng(seed)
    if name == "anything":
        return lambda world, _: rng.uniform(-1.5, 1.5, (world.state.n_robots, width))
    if name == "crowd":
        target = rng.uniform([0, 0], [scenario.warehouse_width, scenario.warehouse_height])
        return lambda world, _: towards(world, target, width)
    policy = policies.load(name)
    start(policy, scenario, seed)
    return lambda world, rows: decide(policy, rows, world.state)


def towards(world: Warehouse, target: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Return commands (N, width) that drive all to a place (2,), or each to its own (N, 2)."""
    away = target - world.state.robot_position
    angle = np.arctan2(away[:, 1], away[:, 0]) - world.state.robot_heading
    commands = np.zeros((len(away), width))
    driven = np.cos(angle), np.sin(angle), np.clip(angle, -1.0, 1.0), np.ones(len(away))
    commands[:, :4] = np.stack(driven, axis=1)
    return commands


def main(
    minutes: float = 10.0,
    first: int = 0,
    worlds: int = sys.maxsize,
    steps: int = 400,
    plans: bool = False,
) -> None:
    """Play at most so many random worlds of so many steps until the time is over."""
    tally, until = Tally(), time.monotonic() + 60.0 * minutes
    for number in range(first, first + worlds):
        try:
            play(random.Random(number), steps, tally, plans)
        except BrokenPromiseError as error:
            again = f"python -m verification.soak --first {number} --worlds 1 --steps {steps}"
            again += " --plans" * plans
            print(f"world {number}: {error} ({again})")
            raise SystemExit(1) from None
        if time.monotonic() > until:
            break
    print(f"no promise broken: {tally}")


if __name__ == "__main__":
    typer.run(main)
