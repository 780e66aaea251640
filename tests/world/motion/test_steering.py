from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_logistics_env import Scenario, policies, run_episode
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import MEMORY, N_COLUMNS
from swarm_logistics_env.world.motion.steering import clear_the_way, steer


@pytest.mark.parametrize("direction", [0.3, 1.5, -0.6, 3.0, -2.0])
def test_it_gets_to_drive_where_it_wants_to(direction: float) -> None:
    memory = np.zeros((1, N_COLUMNS))
    memory[0, MEMORY.widest_turn] = 0.6
    heading, wanted = 0.0, direction
    for _ in range(10):
        command = np.array([math.cos(wanted), math.sin(wanted), 0.0, 1.0])
        steer(memory[0], command)
        assert abs(command[2]) <= 1.0
        assert command[[1, 3]].tolist() == [0.0, 1.0]
        heading += 0.6 * command[2]
        wanted = direction - heading
    assert abs(command[0]) == pytest.approx(1.0)
    driven = heading if command[0] > 0 else heading + math.pi
    assert math.cos(driven - direction) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("direction", "speed", "turn"),
    [(0.3, math.cos(0.15), 0.3), (1.5, math.cos(1.2), 0.6), (-0.6, math.cos(0.3), -0.6),
     (math.pi - 0.4, -math.cos(0.2), -0.4)],
)  # fmt: skip
def test_it_drives_at_the_mean_heading_of_its_turn(
    direction: float, speed: float, turn: float
) -> None:
    """A turn of .6 rad at most; its speed is the way that it makes in the wanted direction."""
    memory = np.zeros(N_COLUMNS)
    memory[MEMORY.widest_turn] = 0.6
    for share in (1.0, 0.5):
        command = np.array([share * math.cos(direction), share * math.sin(direction), 0.0, 1.0])
        steer(memory, command)
        assert command.tolist() == pytest.approx([share * speed, 0.0, turn / 0.6, 1.0])


@pytest.mark.compiled
def test_homing_delivers_with_differential_drive() -> None:
    scenario = Scenario(restock=True, drive="differential", duration=60.0)
    homing, swarm_dt = (
        np.mean([run_episode(scenario, policies.load(name), seed).delivered for seed in range(2)])
        for name in ("homing", "swarm-dt")
    )
    assert homing > 2 * swarm_dt


@pytest.mark.parametrize(("requested_at", "takes"), [(None, True), (3.0, True), (0.2, False)])
def test_who_clears_its_way_takes_an_item_unless_the_requested_one_is_near(
    requested_at: float | None, takes: bool
) -> None:
    sensed = np.zeros(row.N_COLUMNS, np.float32)  # a robot stands right before it
    sensed[row.ITEMS : row.ITEMS + 3] = 1.0, 0.05, 0.0
    if requested_at is not None:
        first = row.ITEMS + row.ITEM_WIDTH
        sensed[first : first + 4] = 1.0, requested_at, 0.0, 1.0
    memory, command = np.zeros(N_COLUMNS), np.zeros(4)
    memory[MEMORY.clearing] = 1.0
    clear_the_way(sensed, memory, command)
    assert command[3] == (1.0 if takes else -1.0)
    assert command[0] == pytest.approx(0.1)
