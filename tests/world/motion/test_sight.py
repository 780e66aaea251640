"""What a network that sees items reads of them, in the frame of the robot's motion."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env.core.streams import row_keys
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.frame import MotionView
from swarm_logistics_env.world.motion.memory import MEMORY
from swarm_logistics_env.world.motion.network_inputs import INPUTS, ROLE_INPUTS, input_names
from swarm_logistics_env.world.motion.sight import N_SEEN, N_SIGHT_INPUTS
from swarm_logistics_env.world.motion.voices import N_MESSAGES, N_VOICE_INPUTS
from swarm_logistics_env.world.scenario import Scenario

Rows = NDArray[np.float32]


def amid(*items: tuple[float, float, float]) -> Rows:
    """What a robot senses amid items at (x, y) [m], with whether it put each down itself."""
    rows = np.zeros((1, row.MESSAGES + row.N_NEIGHBOURS * N_MESSAGES), np.float32)
    rows[:, : row.ITEMS] = 2.0
    for rank, (x, y, was_held) in enumerate(items):
        first = row.ITEMS + row.ITEM_WIDTH * rank
        rows[0, first : first + row.ITEM_WIDTH] = 1.0, x, y, 0.0, was_held
    return rows


AHEAD = {MEMORY.heading_x: 1.0, MEMORY.heading_y: 0.0}  # it moves so
LEFT = {MEMORY.heading_x: 0.0, MEMORY.heading_y: 1.0}


def inputs_of(
    rows: Rows, memory: Mapping[int, float] = AHEAD, has_role: bool = False
) -> dict[str, float]:
    """Return the inputs upon a row of a robot that remembers this, by the columns of `MEMORY`."""
    frame = MotionView(
        Scenario(message_size=N_MESSAGES), sees_items=True, has_role=has_role, talks=True
    )
    frame.begin(row_keys(0, "test", len(rows)))
    for column, number in {**AHEAD, **memory}.items():
        frame.memory[:, column] = number
    names = input_names(sees_items=True, has_role=has_role, talks=True)
    return dict(zip(names, frame.read(rows)[0].tolist(), strict=True))


@pytest.mark.parametrize("has_role", [False, True])
def test_the_nearest_items_are_seen_by_nearness_and_direction_without_a_load(
    has_role: bool,
) -> None:
    inputs = inputs_of(amid((0.55, 0.0, 1.0), (0.0, -1.0, 0.0)), has_role=has_role)
    parts = "nearness", "along", "aside", "recently_held"
    of_items = [[inputs[f"item_{n}_{part}"] for part in parts] for n in range(N_SEEN)]
    far = 1.0 - 1.0 / 1.1
    assert of_items[0] == pytest.approx([0.5, 0.5, 0.0, 1.0])
    assert of_items[1] == pytest.approx([far, 0.0, -far, 0.0], abs=1e-6)
    assert of_items[2:] == [[0.0] * 4] * 4
    assert inputs["obstacle_0_present"] == 0.0


def test_items_are_where_they_lie_in_the_frame_of_motion() -> None:
    rows = amid((0.55, 0.0, 0.0))
    rows[0, row.RANGE_ITEMS + 4] = 0.25  # to its left
    ahead = inputs_of(rows)
    turned = inputs_of(rows, LEFT)
    assert ahead["item_beam_4"] == turned["item_beam_0"] == 0.75
    assert [turned[f"item_0_{part}"] for part in ("along", "aside")] == pytest.approx([0.0, -0.5])
    assert turned["item_0_nearness"] == ahead["item_0_nearness"] == pytest.approx(0.5)
    beams = [name for name in ahead if name.startswith("item_beam_")]
    assert sum(ahead[name] for name in beams) == 0.75  # others meet nothing within a metre


@pytest.mark.parametrize(("away", "expected"), [(0.9, 0.6), (-0.3, -0.2), (4.0, 1.0), (-4.0, -1.0)])
def test_the_distance_from_the_area_is_told_as_surely_as_it_is_known(
    away: float, expected: float
) -> None:
    sure = inputs_of(amid(), {MEMORY.kept_x: 2.0, MEMORY.away: away})
    unsure = inputs_of(amid(), {MEMORY.kept_x: 0.3, MEMORY.away: away})
    name = "kept_home_fine_distance"
    assert sure[name] == pytest.approx(math.tanh(2.0) * expected, abs=1e-3)
    assert unsure[name] == pytest.approx(math.tanh(0.3) * expected, abs=1e-3)
    assert inputs_of(amid())[name] == 0.0


def test_the_number_of_inputs_says_which_there_are() -> None:
    which = itertools.product([False, True], repeat=3)
    assert len({len(input_names(*flags)) for flags in which}) == 8
    assert N_VOICE_INPUTS + len(ROLE_INPUTS) < N_SIGHT_INPUTS
    assert len(ROLE_INPUTS) < N_VOICE_INPUTS


def test_all_other_inputs_stay_as_they_are_without_sight() -> None:
    rows = amid((0.5, 0.2, 1.0))
    seeing = inputs_of(rows, has_role=True)
    frame = MotionView(Scenario(message_size=N_MESSAGES), has_role=True, talks=True)
    frame.begin(row_keys(0, "test", 1))
    frame.memory[:, [MEMORY.heading_x, MEMORY.heading_y]] = 1.0, 0.0
    names = input_names(has_role=True, talks=True)
    assert names[: len(INPUTS)] == INPUTS
    blind = dict(zip(names, frame.read(rows)[0].tolist(), strict=True))
    assert blind == {name: seeing[name] for name in names}
    assert all(math.isfinite(value) for value in seeing.values())
