"""The scripts that remember the way home, and those that keep a stock beside the delivery area."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, run_episode
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.homing import HomingParameters
from swarm_logistics_env.policies.homing_stock import Parameters
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import CLEARING_TIME

EAST, NORTH = (1.0, 0.0), (0.0, 1.0)
SMALL = Scenario(
    n_robots=10, n_items=24, warehouse_width=7.0, warehouse_height=5.0, duration=60.0, restock=True
)
WITHOUT_STOCK = {"homing-stock": "homing", "central-stock": "central"}


def fresh(n_robots: int, name: str = "homing") -> Any:
    policy = load(name)
    policy.reset(n_robots, 0)
    return policy


def rows_of(
    n_robots: int, velocity: tuple[float, float] = (0.0, 0.0), inside: bool = False
) -> NDArray[np.float32]:
    """Rows of robots far from everything that move at this velocity [m/s]."""
    rows = np.zeros((n_robots, row.N_COLUMNS), np.float32)
    rows[:, row.RANGE_WALLS : row.RANGE_WALLS + row.N_BEAMS] = 2.0
    rows[:, row.VELOCITY : row.VELOCITY + 2] = velocity
    rows[:, row.IN_DELIVERY_AREA] = inside
    return rows


def loaded(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    rows[:, [row.CARRYING, row.CARRYING_REQUESTED]] = 1.0
    return rows


@pytest.mark.daily
@pytest.mark.compiled
@pytest.mark.parametrize(
    ("name", "weaker", "times", "duration"),
    # The stock is laid in first.
    [("homing", "swarm-dt", 2, 60), *((*pair, 1.1, 200) for pair in WITHOUT_STOCK.items())],
)
def test_it_delivers_more_than_a_simpler_one(
    name: str, weaker: str, times: float, duration: float
) -> None:
    scenario = SMALL.replace(duration=duration)
    more, fewer = (
        sum(run_episode(scenario, load(policy), seed).delivered for seed in range(2))
        for policy in (name, weaker)
    )
    assert more > times * fewer


@pytest.mark.parametrize("entered", [EAST, NORTH])
def test_a_laden_robot_goes_where_it_entered_the_delivery_area(
    entered: tuple[float, float],
) -> None:
    policy = fresh(20)
    policy.act(rows_of(20, entered))
    policy.act(rows_of(20, entered, inside=True))
    policy.act(rows_of(20))  # outside again, without a direction of leaving
    for _ in range(20):  # what it commands becomes its heading, so it swings home
        commands = policy.act(loaded(rows_of(20, entered)))
    assert (commands[:, :2] @ np.array(entered) > 0.95).all()
    assert (commands[:, 2:] == [0.0, 1.0]).all()  # it never commands a turn


def test_a_robot_that_never_entered_knows_no_direction() -> None:
    commands = fresh(200).act(loaded(rows_of(200)))
    quarters = np.arctan2(commands[:, 1], commands[:, 0]) // (np.pi / 2)
    assert {-2, -1, 0, 1} <= set(quarters.tolist())


def test_it_follows_the_lowest_timer_heard_until_it_knows_the_way_for_sure() -> None:
    policy, rows = fresh(30), loaded(rows_of(30, EAST))
    rows[:, row.LOWEST_TIMER : row.LOWEST_TIMER + 3] = (1.0, *NORTH)
    for _ in range(20):
        commands = policy.act(rows)
    assert (commands[:, 1] > 0.9).all()
    for _ in range(4):  # enters in the east four times, without a way out at speed
        policy.act(rows_of(30, EAST))
        policy.act(rows_of(30, EAST, inside=True))
        policy.act(rows_of(30, inside=True))
        policy.act(rows_of(30))
    for _ in range(20):
        commands = policy.act(rows)
    assert (commands[:, 0] > 0.9).all()


@pytest.mark.unmeasured
@pytest.mark.compiled
@pytest.mark.parametrize("name", WITHOUT_STOCK)
@pytest.mark.parametrize("mode", ["FM1", "FM2", "FM3", "FM4", "motor_dead", "removed"])
def test_with_a_stock_it_gets_on_with_robots_that_fail(name: str, mode: str) -> None:
    assert run_episode(SMALL, load(name), 0, (Fault(mode, 2),)).delivered >= 4


def holders(scenario: Scenario) -> float:
    """Return the share of robots that hold: the fewer, the more items there are for each."""
    policy: Any = load("homing-stock")
    return float(policy.parameters.holders * (scenario.n_robots / scenario.n_items) ** 0.5)


def test_who_holds_keeps_its_item_and_who_stocks_puts_it_down_before_the_area() -> None:
    policy = fresh(400, "homing-stock")
    policy.act(rows_of(400, EAST))
    policy.act(rows_of(400, EAST, inside=True))
    leaving = rows_of(400, (-1.0, 0.0))
    leaving[:, row.CARRYING] = 1.0
    gripper = policy.act(leaving)[:, 3]
    assert set(gripper) == {-1.0, 0.0}
    assert (gripper == 0.0).mean() == pytest.approx(holders(Scenario()), abs=0.08)
    leaving[:, row.ITEMS : row.ITEMS + 3] = (1.0, 0.3, 0.3)  # no gap beside this item
    assert (policy.act(leaving)[:, 3] == 0.0).all()


def test_a_robot_whose_patience_is_over_leaves_the_requested_item_to_others_for_as_long() -> None:
    policy: Any = load("homing-stock", patience=7.95)
    policy.reset(20, 0)
    carrying = loaded(rows_of(20))
    carrying[:, row.VELOCITY] = 1.0  # it drives, so it is not stuck
    seeing = rows_of(20)
    seeing[:, row.ITEMS : row.ITEMS + 4] = (1.0, 0.1, 0.0, 1.0)
    grippers = [policy.act(carrying)[0, 3] for _ in range(80)]
    assert (policy.memories()["clearing"] == CLEARING_TIME).all()
    grippers += [policy.act(seeing)[0, 3] for _ in range(81)]
    assert grippers[:79] == [1.0] * 79
    assert grippers[79:159] == [-1.0] * 80
    assert grippers[160] == 1.0
    policy.act(loaded(rows_of(20, inside=True)))  # inside it waits as long as it takes
    inside = [policy.act(loaded(rows_of(20, inside=True)))[0, 3] for _ in range(8)]
    assert inside == [1.0] * 8


@pytest.mark.parametrize(
    ("n_items", "handling_time", "is_stocked"), [(60, 1.0, False), (10, 1.0, True), (60, 0.0, True)]
)
def test_a_stock_is_the_deeper_the_more_items_there_are_if_lifting_takes_time(
    n_items: int, handling_time: float, is_stocked: bool
) -> None:
    policy: Any = load("homing-stock")
    scenario = Scenario(n_items=n_items, handling_time=handling_time)
    policy.configure(scenario)
    policy.reset(400, 0)
    policy.act(rows_of(400, EAST))
    policy.act(rows_of(400, EAST, inside=True))
    leaving = rows_of(400, (-1.0, 0.0))
    for _ in range(20):
        policy.act(leaving)
    leaving[:, row.ITEMS : row.ITEMS + 3] = (1.0, 0.1, 0.0)  # 2 m from the area
    lifted = (policy.act(leaving)[:, 3] == 1.0).mean()
    assert lifted == pytest.approx(1.0 if is_stocked else holders(scenario), abs=0.08)


@pytest.mark.parametrize(
    ("fields", "depth"),
    [
        ({}, 0.6398),  # brakes in 0.1 m
        ({"max_speed": 1.0, "max_acceleration": 2.0}, 0.5648),
        ({"max_speed": 2.0, "max_acceleration": 0.5}, 0.0),
        ({"max_acceleration": 2.0, "n_requests": 2}, 0.6898),
        ({"robot_radius": 0.05, "n_requests": 2}, 2.2 * 0.27592),
        ({"max_acceleration": 2.0, "handling_time": 1.0}, 60 / 8.709),
    ],
)
def test_a_stock_is_the_less_deep_the_longer_robots_brake_and_the_smaller_they_are(
    fields: dict[str, Any], depth: float
) -> None:
    policy: Any = load("homing-stock")
    policy.configure(Scenario(**fields))
    assert Parameters(*policy._values).near == pytest.approx(depth)


def values_by_radius(name: str, *radii: float, **parameters: Any) -> list[dict[str, float]]:
    """Return the values that the kernel of a script gets, for robots of each radius."""
    policy: Any = load(name, **parameters)
    values = []
    for radius in radii:
        policy.configure(Scenario(robot_radius=radius, max_speed=0.5, n_requests=2))
        values.append(policy.parameters_type.for_kernels()(*policy._values)._asdict())
    return values


def test_every_length_of_a_stock_goes_with_the_radius_and_nothing_else_does_above_0_125_m() -> None:
    large, fitted, small = values_by_radius("homing-stock", 0.25, 0.125, 0.05)
    lengths = {name for name in fitted if name.endswith("_range")} | {"clearance", "near"}
    changed = {name for name in fitted if large[name] != fitted[name]}
    assert changed == lengths & fitted.keys()
    assert all(large[name] == pytest.approx(2.0 * fitted[name]) for name in changed)
    # Robots that are smaller have other parameters, too.
    assert small["avoid_gain"] == pytest.approx(0.351 * fitted["avoid_gain"])
    assert small["near"] == pytest.approx(0.4 * 2.2 * fitted["near"])


def test_homing_has_other_parameters_for_small_robots_and_goes_to_them_by_a_power() -> None:
    large, fitted, middle, small, tiny = values_by_radius(
        "homing", 0.2, 0.125, (0.125 * 0.05) ** 0.5, 0.05, 0.025
    )
    policy: Any = load("homing")
    assert fitted == dict(policy.parameters)
    factors = HomingParameters.of_small_robots
    assert small["spread_gain"] == pytest.approx(factors["spread_gain"] * fitted["spread_gain"])
    expected = 0.4 * factors["spread_range"] * fitted["spread_range"]
    assert small["spread_range"] == pytest.approx(expected)
    assert small["grip_range"] == pytest.approx(0.4 * fitted["grip_range"])
    assert small["home_share"] == fitted["home_share"]
    # The geometric mean of both radii has that of both values.
    assert all(middle[name] == pytest.approx((fitted[name] * small[name]) ** 0.5) for name in small)
    # Beyond both, lengths alone go on.
    assert large["spread_gain"] == fitted["spread_gain"]
    assert large["spread_range"] == pytest.approx(1.6 * fitted["spread_range"])
    assert tiny["spread_gain"] == pytest.approx(small["spread_gain"])
    assert tiny["spread_range"] == pytest.approx(0.5 * small["spread_range"])
    # A value of one's own changes by as much.
    (twice,) = values_by_radius("homing", 0.05, spread_gain=2.0 * fitted["spread_gain"])
    assert twice["spread_gain"] == pytest.approx(2.0 * small["spread_gain"])
