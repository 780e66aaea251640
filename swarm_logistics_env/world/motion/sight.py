"""What a network sees of items, where it reads that: all around, and the nearest ones in view.

Other inputs tell of items only what a robot with a load has to avoid, and of the requested one.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import MEMORY, length_of, to_frame

N_SEEN = 6  # items
BEAM_REACH = 1.0  # [m]: the nearness of what a beam meets ends there
SEEN_REACH = 1.1  # [m]: the nearness of an item in view ends there
HOME_REACH = 1.5  # [m] from the edge of the delivery area, on either side of it
_PARTS = ("nearness", "along", "aside", "recently_held")
# Beams as those of walls. Of each item its nearness; the direction to it, a vector as long as the
# nearness; and whether the robot put it down lately. Then the distance from the delivery area.
SIGHT_INPUTS: tuple[str, ...] = (
    *(f"item_beam_{beam}" for beam in range(row.N_BEAMS)),
    *(f"item_{n}_{part}" for n in range(N_SEEN) for part in _PARTS),
    "kept_home_fine_distance",
)
N_SIGHT_INPUTS = len(SIGHT_INPUTS)
_N_OF_ITEM = len(_PARTS)


@kernel
def read_sight(
    sensed: NDArray[np.float32],
    memory: NDArray[np.float64],
    sureness: float,
    beams: int,
    frame: tuple[float, float],
    first: int,
    read: NDArray[np.float32],
) -> None:
    """Fill `SIGHT_INPUTS` of a row (D,), from column `first` on.

    Args:
        sureness: of the distance from the delivery area that is remembered, see `memory.kept_home`.
        beams: by which the frame is turned from the body.
    """
    for beam in range(row.N_BEAMS):
        distance = np.float64(sensed[row.RANGE_ITEMS + (beam + beams) % row.N_BEAMS])
        read[first + beam] = max(0.0, 1.0 - distance / BEAM_REACH)
    for index in range(N_SEEN):
        item = row.ITEMS + row.ITEM_WIDTH * index
        x = sensed[item + row.ITEM.x]
        y = sensed[item + row.ITEM.y]
        distance = np.float64(length_of(x, y))
        # Entries behind the last item in view are zeros, and so are their distances.
        nearness = max(0.0, 1.0 - distance / SEEN_REACH) if distance > 0.0 else 0.0
        column = first + row.N_BEAMS + _N_OF_ITEM * index
        scale = nearness / distance if distance > 0.0 else 0.0
        along, aside = to_frame(frame, x, y)
        read[column] = nearness
        read[column + 1] = scale * along
        read[column + 2] = scale * aside
        read[column + 3] = sensed[item + row.ITEM.recently_held]
    away = min(max(memory[MEMORY.away] / HOME_REACH, -1.0), 1.0)
    read[first + N_SIGHT_INPUTS - 1] = math.tanh(sureness) * away
