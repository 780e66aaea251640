"""A robot that hears nothing gets no commands of a central controller."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, run_episode
from swarm_logistics_env.errors import PolicyError
from swarm_logistics_env.policies.policy import decide, mask_unreachable_commands


class Everywhere:
    """Sends every robot the same command, and tells whether it has asked for the state."""

    needs_state = True

    def __init__(self, command: Any = (1.0, 0.0, 0.5, 1.0)) -> None:
        self.command = command

    def reset(self, n_robots: int, seed: int) -> None:
        self.n_robots = n_robots

    def act(self, observations: NDArray[np.float32], state: Any = None) -> NDArray[np.float64]:
        return np.tile(np.array(self.command, dtype=np.float64), (self.n_robots, 1))


class OnBoard(Everywhere):
    """The same, decided by the robots."""

    needs_state = False


def world_with(*faults: Fault) -> Warehouse:
    world = Warehouse(Scenario(n_robots=4, n_items=8))
    world.reset(0, faults)
    return world


@pytest.mark.parametrize(
    ("mode", "policy", "arrives"),
    [
        *((mode, Everywhere, False) for mode in ("FM3", "FM3_hear", "dead")),
        *((mode, Everywhere, True) for mode in ("FM1", "FM2", "FM3_send", "FM4", "motor_dead")),
        ("FM3", OnBoard, True),
    ],
)
def test_only_who_hears_gets_the_command_of_others(
    mode: str, policy: type[Everywhere], arrives: bool
) -> None:
    world, sender = world_with(Fault(mode, (1, 3))), policy()
    sender.reset(4, 0)
    commands = decide(sender, world.observe(), world.state)
    np.testing.assert_array_equal(commands[[0, 2]], [sender.command] * 2)
    np.testing.assert_array_equal(commands[[1, 3]], [np.multiply(sender.command, arrives)] * 2)


def test_it_stands_still_from_then_on_and_keeps_what_it_carries() -> None:
    world = Warehouse(Scenario(n_robots=1, n_items=8, pickup_range=5.0))
    world.reset(0, [Fault("FM3_hear", 1, onset=0.3, duration=1.0)])
    carried, places = [], []
    for _ in range(20):
        # Told to open from 0.5 s on, which it hears from 1.3 s on.
        gripper = 1.0 if world.state.time < 0.45 else -1.0
        world.step(mask_unreachable_commands(np.array([[0.2, 0.0, 0.0, gripper]]), world.state))
        carried.append(world.state.robot_item[0] >= 0)
        places.append(world.state.robot_position[0].copy())
    assert carried == [True] * 13 + [False] * 7
    np.testing.assert_allclose(places[12], places[5], atol=1e-3)
    assert np.linalg.norm(places[2] - places[0]) > 0.05
    assert np.linalg.norm(places[16] - places[13]) > 0.05


def test_what_was_given_stays_as_it_was() -> None:
    world = world_with(Fault("FM3", 2))
    given = np.ones((4, 6))
    arrived = mask_unreachable_commands(given, world.state)
    assert given.all()
    assert arrived.sum() == 12.0


@pytest.mark.parametrize("command", [(1.0, 0.0), (1.0, 0.0, 0.0, np.nan)])
def test_wrong_commands_are_still_refused(command: tuple[float, ...]) -> None:
    with pytest.raises(PolicyError):
        run_episode(
            Scenario(n_robots=4, duration=1.0), Everywhere(command), 0, [Fault("FM3_hear", 2)]
        )
