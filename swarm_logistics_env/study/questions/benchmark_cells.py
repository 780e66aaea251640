"""The benchmark's third edition: its space of worlds, its reference, and how cells are drawn.

A cell is a world of robots that could exist, with or without a fault, in which a policy is set
beside one reference script at the same seeds. All of this was declared before an entry was played:

* Each dimension of `SPACE` takes one of its values, independent of the others, in the preset
  `realistic` with items that come back. `orders` stays "next", as orders that come by themselves
  cap P. Worlds that cannot be built, or in which robots or items stand too dense or too thin
  (`ROOM_OF_ROBOT`, `MOST_COVER`), are drawn again.
* The development half is drawn from the word "development", the same for everybody: practise it.
* The held-out half is drawn from the digest of the entry (`entry_digest`): of a network its weights
  and settings, of a script its class and parameters, of code its content, of several trainings of
  one recipe all of them together. So it is known only when the entry is frozen, and each entry is
  played in cells of its own, with the reference beside it. Whoever freezes many entries and shows
  the one with the kindest cells deceives; a table of entries names the digest of each.
* Values follow from hashes of the digest, a dimension and a cell's number alone. No library draws
  them, so that they stay the same.
"""

from __future__ import annotations

import math
from itertools import count
from typing import Any

from swarm_logistics_env.core import streams
from swarm_logistics_env.core.errors import ScenarioError, StudyError
from swarm_logistics_env.core.fingerprint import UNSTABLE
from swarm_logistics_env.policies.spec import PolicySpec
from swarm_logistics_env.study.tasks.task import digest_of
from swarm_logistics_env.world.scenario import Scenario

from .comparison import Setting
from .specification import Ablation, FieldTable, Specification

EDITION = 3
REFERENCE = "homing-stock"  # the script that has score 1
DEVELOPMENT = "Development"
HELD_OUT = "Held out"
N_CELLS = {DEVELOPMENT: 12, HELD_OUT: 24}
SEEDS = 4
FIRST_SEED = 530_000  # nothing was tuned or trained on these seeds
ROOM_OF_ROBOT = (1.0, 10.0)  # least and most floor of a robot [m^2]
MOST_COVER = 0.05  # of the floor by items

BASE = Scenario.preset("realistic").replace(restock=True)
# Fields of a scenario, tables of several of them, and what else makes a cell. All values that stand
# here are equally likely: one that stands twice, mostly the preset's, is drawn twice as often.
SPACE: dict[str, tuple[Any, ...]] = {
    "room": (
        {"warehouse_width": 6.0, "warehouse_height": 6.0},
        {},
        {"n_obstacles": 10},
        {"warehouse_width": 20.0},
        {"warehouse_width": 20.0, "warehouse_height": 20.0},
        {"floor": "aisles"},
        {"floor": "bottleneck"},
        {"floor": "two_docks"},
        {"floor": "large"},
    ),
    "n_robots": (5, 10, 25, 50, 100),
    "items_per_robot": (1, 2, 4, 8),
    "n_requests": (1, 1, 5),
    "demand": ("closed", "closed", "zipf"),
    "request_timeout": (None, None, 60.0),
    "drive": ("differential", "differential", "holonomic"),
    "max_speed": (0.5, 1.0, 1.0, 2.0),
    "max_acceleration": (1.0, 2.0, 2.0, 4.0),
    "speed_mix": ([1.0], [1.0], [1.0, 0.5]),
    "handling_time": (0.5, 1.0, 1.0, 2.0, 4.0),
    "heading_drift": (0.02, 0.05, 0.05, 0.1),
    "senses": ({}, {}, {"ranger_noise": 0.06, "position_noise": 0.1, "radio_loss": 0.3}),
    # Failure modes, in a third of the cells none.
    "mode": (
        "", "", "", "", "", "FM1", "FM2", "FM3", "FM4", "FM4_jam", "dead", "motor_slow",
        "rangers_blind", "FM1+FM4_jam", "FM2+motor_slow",
    ),
    "share_failing": (0.1, 0.2),
    "onset": (0.0, 250.0),
}  # fmt: skip


