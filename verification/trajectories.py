"""Golden trajectories: recorded digests of every bit that a seed decides, one world per rule.

    python -m verification.trajectories            # compare with the record
    python -m verification.trajectories --record   # write the record anew: a change of behaviour

The record says on which machine it was written. Its key "stories" is the former name of golden
trajectories.
"""

import copy
import hashlib
import json
import platform
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, policies
from swarm_logistics_env.core.streams import key
from swarm_logistics_env.policies.policy import decide, start
from swarm_logistics_env.world.warehouse import FAILURE_MODES

RECORD = Path(__file__).with_name("trajectories.json")
DECIDING = ("numpy", "numba", "pymunk")  # whose versions may change a bit

# Steps after which the digests are noted: where two trajectories part, the last equal one says.
NOTED = (0, 1, 2, 5, 10, 25, 50, 100, 200, 300, 650)
GROUPS: dict[str, tuple[str, ...]] = {
    "robots": (
        "robot_position", "robot_velocity", "robot_heading", "robot_heading_drift",
        "robot_contact", "robot_present", "robot_in_delivery", "max_speed", "max_turn_rate",
    ),
    "items": (
        "item_position", "item_status", "item_carrier", "item_covered", "robot_item",
        "robot_memory", "obstacle_position",
    ),
    "signals": ("robot_timer", "robot_told", "robot_heard", "robot_message", "last_in_delivery"),
    "counts": ("step", "time", "requested", "delivery_times", "delivered_by", "anchoring_seconds"),
    "orders": ("orders",),
    "batteries": ("batteries",),
    "contacts": ("contacts",),
}  # fmt: skip

Events = Mapping[int, Callable[[Warehouse], None]]  # what is done to the world before a step
Digests = dict[str, str]  # step -> digests, one per group


class GoldenTrajectory(NamedTuple):
    """What decides a trajectory; every fifth command of the policy is replaced by a random one."""

    scenario: Scenario
    faults: tuple[Fault, ...] = ()
    steps: int = 200
    policy: str = "swarm-dt-2026"
    seed: int = 0
    events: Events = MappingProxyType({})


def _small(*faults: Fault, **fields: Any) -> GoldenTrajectory:
    """Return one of a warehouse in which six robots deliver within seconds."""
    story = {
        name: fields.pop(name) for name in ("steps", "policy", "seed", "events") if name in fields
    }
    size = {"n_robots": 6, "n_items": 10, "warehouse_width": 4.0, "warehouse_height": 3.0}
    return GoldenTrajectory(Scenario(**{**size, "delivery_width": 1.0, **fields}), faults, **story)


def _in_aisles(policy: str) -> GoldenTrajectory:
    scenario = Scenario(floor="aisles", n_robots=12, n_obstacles=3, restock=True)
    return GoldenTrajectory(scenario, policy=policy, steps=300)


def _preset(
    name: str, steps: int, policy: str = "swarm-dt-2026", **changed: Any
) -> GoldenTrajectory:
    scenario = Scenario.preset(name).replace(**changed)
    return GoldenTrajectory(scenario, steps=steps, policy=policy)


# Orders for an item or for one of a class, at a dock or at any, due or not.
_LISTED = (
    "0,3,A,20,0", "0,tin,,30,1", "1,3,B,,0", "2,5,,25,2", "4,box,B,,0", "30,1,,,0", "90,tin,A,99,1"
)  # fmt: skip


