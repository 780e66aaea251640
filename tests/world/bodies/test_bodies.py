"""Bodies that others move: what the world hands them, and what it takes from them."""

from __future__ import annotations

import copy
import math
import random
import sys
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, run_episode
from swarm_logistics_env.adapters import SwarmVecEnv
from swarm_logistics_env.core.errors import BodiesError, CommandError, SetupError
from swarm_logistics_env.policies import load
from swarm_logistics_env.study.studies import Study
from swarm_logistics_env.world.bodies import Orders, Placement, Poses, load_bodies
from swarm_logistics_env.world.warehouse.structs import NOBODY


class Exact:
    """Robots that do what they want, through each other."""

    def place(self, placement: Placement) -> None:
        """Begin at rest."""
        self.period = placement.scenario.control_period
        self.position, self.heading = placement.position, placement.heading

    def move(self, orders: Orders) -> Poses:
        """Move as wanted."""
        forward, left, turn_rate = orders.motion.T
        cosine, sine = np.cos(self.heading), np.sin(self.heading)
        velocity = np.column_stack([cosine * forward - sine * left, sine * forward + cosine * left])
        self.position = self.position + self.period * velocity
        self.heading = self.heading + self.period * turn_rate
        return Poses(self.position, self.heading, velocity, np.zeros(len(forward), np.bool_))


class Watched(Exact):
    """Robots that do what they want, and now and then lose one; keeps what it was told."""

    def place(self, placement: Placement) -> None:
        """Begin at rest, with a stream of its own."""
        super().place(placement)
        self.rng = random.Random(placement.seed)
        self.orders: list[Orders] = []

    def move(self, orders: Orders) -> Poses:
        """Move as wanted, but for robots that are lost from now on."""
        self.orders.append(orders)
        poses = self.poses = super().move(orders)
        if self.rng.random() < 0.05:
            robot = self.rng.randrange(len(orders.laden))
            poses.lost[robot] = True
            poses.position[robot] = math.nan
            self.position[robot] = 0.0
        return poses


class LosesTheFirst(Exact):
    """Loses robot 0 in the third period."""

    steps = 0

    def move(self, orders: Orders) -> Poses:
        """Move as wanted, but for the lost robot."""
        self.steps += 1
        poses = super().move(orders)
        if self.steps >= 3:
            poses.position[0] = np.nan
            poses.lost[0] = True
        return poses


class Breaks(Exact):
    """Raises in the third period."""

    steps = 0

    def move(self, orders: Orders) -> Poses:
        """Move until it breaks."""
        self.steps += 1
        if self.steps == 3:
            raise RuntimeError("the camera is off")
        return super().move(orders)


class Misread(Exact):
    """Returns poses in which something cannot be."""

    changes: ClassVar[dict[str, Any]] = {}

    def move(self, orders: Orders) -> Poses:
        """Return poses that are changed."""
        return super().move(orders)._replace(**self.changes)


class Stays:
    """Cannot move."""

    def place(self, placement: Placement) -> None: ...


class Unmade(Exact):
    """Cannot be made."""

    def __init__(self) -> None:
        raise OSError("no camera")


class Notes(Exact):
    """Does what is wanted, and keeps what it was told."""

    def place(self, placement: Placement) -> None:
        """Begin at rest."""
        self.placement, self.orders = placement, list[Orders]()
        super().place(placement)

    def move(self, orders: Orders) -> Poses:
        """Move as wanted."""
        self.orders.append(orders)
        return super().move(orders)


def scenario(name: str = "Exact", **fields: Any) -> Scenario:
    defaults = {"bodies": f"{__name__}:{name}", "n_robots": 3, "n_items": 5, "duration": 5.0}
    return Scenario(**{**defaults, **fields})