def drawn_cells(half: str, source: str, n: int) -> tuple[Ablation, ...]:
    """Return n cells of the space, as parts of a study that have the reference beside a policy.

    Args:
        half: how their titles begin.
        source: text that they follow from, as a digest. The first cells do not depend on n.
    """
    seed = int(digest_of(f"benchmark {EDITION}", source), 16)
    reference = PolicySpec.of(REFERENCE)
    return tuple(
        Ablation(title=f"{half} {number + 1}", policy=reference, **_drawn_fields(seed, number))
        for number in range(n)
    )


def _drawn_fields(seed: int, number: int) -> dict[str, Any]:
    """Return the world and the fault of the first draw that can be built and is not too dense."""
    for attempt in count():
        choice = {
            dimension: values[streams.key(seed, dimension, number, attempt) % len(values)]
            for dimension, values in SPACE.items()
        }
        fields = _fields(choice)
        try:
            scenario = BASE.replace(**fields)
        except ScenarioError:
            continue
        if _has_usual_density(scenario):
            break
    usual = BASE.model_dump(mode="json")
    counts = "n_robots", "n_items"
    changed = {
        name: value for name, value in fields.items() if name in counts or value != usual[name]
    }
    return {
        "scenario": changed,
        "mode": choice["mode"],
        "robots": max(1, round(choice["share_failing"] * scenario.n_robots)),
        "onset": choice["onset"],
    }


def _fields(choice: dict[str, Any]) -> FieldTable:
    """Return the fields of the scenario that a value of each dimension makes."""
    n_items = choice["n_robots"] * choice["items_per_robot"]
    fields: FieldTable = {"n_robots": choice["n_robots"], "n_items": n_items}
    for dimension, value in choice.items():
        if isinstance(value, dict):
            fields |= value
        elif dimension in Scenario.model_fields:
            fields[dimension] = value
    return fields


def _has_usual_density(scenario: Scenario) -> bool:
    """Return whether robots and items have the room that they have in the space."""
    room = scenario.warehouse_width * scenario.warehouse_height
    least, most = ROOM_OF_ROBOT
    cover = scenario.n_items * math.pi * scenario.item_radius**2 / room
    return least <= room / scenario.n_robots <= most and cover <= MOST_COVER


def entry_digest(policy: PolicySpec) -> str:
    """Return the digest of a frozen entry, 64 hexadecimal digits: equal wherever its file lies.

    Raises:
        PolicyError: it cannot be made.
        StudyError: it is another one each time, so that nothing can be drawn from it.
    """
    identities = sorted(training.identity() for training in policy.trainings or (policy,))
    if any(UNSTABLE in identity for identity in identities):
        raise StudyError(
            f"policy {policy.title!r} cannot be compared with itself, so that no cells can be "
            "drawn from its digest: should keep numbers, texts and arrays, or have an `identity`"
        )
    return digest_of(*identities)


def development_cells() -> tuple[Ablation, ...]:
    """Return the development half, which is the same for everybody."""
    return drawn_cells(DEVELOPMENT, "development", N_CELLS[DEVELOPMENT])


def words_of(cell: Ablation) -> str:
    """Return the world of a cell and what fails in it, e.g. "n_robots = 5; FM1, m = 1".

    What is not named is as in `BASE`.
    """
    world = ", ".join(f"{name} = {value}" for name, value in cell.scenario.items())
    fault = Setting("fault", cell.mode, cell.robots, cell.onset)
    return f"{world}; {fault}" if cell.mode else world


def benchmark_study(policy: PolicySpec) -> Specification:
    """Return the study of a policy in the benchmark: both halves.

    Raises:
        PolicyError: it cannot be made.
        StudyError: nothing can be drawn from it, or it is the reference itself.
    """
    digest = entry_digest(policy)
    if digest == entry_digest(PolicySpec.of(REFERENCE)):
        raise StudyError(f"policy {policy.title!r} is the benchmark's reference: its score is 1")
    return Specification(
        name="benchmark",
        policies=(policy,),
        seeds=SEEDS,
        first_seed=FIRST_SEED,
        scenario=BASE,
        ablations=(*development_cells(), *drawn_cells(HELD_OUT, digest, N_CELLS[HELD_OUT])),
    )
