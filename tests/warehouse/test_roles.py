"""Roles: what robots are doing, and faults that strike by it."""

import numpy as np
import pytest

from swarm_logistics_env import Fault, Scenario, Warehouse, policies, run_episode
from swarm_logistics_env.errors import FaultError
from swarm_logistics_env.warehouse.failure_modes import failure_mode, lost_capabilities
from swarm_logistics_env.warehouse.faults import ROLES, robots_in_role, roles_of


def world_in_roles() -> Warehouse:
    """Return a world of six robots: carrier, neighbour, in the area, shuffling, two searching."""
    world = Warehouse(Scenario(n_robots=6, n_items=4))
    world.reset(0)
    state = world.state
    state.robot_position = np.array(
        [[5.0, 5.0], [5.0, 5.8], [9.5, 5.0], [1.0, 1.0], [2.0, 8.0], [5.0, 7.0]]
    )
    state.robot_in_delivery = np.array([False, False, True, False, False, False])
    asked = state.requested
    other = (asked + 1) % 4
    state.robot_item = np.array([asked, -1, -1, other, -1, -1])
    carriers = np.full(4, -1)
    carriers[[asked, other]] = 0, 3
    state.item_carrier = carriers
    state.item_position[asked], state.item_position[other] = (5.0, 5.0), (1.0, 1.0)
    return world


def test_every_role_is_told() -> None:
    roles = roles_of(world_in_roles().state)
    assert roles.tolist() == [
        "carrier", "neighbour", "in_area", "shuffling", "searching", "searching",
    ]  # fmt: skip
    assert set(roles) == set(ROLES)


def test_the_robots_of_a_role_come_first_then_those_near_the_requested_item() -> None:
    state = world_in_roles().state
    assert robots_in_role(state, "searching", 1).tolist() == [5]
    assert robots_in_role(state, "searching", 2).tolist() == [4, 5]
    assert robots_in_role(state, "searching", 3).tolist() == [0, 4, 5]
    assert robots_in_role(state, "carrier", 2).tolist() == [0, 1]
    state.robot_present[0] = False
    assert 0 not in robots_in_role(state, "carrier", 5)
    assert roles_of(state)[0] == ""


def test_a_fault_strikes_the_carrier_at_its_onset_and_nobody_before() -> None:
    scenario = Scenario(n_robots=10, duration=60.0)
    world = Warehouse(scenario)
    policy = policies.load("swarm-dt")
    rows = world.reset(3, [Fault("FM4", 1, onset=30.0, role="carrier")])
    policy.reset(10, 3)
    while world.state.time < 29.95:
        assert world.struck_robots == ()
        rows = world.step(policy.act(rows))
        carrier = world.state.item_carrier[world.state.requested]
    (struck,) = world.struck_robots
    assert carrier in (struck, -1)
    assert world.state.failed.tolist() == [robot == struck for robot in range(10)]


def test_equal_seeds_strike_equal_robots() -> None:
    scenario = Scenario(n_robots=10, duration=40.0)
    fault = Fault("dead", 3, onset=20.0, role="shuffling")
    first, second = (run_episode(scenario, policies.load("swarm-dt"), 1, [fault]) for _ in range(2))
    assert first.failed_robots == second.failed_robots
    assert len(first.failed_robots) == 3


def test_a_part_of_a_mode_takes_these_capabilities_alone() -> None:
    assert lost_capabilities("dead") == ("move", "sense", "pick_up", "deliver", "send", "hear")
    part = failure_mode("dead[move,send]")
    assert (part.speed, part.sends, part.obeys) == (0.0, False, False)
    assert part.view == 1.0
    assert all((part.rangers, part.lifts, part.delivers, part.hears))
    assert lost_capabilities("dead[move,send]") == ("move", "send")
    assert lost_capabilities("motor_slow") == ("move",)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"mode": "dead[fly]"}, "dead takes move, sense, .* not 'fly'"),
        ({"mode": "FM9[move]"}, "no failure mode"),
        ({"mode": "FM1", "role": "carier"}, "did you mean 'carrier'"),
        ({"mode": "FM1", "role": "carrier", "robots": (1,)}, "should be a number"),
    ],
)
def test_what_cannot_be_is_refused(fields: dict[str, object], sentence: str) -> None:
    with pytest.raises(FaultError, match=sentence):
        Fault(**fields)  # type: ignore[arg-type]


def test_a_fault_without_a_role_is_written_as_ever() -> None:
    assert "role" not in Fault("FM1").to_json()
    by_role = Fault("FM1", 2, role="carrier")
    assert Fault.from_json(by_role.to_json()) == by_role