def test_a_robot_drives_as_its_bodies_do_and_carries_its_item_along() -> None:
    world = Warehouse(scenario(n_robots=1, n_items=1, restock=True, duration=100.0))
    world.reset(seed=2)
    start, heading = world.state.robot_position[0].copy(), world.state.robot_heading[0]
    world.step([[0.5, 0.0, 0.0, 0.0]])
    displacement = world.state.robot_position[0] - start
    step = 0.5 * world.scenario.max_speed * world.scenario.control_period
    assert displacement == pytest.approx(step * np.array([np.cos(heading), np.sin(heading)]))
    episode = run_episode(world.scenario, load("homing"), seed=2)
    assert episode.delivered > 0


def test_bodies_are_told_where_everything_is_and_what_robots_want() -> None:
    fields: dict[str, Any] = {"n_obstacles": 1, "pickup_range": 20.0, "floor": "A=:/A.:/A::"}
    fields |= {"cell_size": 2.0, "heading_drift": 0.1, "ranger_range": 1.0}
    world: Any = Warehouse(scenario("Notes", **fields))
    world.reset(7, ["dead:1"])
    state, bodies = world.state, world._elsewhere._bodies
    placement, orders = bodies.placement, bodies.orders
    dead = world.struck_robots[0]
    assert (placement.scenario, placement.seed) == (world.scenario, 7)
    np.testing.assert_array_equal(placement.position, state.robot_position)
    np.testing.assert_array_equal(placement.heading, state.robot_heading)
    np.testing.assert_array_equal(placement.obstacles, state.obstacle_position)
    assert placement.boxes.tolist() == [[2.0, 4.0, 4.0, 6.0]]
    before = state.robot_heading.copy()
    for _ in range(12):  # more than half a turn
        world.step(np.tile([0.3, 0.0, 0.5, 1.0], (3, 1)))
    drives = np.arange(3) != dead
    motion = np.array([0.6, 0.0, 3.0])  # of 2 m/s and 6 rad/s
    for order in orders:
        drift = np.outer(state.robot_heading_drift, [0.0, 0.0, 1.0])
        np.testing.assert_allclose(order.motion, (motion + drift) * drives[:, None], atol=1e-12)
        assert order.present.tolist() == [True] * 3
    assert [order.laden.tolist() for order in orders[:3]] == [[False] * 3, *[drives.tolist()] * 2]
    np.testing.assert_allclose(np.hypot(*state.robot_velocity.T), 0.6 * drives)
    turns = np.remainder(state.robot_heading - before + np.pi, 2.0 * np.pi) - np.pi
    expected = 1.2 * (3.0 + state.robot_heading_drift) * drives
    np.testing.assert_allclose(np.cos(turns - expected), 1.0)
    np.testing.assert_allclose(state.robot_turn_rate[drives], 3.0)
    np.testing.assert_allclose(state.robot_position, bodies.position)
    assert (np.abs(state.robot_heading) <= np.pi).all()


def test_nobody_leaves_the_warehouse_whatever_the_bodies_say() -> None:
    world = Warehouse(scenario())
    world.reset(seed=0)
    for _ in range(50):
        world.step(np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)))
    size = [world.scenario.warehouse_width, world.scenario.warehouse_height]
    assert ((world.state.robot_position >= 0.0) & (world.state.robot_position <= size)).all()


def test_a_robot_that_handles_an_item_or_is_dead_is_ordered_to_stand() -> None:
    world = Warehouse(scenario())
    world.reset(seed=0, faults=["dead:1"])
    dead = world.struck_robots[0]
    start = world.state.robot_position.copy()
    world.step(np.tile([0.1, 0.0, 0.0, 0.0], (3, 1)))
    has_moved = (world.state.robot_position != start).any(axis=1)
    assert not has_moved[dead]
    assert has_moved.sum() == 2


def test_a_command_that_is_not_finite_is_refused_before_the_bodies_hear_of_it() -> None:
    world = Warehouse(scenario("Breaks"))  # at the third order
    world.reset(seed=0)
    for _ in range(3):
        with pytest.raises(CommandError, match=r"commands\[1, 2\] = inf"):
            world.step([[0.0] * 4, [0.0, 0.0, np.inf, 0.0], [0.0] * 4])
    assert world.state.step == 0


