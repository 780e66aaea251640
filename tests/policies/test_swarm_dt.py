"""Swarm D-T, row by row: what it does for what it senses."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Scenario
from swarm_logistics_env.policies import SwarmDT, SwarmDTParameters, load
from swarm_logistics_env.policies.swarm_dt import CONSTANTS_2026, Parameters
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.scenario import SOURCES


def sensing(*things: tuple[int, list[float]], n_robots: int = 1) -> NDArray[np.float32]:
    """Return rows of robots that sense these things alone: from a column on, its values."""
    rows = np.zeros((n_robots, row.N_COLUMNS), np.float32)
    for scan in (row.RANGE_ROBOTS, row.RANGE_WALLS, row.RANGE_ITEMS):
        rows[:, scan : scan + row.N_BEAMS] = 2.0
    rows[:, row.TIMER] = 10.0
    for column, values in things:
        rows[:, column : column + len(values)] = values
    return rows


NOTHING = sensing()
ITEM = row.ITEMS, [1.0, 0.3, 0.0]
HEARD = row.LOWEST_TIMER, [1.0, 0.0, 2.0, 3.0]
CARRYING, CARRYING_REQUESTED = (row.CARRYING, [1.0, 0.0]), (row.CARRYING, [1.0, 1.0])


def neighbour(x: float, y: float) -> tuple[int, list[float]]:
    return row.NEIGHBOURS, [1.0, x, y]


def straight(**parameters: Any) -> SwarmDT:
    """Return a policy whose stored heading only turns for what is sensed."""
    policy = SwarmDT(**{**CONSTANTS_2026, "diffusion": 0.0, **parameters})
    policy.reset(1, 0)
    return policy


def swarm(n_robots: int, period: float) -> SwarmDT:
    policy = SwarmDT(**CONSTANTS_2026)
    policy.configure(Scenario(control_period=period))
    policy.reset(n_robots, 0)
    return policy


def heading_of(commands: NDArray[np.float64]) -> float:
    return math.atan2(commands[0, 1], commands[0, 0])


def plus(commands: NDArray[np.float64], x: float, y: float) -> NDArray[np.float64]:
    """Return the velocity of commands with another one added, of the top speed at most."""
    summed = commands[0, :2] + [x, y]
    return np.asarray(summed / max(np.hypot(*summed), 1.0))


@pytest.mark.compiled
@pytest.mark.parametrize("period", [0.02, 0.2])
def test_the_heading_diffuses_at_its_rate_whatever_the_period(period: float) -> None:
    policy, rows = swarm(4000, period), sensing(n_robots=4000)
    first = policy.act(rows)
    np.testing.assert_allclose(np.hypot(first[:, 0], first[:, 1]), 1.0)
    assert (first[:, 2:] == [0.0, 1.0]).all()
    assert np.abs(first[:, :2].mean(axis=0)).max() < 0.06  # spread all round
    for _ in range(round(0.4 / period)):
        last = policy.act(rows)
    turned = np.arctan2(
        first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0],
        (first[:, :2] * last[:, :2]).sum(axis=1),
    )
    # Unwrapped it has variance D t = 0.556, so the mean cosine is exp(-D t / 2).
    assert np.cos(turned).mean() == pytest.approx(math.exp(-1.39 * 0.4 / 2), abs=0.02)
    assert abs(turned.mean()) < 0.06


@pytest.mark.parametrize("beam", range(row.N_BEAMS))
def test_a_wall_reflects_the_stored_heading_once(beam: int) -> None:
    policy = straight()
    before = heading_of(policy.act(NOTHING))
    towards = beam * math.tau / row.N_BEAMS
    approaches = math.cos(before - towards) > 0.0
    mirrored = 2 * towards + math.pi - before if approaches else before
    for _ in range(3):  # once turned away, it goes on straight
        after = heading_of(policy.act(sensing((row.RANGE_WALLS + beam, [0.15]))))
        assert math.remainder(after - mirrored, math.tau) == pytest.approx(0.0, abs=1e-6)
    assert heading_of(policy.act(NOTHING)) == pytest.approx(after)


def test_it_turns_away_from_a_near_robot_and_from_items_while_it_carries() -> None:
    plain = straight().act(NOTHING)
    for ignored in (neighbour(0.5, 0.1), ITEM):
        np.testing.assert_array_equal(straight().act(sensing(ignored)), plain)
    near = straight().act(sensing(neighbour(0.3, 0.0)))
    # Pushed back by 2 (1 - 0.3 / 0.5) = 0.8 top speeds.
    np.testing.assert_allclose(near[0, :2], plus(plain, -0.8, 0.0), atol=1e-6)
    assert straight(drop_rate=0.0).act(sensing(ITEM, CARRYING))[0, 0] < plain[0, 0]


def test_items_are_avoided_by_constants_of_their_own() -> None:
    carrying = sensing(ITEM, CARRYING)
    plain = straight(drop_rate=0.0, item_avoidance_gain=0.0).act(carrying)
    pushed = straight(drop_rate=0.0, item_avoidance_gain=1.0, item_avoidance_range=0.4)
    # Pushed back by 1 - 0.3 / 0.4 = 0.25 top speeds.
    np.testing.assert_allclose(pushed.act(carrying)[0, :2], plus(plain, -0.25, 0.0), atol=1e-6)
    robots_alone = straight(drop_rate=0.0, item_avoidance_gain=0.0, avoidance_gain=9.0)
    np.testing.assert_array_equal(robots_alone.act(carrying)[0, :2], plain[0, :2])


def test_at_full_speed_it_keeps_the_direction_and_no_push_slows_it() -> None:
    plain = straight().act(NOTHING)
    robot = neighbour(*(0.3 * plain[0, :2]))  # pushes it straight back, by 0.8 top speeds
    slowed, fast = straight().act(sensing(robot)), straight(full_speed=True).act(sensing(robot))
    assert np.hypot(*slowed[0, :2]) == pytest.approx(0.2)
    assert np.hypot(*fast[0, :2]) == pytest.approx(1.0)
    assert heading_of(fast) == pytest.approx(heading_of(slowed))


def test_only_who_carries_the_requested_item_follows_the_lowest_timer() -> None:
    plain = straight().act(NOTHING)
    for things in ((HEARD,), (HEARD, CARRYING)):
        commands = straight(drop_rate=0.0).act(sensing(*things))
        np.testing.assert_array_equal(commands[0, :2], plain[0, :2])
    requested = sensing(HEARD, CARRYING_REQUESTED)
    walk = load("random-walk", diffusion=0.0)  # without taxis
    walk.reset(1, 0)
    # To a float32's rounding: the interpreter multiplies its zero gain in that precision.
    np.testing.assert_allclose(walk.act(requested)[0, :2], plain[0, :2], rtol=1e-6)
    delivering = straight().act(requested)
    np.testing.assert_allclose(delivering[0, :2], plus(plain, 0.0, 0.75), atol=1e-6)


@pytest.mark.parametrize("follows", [False, True])
def test_only_where_the_heading_follows_do_pushes_turn_it_for_good(follows: bool) -> None:
    policy = straight(heading_follows=follows)
    before = heading_of(policy.act(NOTHING))
    pushed = heading_of(policy.act(sensing(neighbour(0.1, 0.05))))
    after = heading_of(policy.act(NOTHING))
    assert after == pytest.approx(pushed if follows else before)
    assert pushed != pytest.approx(before)


@pytest.mark.compiled
@pytest.mark.parametrize("period", [0.02, 0.1])
def test_other_items_are_dropped_at_the_drop_rate_and_the_requested_one_never(
    period: float,
) -> None:
    n = 3000
    policy, holds_item = swarm(n, period), np.ones(n, np.bool_)
    for _ in range(round(0.5 / period)):
        holds_item &= policy.act(sensing(CARRYING, n_robots=n))[:, 3] > -0.5
    assert holds_item.mean() == pytest.approx(math.exp(-1.5 * 0.5), abs=0.04)
    for _ in range(20):
        assert (policy.act(sensing(CARRYING_REQUESTED, n_robots=n))[:, 3] == 1.0).all()


def test_every_constant_says_whether_it_has_a_source_or_was_fitted() -> None:
    for name, field in SwarmDTParameters.model_fields.items():
        origin = (field.description or "").rsplit("; ", 1)[-1]
        kind, _, source = origin.partition(": ")
        assert kind in ("source", "fitted"), name
        assert source in (SOURCES if kind == "source" else {""}), name


def test_the_tuned_one_alone_goes_with_the_radius_and_the_speed_of_the_robots() -> None:
    # Of several kinds the fastest robots count, not the speed of those that name none.
    slow_kinds = {"max_speed": 2.0, "robot_kinds": "porter:1 max_speed=0.5, runner:1 max_speed=0.6"}
    fields: list[dict[str, Any]] = [
        *({}, {"robot_radius": 0.05}, {"max_speed": 2.0}, {"max_speed": 0.3}, slow_kinds)
    ]
    lengths = ("avoidance_range", "item_avoidance_range", "wall_distance")
    of_small = {
        parameter: factor * (0.4 if parameter in lengths else 1.0)
        for parameter, factor in SwarmDTParameters.of_small_robots.items()
    }
    changes = [{}, of_small, dict(SwarmDTParameters.of_fast_robots), {}, {}]
    for name in ("swarm-dt-tuned", "swarm-dt"):
        policy: Any = load(name)
        for changed, factors in zip(fields, changes, strict=True):
            scenario = Scenario(**{"max_speed": 0.5, **changed})
            policy.configure(scenario)
            kernel_values: Any = Parameters(*policy._values)
            values = kernel_values._asdict()
            if name == "swarm-dt":
                factors = {}
            for parameter, value in dict(policy.parameters).items():
                expected = value * factors.get(parameter, 1.0)
                assert values[parameter] == pytest.approx(expected), (name, parameter)
            drop = -math.expm1(-values["drop_rate"] * scenario.control_period)
            assert policy._constants.drop_probability == pytest.approx(drop)