GOLDEN = {
    "preset paper": _preset("paper", 100),
    "preset paper_scalability": _preset("paper_scalability", 50),
    "preset dots": _preset("dots", 100),
    "preset realistic": _preset("realistic", 100),
    "preset realistic, as kind as in 0.3": _preset(
        "realistic", 100, max_speed=2.0, sensor_dropout=0.0, handling_time=0.0, dock_capacity=None
    ),
    "seed 1": _small(seed=1),
    "long, past the rebuilding of bodies": _small(restock=True, steps=650),
    "until all is delivered": _small(n_items=2, n_robots=8, steps=300),
    "obstacles": _small(n_obstacles=4, obstacle_radius=0.2),
    "restock": _small(restock=True, n_items=3, steps=300),
    "gossip": _small(relay="gossip", radio_range=1.0),
    "ranger noise": _small(ranger_noise=0.05),
    "position noise": _small(position_noise=0.05),
    "sensor dropout": _small(sensor_dropout=0.3),
    "radio loss": _small(radio_loss=0.5),
    "all noise": _small(ranger_noise=0.1, position_noise=0.1, sensor_dropout=0.1, radio_loss=0.1),
    "messages": _small(message_size=3),
    "differential drive": _small(drive="differential"),
    "mixed swarm": _small(speed_mix=(1.0, 0.5), sensing_mix=(1.0, 0.6, 0.3)),
    "no memory": _small(memory_size=0),
    "long memory": _small(memory_size=5),
    "other periods": _small(control_period=0.2, physics_period=0.01, max_speed=1.0),
    "jam": _small(n_robots=30, n_items=1, steps=100),
    "swarm-dt": _small(policy="swarm-dt"),
    "swarm-dt-follow": _small(policy="swarm-dt-follow"),
    "random-walk": _small(policy="random-walk"),
    "central": _small(policy="central"),
}
for _mode in FAILURE_MODES:
    _passing = None if _mode == "removed" else 6.0
    _size = 2 if _mode.startswith("message_") else 0
    _fields = {"message_size": _size, "battery": 300.0 if _mode == "cell_fades" else None}
    _first = Fault(_mode, 2, duration=8.0 if _mode == "away" else None)
    GOLDEN[f"{_mode} from the start"] = _small(_first, **_fields)
    GOLDEN[f"{_mode} for a while"] = _small(Fault(_mode, 3, 5.0, _passing), **_fields)
for _policy in ("homing", "homing-stock", "swarm-dt-tuned"):
    GOLDEN[f"{_policy} in dotbots"] = _preset("dotbots", 200, policy=_policy, restock=True)
