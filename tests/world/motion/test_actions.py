"""Actions by number: eight directions, two turns, and what the gripper does."""

from __future__ import annotations

import math

import pytest

from swarm_logistics_env.world.motion.actions import ACTIONS, MOTION_ACTIONS

DIRECTIONS = (
    "forward", "forward_left", "left", "back_left", "back", "back_right", "right", "forward_right",
)  # fmt: skip


def test_actions_drive_in_eight_directions_turn_or_move_the_gripper() -> None:
    expected = {"stay": (0.0, 0.0, 0.0, 0.0)}
    for number, name in enumerate(DIRECTIONS):
        angle = number * math.pi / 4.0
        expected[name] = (math.cos(angle), math.sin(angle), 0.0, 0.0)
    expected |= {"turn_left": (0.0, 0.0, 1.0, 0.0), "turn_right": (0.0, 0.0, -1.0, 0.0)}
    expected |= {"hold": (0.0, 0.0, 0.0, 1.0), "open": (0.0, 0.0, 0.0, -1.0)}
    assert [*ACTIONS] == [*expected]
    for name, command in expected.items():
        assert ACTIONS[name] == pytest.approx(command, abs=1e-12)
    assert [*MOTION_ACTIONS] == [name for name in expected if not name.startswith("turn")]
    for name, outputs in MOTION_ACTIONS.items():
        forward, left, _, gripper = ACTIONS[name]
        assert outputs == (forward, left, gripper)