def test_a_lost_robot_leaves_the_arena_and_its_item_stays() -> None:
    world = Warehouse(scenario("LosesTheFirst"))
    world.reset(seed=0)
    for step in range(4):
        world.step(np.zeros((3, 4)))
        assert world.state.robot_present.tolist() == [step < 2, True, True]
    assert world.state.robot_item[0] == NOBODY
    assert np.isfinite(world.state.robot_position).all()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position": np.zeros(3)}, r"position of shape \(3,\): should be \(3, 2\)"),
        (
            {"heading": np.array([0.0, np.nan, 0.0])},
            r"^bodies: pose \[.*, nan, .*\] of robot 1: should be finite, or the robot be lost$",
        ),
        ({"heading": np.zeros((3, 1))}, r"heading of shape \(3, 1\): should be \(3,\)$"),
        ({"velocity": np.zeros((2, 3))}, r"velocity of shape \(2, 3\): should be \(3, 2\)$"),
        ({"lost": [False]}, r"lost of shape \(1,\): should be \(3,\)$"),
        (
            {"velocity": np.full((3, 2), np.inf)},
            r"inf\] of robot 0: should be finite, or the robot ",
        ),
    ],
)
def test_poses_that_cannot_be_are_refused(
    changes: dict[str, Any], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = scenario("Misread")
    monkeypatch.setattr(type(load_bodies(settings.bodies)), "changes", changes)
    world = Warehouse(settings)
    world.reset(seed=0)
    with pytest.raises(BodiesError, match=message):
        world.step(np.zeros((3, 4)))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mujoko", "no bodies 'mujoko'.*did you mean 'mujoco'"),
        (f"{__name__}:Exakt", "has no Exakt; did you mean 'Exact'"),
        ("no_such_module:Bodies", "cannot be imported"),
        (f"{__name__}:Path", r"Path' have no method place: should be as `Bodies`$"),
        (f"{__name__}:Stays", r"Stays' have no method move: should be as `Bodies`$"),
        (f"{__name__}:Unmade", r"Unmade' cannot be made: OSError: no camera$"),
    ],
)
def test_bodies_that_there_are_not_are_named(name: str, message: str) -> None:
    with pytest.raises(BodiesError, match=message):
        load_bodies(name)


def test_bodies_whose_package_is_missing_say_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(
        sys.modules, "swarm_logistics_env.world.bodies.dotbots_bodies", raising=False
    )
    monkeypatch.setitem(sys.modules, "dotbot.dotbot_simulator", None)
    with pytest.raises(BodiesError, match=r"bodies 'dotbots' .*pip install .*'\.\[dotbots\]'"):
        load_bodies("dotbots")


def test_a_world_with_other_bodies_is_not_copied_in_mid_episode() -> None:
    world = Warehouse(scenario())
    copy.deepcopy(world)  # nothing has begun
    world.reset(seed=0)
    with pytest.raises(SetupError, match="cannot be copied during an episode"):
        copy.deepcopy(world)
    world.reset(seed=0, scenario=Scenario(n_robots=3))
    world.step(np.zeros((3, 4)))
    assert (copy.deepcopy(world).state.robot_position == world.state.robot_position).all()


def test_a_study_keeps_a_run_whose_bodies_broke_as_failed(tmp_path: Path) -> None:
    study = Study(
        name="breaks",
        policies=["homing"],
        seeds=1,
        scenario=scenario("Breaks"),
        sizes=[{"values": [2, 3]}],
        out=tmp_path,
    )
    tally = study.run(processes=1)
    assert tally.failed == 2
    assert "the camera is off" in str(tally.error)


def test_worlds_with_other_bodies_step_in_turn_in_a_vector_environment() -> None:
    env = SwarmVecEnv(scenario(), n_worlds=2)
    env.seed(0)
    rows = env.reset()
    actions = np.zeros((len(rows), *env.action_space.shape), np.float32)
    actions[:, 0] = 0.5
    after, *_ = env.step(actions)
    assert after.shape == rows.shape
    assert not np.array_equal(after, rows)
