"""Rows and commands that come late or are lost, in simulated time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.core.errors import PolicyError, RobotError
from swarm_logistics_env.policies.files import write_policy
from swarm_logistics_env.policies.learned import Network, PolicyCard, tensor_shapes
from swarm_logistics_env.policies.row_policy import Robot
from swarm_logistics_env.robots.middleware import (
    Link,
    Middleware,
    OverMiddleware,
    RobotOverMiddleware,
)

SWARM = Scenario(n_robots=4, n_items=8, warehouse_width=5.0, warehouse_height=4.0)
N_STEPS = 60


def paths(policy: Any) -> np.ndarray[Any, Any]:
    """Return the places of all robots after each step."""
    world = Warehouse(SWARM)
    policy.configure(SWARM)
    policy.reset(SWARM.n_robots, 2)
    rows = world.reset(2)
    places = []
    for _ in range(N_STEPS):
        # As commands travel.
        rows = world.step(policy.act(rows).astype(np.float32))
        places.append(world.state.robot_position.copy())
    return np.array(places)


def answered(middleware: Middleware, periods: int, seed: int = 0) -> np.ndarray[Any, Any]:
    """Return which row each of four robots acts upon in each period, from 1 on; 0: it stands."""
    link = Link(middleware, period=0.1, n_robots=4, seed=seed)
    in_use = []
    for period in range(periods):
        for robot, sensed_in, row in link.deliver(np.full((4, 3), period + 1, np.float32)):
            assert row.tolist() == [sensed_in + 1] * 3
            link.answer(robot, sensed_in, [sensed_in + 1, 0.0, 0.0, 0.0])
            link.answer(robot, sensed_in, [-1.0, 0.0, 0.0, 0.0])  # a second one goes nowhere
        in_use.append(link.commands()[:, 0])
    return np.array(in_use)


@pytest.mark.parametrize("name", ["homing", "ppo-robust"])
def test_without_losses_a_swarm_runs_as_without_middleware(name: str) -> None:
    over_middleware = OverMiddleware(name)
    np.testing.assert_array_equal(paths(over_middleware), paths(policies.load(name)))
    assert np.ptp(paths(over_middleware), axis=0).min() > 0.0


@pytest.mark.parametrize(("delay", "periods"), [(0.0, 0), (0.01, 1), (0.05, 1), (0.1, 2)])
def test_a_round_trip_takes_whole_periods(delay: float, periods: int) -> None:
    rows = answered(Middleware(delay=delay), 6)[:, 0]
    assert rows.tolist() == [max(period - periods, 0) for period in range(1, 7)]


def test_who_gets_no_new_row_goes_on_and_then_stands() -> None:
    link = Link(Middleware(stop_after=3), period=0.1, n_robots=1, seed=0)
    (first,) = link.deliver(np.zeros((1, 3), np.float32))
    link.answer(0, first.period, [0.5, 0.0, 1.0, 1.0])
    commands = [link.commands()[0].tolist() for _ in range(6)]
    assert commands == [[0.5, 0.0, 1.0, 1.0]] * 4 + [[0.0] * 4] * 2


def test_losses_hit_rows_and_commands_as_often_as_said_and_nothing_goes_back_in_time() -> None:
    middleware = Middleware(loss=0.1, delay=0.02, jitter=0.3, stop_after=50)
    rows = answered(middleware, 500)
    assert (np.diff(rows, axis=0) >= 0).all()
    np.testing.assert_array_equal(rows, answered(middleware, 500))
    assert (rows != answered(middleware, 500, seed=1)).any()
    without_jitter = answered(Middleware(loss=0.1, stop_after=50), 500)
    is_fresh = without_jitter == np.arange(1, 501)[:, np.newaxis]
    assert is_fresh.mean() == pytest.approx(0.9**2, abs=0.04)
    assert not answered(Middleware(loss=1.0), 5).any()


def test_each_way_takes_up_to_the_jitter_longer() -> None:
    rows = answered(Middleware(jitter=0.3, stop_after=50), 400).astype(np.int64)
    late = (np.arange(1, 401)[:, np.newaxis] - rows)[10:]
    assert (late.min(), late.max()) == (1, 6)  # of periods of 0.1 s
    assert late.mean() == pytest.approx(3.3, abs=0.2)


def test_what_is_lost_does_not_depend_on_other_settings_or_on_other_robots() -> None:
    losses = answered(Middleware(loss=0.3, stop_after=50), 100)
    more = answered(Middleware(loss=0.5, stop_after=50), 100)
    fresh = np.arange(1, 101)[:, np.newaxis]
    assert (losses == fresh)[more == fresh].all()
    few = Link(Middleware(loss=0.3), period=0.1, n_robots=1, seed=0)
    arrivals = [bool(few.deliver(np.zeros((1, 3), np.float32))) for _ in range(5)]
    many = Link(Middleware(loss=0.3), period=0.1, n_robots=4, seed=0)
    of_first = [
        0 in {arrival.robot for arrival in many.deliver(np.zeros((4, 3), np.float32))}
        for _ in range(5)
    ]
    assert arrivals == of_first


def test_a_robot_whose_rows_are_lost_decides_once_for_each_period() -> None:
    rows = Warehouse(SWARM).reset(2)

    def robot() -> Robot:
        return Robot(policies.load("homing"), SWARM, 0.1, seed=0)

    few_rows = RobotOverMiddleware(robot(), stop_after=5)
    all_rows = robot()
    few_rows.step(rows[0], n_periods=7)  # nothing came before
    all_rows.step(rows[0])
    for row, n_periods, n_decisions in ((rows[1], 3, 3), (rows[2], 99, 6), (rows[3], 0, 1)):
        command = few_rows.step(row, n_periods)
        commands = [all_rows.step(row) for _ in range(n_decisions)]
        np.testing.assert_array_equal(command, commands[-1])


def test_it_decides_on_a_row_once_for_each_period_that_it_may_catch_up_with() -> None:
    class Counting:
        n_steps = 0

        def step(self, row: Any) -> Any:
            self.n_steps += 1
            return [row, self.n_steps]

    late: Any = RobotOverMiddleware(Counting(), stop_after=5)  # type: ignore[arg-type]
    steps = [late.step("row", n_periods) for n_periods in (7, 3, 99, 6, 1, 0)]
    assert steps == [["row", total] for total in (1, 4, 10, 16, 17, 18)]


def test_nobody_is_steered_before_an_episode_begins() -> None:
    assert OverMiddleware("homing").act(np.zeros((0, 141), np.float32)).shape == (0, 4)


def test_it_tells_its_policy_and_what_is_set() -> None:
    assert repr(OverMiddleware("homing")) == "OverMiddleware('homing')"
    settings = repr(OverMiddleware("homing", delay=0.05, loss=0.1))
    assert settings == "OverMiddleware('homing', loss=0.1, delay=0.05)"


@pytest.mark.parametrize(
    "setting", ["loss=1.5", "loss=-0.1", "delay=-0.1", "jitter=-0.1", "delay=inf", "stop_after=0"]
)
def test_a_setting_that_cannot_be_is_refused(setting: str) -> None:
    name, number = setting.split("=")
    with pytest.raises(RobotError, match=f"Middleware.{name} = "):
        OverMiddleware("homing", **{name: float(number)})


def test_a_policy_that_sees_everything_or_talks_is_refused(tmp_path: Path) -> None:
    network = Network(hidden=(4,), talks=True)
    tensors = {name: np.zeros(shape, np.float32) for name, shape in tensor_shapes(network).items()}
    path = tmp_path / "talking.safetensors"
    write_policy(path, PolicyCard(name="talking", network=network), tensors)
    with pytest.raises(PolicyError, match="and middleware carries no messages"):
        OverMiddleware(str(path))
    with pytest.raises(PolicyError, match="sees the state of the whole warehouse"):
        OverMiddleware("central")
