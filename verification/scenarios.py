"""Random scenarios, faults and changes of every kind that the validator accepts."""

from __future__ import annotations

import random
from typing import Any

from swarm_logistics_env import Fault, Scenario
from swarm_logistics_env.errors import ScenarioError
from swarm_logistics_env.scenario import LONGEST_STRIDE
from swarm_logistics_env.warehouse import FAILURE_MODES

# Lengths are drawn around the robot's own, so that things meet; the rest within what may be built.
CHANGEABLE = ("delivery_width", "max_speed", "view_range", "radio_range", "pickup_range", "relay",
              "timer_limit", "drive", "ranger_noise", "sensor_dropout", "radio_loss",
              "restock")  # fmt: skip


def drawn_scenario(source: random.Random) -> Scenario:
    """Return a scenario; a robot sinks into nothing only where drives are of a robot's strength.

    Raises:
        ScenarioError: what was drawn cannot be.
    """
    return Scenario(**_fields(source))


def some_scenario(source: random.Random) -> Scenario:
    """Return a scenario, drawn again until one can be."""
    while True:
        try:
            return drawn_scenario(source)
        except ScenarioError:
            continue


def _fields(source: random.Random) -> dict[str, Any]:
    def number(low: float, high: float) -> float:
        return float(low * (high / low) ** source.random())

    def rarely(value: Any, otherwise: Any) -> Any:
        return value if source.random() < 0.25 else otherwise

    radius = number(0.05, 0.3)
    width = number(1.0, 12.0)
    physics_period = source.choice([0.01, 0.02, 0.005])
    fields: dict[str, Any] = {
        "robot_radius": radius,
        "item_radius": number(0.03, 0.3),
        "warehouse_width": width,
        "warehouse_height": number(0.8, 12.0),
        "delivery_width": width * source.uniform(0.05, 0.6),
        "n_robots": int(number(1, 40)),
        "n_items": int(number(1, 60)),
        "duration": 1e6,
        "restock": source.random() < 0.5,
        "n_obstacles": rarely(source.randint(1, 6), 0),
        "obstacle_radius": number(0.05, 0.6),
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
        "memory_size": source.randint(0, 4),
        "timer_limit": number(0.5, 20.0),
        "relay": rarely("gossip", "none"),
        "ranger_noise": rarely(number(0.01, 1.0), 0.0),
        "position_noise": rarely(number(0.01, 1.0), 0.0),
        "sensor_dropout": rarely(source.random(), 0.0),
        "radio_loss": rarely(source.random(), 0.0),
        "heading_drift": rarely(number(0.01, 1.0), 0.02),
        "message_size": rarely(source.randint(1, 4), 0),
        "control_period": physics_period * source.randint(1, 5),
        "physics_period": physics_period,
    }
    return fields


def drawn_faults(source: random.Random, scenario: Scenario, seconds: float) -> list[Fault]:
    """Return up to three faults that begin, and some of which end, within `seconds`."""
    faults = []
    for _ in range(source.choice([0, 0, 1, 2, 3])):
        mode = source.choice(sorted(FAILURE_MODES))
        onset = source.choice([0.0, source.uniform(0.0, seconds)])
        passes = mode != "removed" and source.random() < 0.5
        duration = source.uniform(0.1, seconds) if passes else None
        robots = source.randint(1, scenario.n_robots)
        breaks = (source.uniform(0.05, 2.0), source.uniform(0.05, 2.0))
        is_steady = mode == "removed" or source.random() < 0.7
        intermittent = None if is_steady else breaks
        faults.append(Fault(mode, robots, onset, duration, intermittent=intermittent))
    return faults


def drawn_change(source: random.Random, scenario: Scenario) -> dict[str, Any]:
    """Return one or two fields for `Warehouse.change`; what cannot be is refused there."""
    fields = _fields(source)
    fields["delivery_width"] = scenario.warehouse_width * source.uniform(0.05, 0.6)
    fields["max_speed"] = scenario.max_speed * source.uniform(0.3, 1.0)
    chosen = source.sample(CHANGEABLE, source.randint(1, 2))
    return {name: fields[name] for name in chosen}
