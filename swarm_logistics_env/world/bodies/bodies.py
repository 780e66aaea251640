"""The seam: bodies that something else than the package's own engine moves.

The world hands them what the robots want to do in a control period and takes where they are after
it. Items, requests, sensors, radio and faults stay the world's, as augmented reality has it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.core.code_files import MissingNameError, import_named
from swarm_logistics_env.core.errors import (
    RAISED_BY_OTHERS,
    BodiesError,
    SwarmLogisticsError,
    how_to_install,
    suggest,
)
from swarm_logistics_env.world.scenario import CHIPMUNK, Scenario

Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Placement(NamedTuple):
    """Where everything is when an episode begins; x and y from a corner of the floor [m].

    Attributes:
        scenario: sizes, limits, drive and periods; `of_robots` tells those of each robot.
        seed: of the episode, from which bodies draw all that is random.
        position: of the robots (N, 2).
        heading: of the robots (N,) [rad], counter-clockwise from the x axis.
        obstacles: centres of the static discs (M, 2).
        boxes: racks and walls in the room (B, 4), lowest x and y, highest x and y.
    """

    scenario: Scenario
    seed: int
    position: Numbers
    heading: Numbers
    obstacles: Numbers
    boxes: Numbers


class Orders(NamedTuple):
    """What the robots want to do in a control period.

    Attributes:
        motion: (N, 3) velocity forward and to the left [m/s], turn rate counter-clockwise [rad/s].
            Who ignores commands or handles an item has zeros.
        laden: whether a robot carries an item (N,).
        present: whether it is there (N,); one that is not stands in nobody's way.
    """

    motion: Numbers
    laden: Flags
    present: Flags


class Poses(NamedTuple):
    """Where the robots are after a control period.

    Attributes:
        position: (N, 2) [m].
        heading: (N,) [rad], of any number of turns.
        velocity: (N, 2) [m/s] along x and y.
        lost: whether nobody knows where a robot is any more (N,); the world takes it out for good.
    """

    position: Numbers
    heading: Numbers
    velocity: Numbers
    lost: Flags


class Bodies(Protocol):
    """Robots' bodies that something else than the package's own engine moves."""

    def place(self, placement: Placement) -> None:
        """Begin an episode; called at every reset.

        Raises:
            BodiesError: these bodies cannot be what the scenario wants.
        """

    def move(self, orders: Orders) -> Poses:
        """Move for a control period and return where the robots are.

        What it raises ends the run, which a study stores as failed, with the traceback.
        """


# By name: module, class, and the package of which extra it needs.
BODIES = {
    "mujoco": ("mujoco_bodies", "MujocoBodies", "mujoco"),
    "dotbots": ("dotbots_bodies", "DotbotsBodies", "dotbots"),
}


def load_bodies(name: str) -> Bodies | None:
    """Return new bodies; None: the package's own engine moves the robots.

    Args:
        name: "chipmunk", one of `BODIES`, "package.module:Class" or "my.py:Class". Naming a class
            imports, and so executes, its module.

    Raises:
        BodiesError: there are no such bodies, or the package that they need is not installed.
    """
    if name == CHIPMUNK:
        return None
    make = _named_class(name) if ":" in name else _known_class(name)
    try:
        bodies = make()
    except SwarmLogisticsError:
        raise
    except RAISED_BY_OTHERS as error:
        kind = type(error).__name__
        raise BodiesError(f"bodies {name!r} cannot be made: {kind}: {error}") from error
    for method in ("place", "move"):
        if not callable(getattr(bodies, method, None)):
            raise BodiesError(f"bodies {name!r} have no method {method}: should be as `Bodies`")
    return bodies


def _known_class(name: str) -> Callable[[], Bodies]:
    if name not in BODIES:
        hint = suggest(name, [CHIPMUNK, *BODIES])
        raise BodiesError(f"no bodies {name!r} (a name, 'my.py:Class' or 'module:Class'){hint}")
    module, class_name, extra = BODIES[name]
    try:
        code = import_module(f"{__package__}.{module}")
    except ImportError as error:
        raise BodiesError(f"bodies {name!r} ({error}): {how_to_install(extra)}") from error
    except RAISED_BY_OTHERS as error:  # of a package that this machine cannot load
        kind = type(error).__name__
        raise BodiesError(f"bodies {name!r} cannot be imported: {kind}: {error}") from error
    make: Callable[[], Bodies] = getattr(code, class_name)
    return make


def _named_class(name: str) -> Callable[[], Bodies]:
    try:
        make: Callable[[], Bodies] = import_named(name)
    except MissingNameError as error:
        raise BodiesError(f"bodies {name!r}: {error}") from None
    except RAISED_BY_OTHERS as error:
        kind = type(error).__name__
        raise BodiesError(f"bodies {name!r} cannot be imported: {kind}: {error}") from error
    return make


def checked_poses(poses: Poses, n_robots: int) -> Poses:
    """Return poses as arrays of the right shapes.

    Raises:
        BodiesError: a shape is wrong, or a number of a robot that is not lost is not finite.
    """
    position, heading, velocity = (np.asarray(part, np.float64) for part in poses[:3])
    lost = np.asarray(poses.lost, np.bool_)
    shapes = {
        "position": (position, (n_robots, 2)),
        "heading": (heading, (n_robots,)),
        "velocity": (velocity, (n_robots, 2)),
        "lost": (lost, (n_robots,)),
    }
    for name, (array, shape) in shapes.items():
        if array.shape != shape:
            raise BodiesError(f"bodies: {name} of shape {array.shape}: should be {shape}")
    numbers = np.column_stack([position, heading, velocity])
    is_bad = ~np.isfinite(numbers).all(axis=1) & ~lost
    if is_bad.any():
        robot = int(is_bad.argmax())
        raise BodiesError(
            f"bodies: pose {numbers[robot].tolist()} of robot {robot}: should be finite, or the "
            "robot be lost"
        )
    return Poses(position, heading, velocity, lost)