GOLDEN |= {
    "several faults at once": _small(
        Fault("FM1", (0, 1)), Fault("motor_slow", (1, 2), 3.0, 5.0, 0.3), Fault("FM4", 2, 8.0)
    ),
    "faults that come and go": _small(
        Fault("motor_wear", 2, intermittent=(2.0, 1.0)),
        Fault("FM3", 3, 2.0, 9.0, None, (1.0, 1.0)),
    ),
    "without drift": _small(heading_drift=0.0),
    "a day's robots": GoldenTrajectory(
        Scenario.preset("day").replace(battery=2000.0, order_rate=0.5),
        (Fault("away", 2, 5.0, 10.0), Fault("dead", 2, intermittent=(5.0, 5.0))),
        policy="homing+charging",
        steps=650,
    ),
    "orders in bursts": GoldenTrajectory(
        Scenario.preset("orders").replace(order_rate=0.5, order_cycle=20.0, request_timeout=10.0),
        policy="homing-stock",
        steps=650,
    ),
    "robots of two sizes": GoldenTrajectory(
        Scenario(n_robots=16, n_items=20, n_obstacles=2, restock=True, warehouse_width=6.0).replace(
            robot_radius=0.2,
            battery=500.0,
            robot_kinds="porter robot_mass=6.0, runner:3 robot_radius=0.1 robot_mass=1.5",
        ),
        (Fault("away", 2, 5.0, 10.0),),
        policy="homing+charging",
        steps=300,
    ),
    "batteries that run empty": _small(
        battery=200.0, position_noise=0.05, sensor_dropout=0.1, message_size=2, steps=300
    ),
    "aisles": GoldenTrajectory(Scenario(floor="aisles", n_robots=40, restock=True), steps=300),
    "two docks and obstacles": GoldenTrajectory(
        Scenario(floor="two_docks", n_obstacles=3, ranger_noise=0.02), (Fault("removed", 2, 10.0),)
    ),
    "named docks": GoldenTrajectory(
        Scenario(floor="two_docks", request_docks="random", n_requests=3, restock=True),
        policy="homing",
        steps=650,
    ),
    "homing": _small(policy="homing", restock=True, steps=300),
    "homing in aisles": _in_aisles("homing"),
    "homing-stock": _small(policy="homing-stock", n_robots=8, restock=True, steps=300),
    "homing-stock with wheels": _small(
        policy="homing-stock", drive="differential", n_robots=8, restock=True, steps=300
    ),
    "homing-stock that lifts slowly": _small(
        policy="homing-stock", handling_time=0.3, n_robots=8, restock=True, steps=300
    ),
    "central-stock": _in_aisles("central-stock"),
    "ppo-robust": _small(policy="ppo-robust", restock=True, steps=300),
    "biased-walk": _small(policy="biased-walk", restock=True, steps=300),
    "biased-walk-compass": _small(
        policy="biased-walk-compass", drive="differential", n_items=16, steps=300
    ),
    "site-fidelity": _small(policy="site-fidelity", restock=True, n_obstacles=2, steps=300),
    "homing-told": _small(policy="homing-told", restock=True, n_requests=2, steps=300),
    "central that lifts slowly": _small(
        policy="central", handling_time=0.3, n_robots=8, restock=True, steps=300
    ),
    "central-stock in realistic": _preset("realistic", 100, policy="central-stock", restock=True),
    "homing-stock in realistic": _preset("realistic", 200, policy="homing-stock", restock=True),
    "homing-stock in dots": _preset("dots", 200, policy="homing-stock", restock=True),
    "swarm-dt-tuned": _small(policy="swarm-dt-tuned", restock=True, steps=300),
    "ppo-delivery with wheels": _small(
        policy="ppo-delivery", drive="differential", n_obstacles=3, restock=True, steps=300
    ),
    "requests of few items, told late or never": _small(
        demand="zipf", n_requests=3, request_delay=1.0, request_loss=0.2, restock=True, steps=300
    ),
    "requests that are drawn each for itself": _small(demand="independent", restock=True),
    "a list of orders": GoldenTrajectory(
        Scenario(
            floor="A::::::B\n::::::::\n::::::::\n::::::::\n::::::::",
            n_robots=4,
            n_items=8,
            orders="time,item,dock,due,priority/" + "/".join(_LISTED),
            announced="urgent",
            restock=True,
        ),
        policy="homing",
        steps=650,
    ),
    "radios that are late with messages": _small(Fault("radio_delayed", 3, 2.0), message_size=2),
    "more robots than stations that charge": _small(
        battery=400.0,
        n_stations=3,
        dead_stations=2,
        n_robots=16,
        policy="homing+charging",
        restock=True,
        steps=650,
    ),
    "changes during the run": _small(
        delivery_width=0.5,
        events={
            50: lambda world: world.change(delivery_width=1.5, max_speed=1.0),
            100: lambda world: world.change(relay="gossip", radio_loss=0.2, ranger_noise=0.02),
            150: lambda world: world.change(drive="differential", view_range=0.4, restock=True),
        },
    ),
    "faults set during the run": _small(
        events={
            40: lambda world: world.set_faults([Fault("dead", 2)]),
            80: lambda world: world.set_faults([Fault("FM3", 3), Fault("removed", (5,))]),
            120: lambda world: world.set_faults([]),
        },
    ),
}


def _moments(golden: GoldenTrajectory, copied_at: int | None) -> Iterator[Warehouse]:
    """Yield the world after the reset and after every step; from `copied_at` on it is a copy."""
    world, policy = Warehouse(golden.scenario), policies.load(golden.policy)
    observations = world.reset(golden.seed, golden.faults)
    start(policy, golden.scenario, golden.seed)
    # The former name of golden trajectories decides what is drawn.
    numbers = np.random.Philox(key=key(golden.seed, "commands of a story"))
    yield world
    for step in range(golden.steps):
        if step in golden.events:
            golden.events[step](world)
        if step == copied_at:
            world, policy = copy.deepcopy((world, policy))
        commands = np.array(decide(policy, observations, world.state))
        # Raw numbers: their meaning never changes with a version of numpy.
        width = 4 + world.scenario.message_size
        drawn = numbers.random_raw((len(commands), width + 1)) * 2.0**-63 - 1.0
        commands = np.pad(commands, ((0, 0), (0, width - commands.shape[1])))
        commands = np.where(drawn[:, :1] < -0.6, 1.2 * drawn[:, 1:], commands)
        observations = world.step(commands)
        yield world


