"""What one robot senses, in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.observations import columns
from swarm_logistics_env.scenario import Scenario
from swarm_logistics_env.warehouse.state import NOBODY, WarehouseState

# Blocks of several things end in absent ones, which are not worth a word.
_BLOCKS = ("item", "neighbour", "lowest_timer")


def observation_words(row: NDArray[np.float32], scenario: Scenario) -> list[tuple[str, str]]:
    """Return name and values of every named part of an observation row (D,).

    Of items and neighbours only those that are present, nearest first. The name has the unit.
    """
    words = []
    parts = {column.name: row[column.columns] for column in columns(scenario)}
    for column in columns(scenario):
        values = parts[column.name]
        block = next((block for block in _BLOCKS if column.name.startswith(block)), None)
        if block is not None and column.name != f"{block}_present":
            n_present = int((parts[f"{block}_present"] > 0.5).sum())
            values = values[: n_present * (len(values) // len(parts[f"{block}_present"]))]
        if column.unit == "flag":
            text = " ".join("yes" if value > 0.5 else "no" for value in values)
            if column.name.endswith("_present") and len(values) > 1:
                text = f"{int((values > 0.5).sum())} of {len(values)}"
        else:
            # + 0.0: no minus before a zero.
            text = " ".join(f"{round(float(value), 2) + 0.0:.2f}" for value in values)
        unit = "" if column.unit in ("flag", "1") else f" [{column.unit}]"
        words.append((column.name + unit, text or "–"))
    return words


def activity(state: WarehouseState, robot: int) -> str:
    """Return what a robot is at, as its colour tells."""
    item = int(state.robot_item[robot])
    if item == NOBODY:
        return "searching"
    return "delivering" if item == state.requested else "shuffling"
