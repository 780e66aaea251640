"""What robots hear of each other's messages: who tells the highest number, and where it is."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import MotionView
from swarm_logistics_env.world.motion.memory import MEMORY
from swarm_logistics_env.world.motion.network_inputs import INPUTS, input_names
from swarm_logistics_env.world.motion.voices import N_MESSAGES, N_VOICE_INPUTS, VOICE_INPUTS
from swarm_logistics_env.world.scenario import Scenario

Rows = NDArray[np.float32]
N_COLUMNS = row.N_COLUMNS + row.N_NEIGHBOURS * N_MESSAGES
TALKING = Scenario(message_size=N_MESSAGES)


def hearing(*neighbours: tuple[float, float, tuple[float, float]]) -> Rows:
    """What a robot senses amid neighbours at (x, y) [m] with their messages."""
    rows = np.zeros((1, N_COLUMNS), np.float32)
    rows[:, : row.ITEMS] = 2.0
    for rank, (x, y, messages) in enumerate(neighbours):
        first = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * rank
        rows[0, first : first + 3] = 1.0, x, y
        start = row.MESSAGES + N_MESSAGES * rank
        rows[0, start : start + N_MESSAGES] = messages
    return rows


def inputs_of(rows: Rows, has_role: bool = False) -> dict[str, float]:
    frame = MotionView(TALKING, has_role=has_role, talks=True)
    frame.begin(row_keys(0, "test", len(rows)))
    # So that the frame of motion is that of the body.
    frame.memory[:, [MEMORY.heading_x, MEMORY.heading_y]] = 1.0, 0.0
    names = input_names(has_role=has_role, talks=True)
    return dict(zip(names, frame.read(rows)[0].tolist(), strict=True))


@pytest.mark.parametrize("has_role", [False, True])
def test_of_each_number_the_highest_is_heard_and_where_its_sender_is(has_role: bool) -> None:
    rows = hearing((1.0, 0.0, (0.2, 0.8)), (0.0, 2.0, (0.5, 0.1)), (-1.0, 0.0, (0.4, 0.0)))
    inputs = inputs_of(rows, has_role)
    assert [inputs[name] for name in VOICE_INPUTS] == pytest.approx(
        [0.5, 0.0, 0.5, 0.5 * 0.5, 0.8, 0.8, 0.0, 0.8 * 0.75], abs=1e-6
    )


def test_where_nobody_tells_anything_all_is_zero_and_nothing_else_changes() -> None:
    silent = inputs_of(hearing((1.0, 0.0, (0.0, -1.0))))
    loud = inputs_of(hearing((1.0, 0.0, (0.7, 0.3))))
    assert [silent[name] for name in VOICE_INPUTS] == N_VOICE_INPUTS * [0.0]
    assert [silent[name] for name in INPUTS] == [loud[name] for name in INPUTS]
    assert all(math.isfinite(value) for value in loud.values())


def test_messages_stand_behind_commands() -> None:
    frame = MotionView(TALKING, talks=True)
    frame.begin(row_keys(0, "test", 2))
    frame.read(np.repeat(hearing(), 2, axis=0))
    outputs = np.array([[0.5, 0.0, 1.0, 0.25, 0.75], [0.0, 0.0, -1.0, 0.0, 1.0]])
    commands = frame.command(outputs)
    np.testing.assert_array_equal(commands[:, 4:], outputs[:, 3:])
    np.testing.assert_array_equal(commands[:, 3], outputs[:, 2])