def digests(golden: GoldenTrajectory, *, copied_at: int | None = None) -> Digests:
    """Return the digests of all that was up to each noted step: observations, then `GROUPS`."""
    running = {name: hashlib.blake2b(digest_size=5) for name in ("observations", *GROUPS)}
    noted: Digests = {}
    for step, world in enumerate(_moments(golden, copied_at)):
        running["observations"].update(_bytes(world.observe()))
        for group, names in GROUPS.items():
            for name in names:
                running[group].update(_bytes(getattr(world.state, name)))
        if step in NOTED or step == golden.steps:
            noted[str(step)] = " ".join(digest.hexdigest() for digest in running.values())
    return noted


def _bytes(value: Any) -> bytes:
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return b"".join(map(_bytes, value))
    array = np.asarray(value)
    if array.dtype == object:  # no number has it
        return repr(value).encode()
    if array.dtype.kind == "f":
        array = np.where(np.isnan(array), array.dtype.type(np.nan), array)  # one NaN for all
    little: NDArray[Any] = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
    return little.tobytes()


def here() -> dict[str, str]:
    """Return what may decide a bit on this machine."""
    about = {"platform": f"{platform.system()}-{platform.machine()}"}
    about |= {"python": platform.python_version(), "libc": " ".join(platform.libc_ver())}
    return about | {name: version(name) for name in DECIDING}


def read_record() -> dict[str, Any]:
    """Return the record as it is stored."""
    record: dict[str, Any] = json.loads(RECORD.read_text(encoding="utf-8"))
    return record


def _parting(recorded: Digests, played: Digests) -> str | None:
    """Return in words where two trajectories part, or None if they are equal."""
    if list(recorded) != list(played):
        return f"noted after the steps {', '.join(recorded)} then, {', '.join(played)} now"
    before = "before the reset was over"
    for step, digest in recorded.items():
        pairs = zip(("observations", *GROUPS), digest.split(), played[step].split(), strict=True)
        if groups := [group for group, then, now in pairs if then != now]:
            return f"{', '.join(groups)} differ at step {step}, nothing did {before}"
        before = f"up to step {step}"
    return None


def explained(played: dict[str, Digests]) -> str | None:
    """Return which trajectories are not as recorded, where they part and on what machine."""
    record, now = read_record(), here()
    partings = {name: _parting(record["stories"][name], noted) for name, noted in played.items()}
    lines = [f"{name}: {words}" for name, words in partings.items() if words]
    if not lines:
        return None
    then = record["recorded_on"]
    differing = [what for what in now if then.get(what) != now[what]]
    other = [f"{what}: {then[what]} there, {now[what]} here" for what in differing]
    why = "; ".join(other) or "the same platform and versions, so the code has changed it"
    return "\n".join([f"{len(lines)} golden trajectories are not as recorded ({why})", *lines])


def main(record: bool = False) -> None:
    """Compare golden trajectories with their record, or write it anew."""
    played = {name: digests(golden) for name, golden in GOLDEN.items()}
    if record:
        written = {"recorded_on": here(), "stories": played}
        RECORD.write_text(json.dumps(written, indent=1) + "\n", encoding="utf-8")
        print(f"{len(GOLDEN)} golden trajectories written to {RECORD.name}")
        return
    difference = explained(played)
    print(difference or f"all {len(GOLDEN)} golden trajectories are as recorded")
    raise SystemExit(int(difference is not None))


if __name__ == "__main__":
    typer.run(main)
