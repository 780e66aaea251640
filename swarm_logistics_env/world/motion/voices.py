"""What robots tell each other where a network talks: two numbers, which it learns to estimate.

A number is a nearness, so that whoever hears several robots can drive to the one that knows best,
and say a little less itself: what one robot sees spreads from neighbour to neighbour.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.kernels import kernel
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.motion.memory import length_of, to_frame

# How near the requested item is that nobody carries, and the delivery area.
MESSAGES = ("item_nearness", "dock_nearness")
N_MESSAGES = len(MESSAGES)
SILENT = 8.0  # [m] from what a message is about: as far and farther it is 0, there it is 1
# The highest number that neighbours tell, and where its sender is: direction and nearness.
VOICE_INPUTS: tuple[str, ...] = tuple(
    f"{message}_{part}" for message in MESSAGES for part in ("heard", "along", "aside", "close")
)
N_VOICE_INPUTS = len(VOICE_INPUTS)
_N_OF_MESSAGE = N_VOICE_INPUTS // N_MESSAGES
_FAR = 4.0  # [m]: the nearness of a sender ends there


@kernel
def read_voices(
    sensed: NDArray[np.float32], frame: tuple[float, float], first: int, read: NDArray[np.float32]
) -> None:
    """Fill `VOICE_INPUTS` of a row (D,) that has messages, from column `first` on."""
    for message in range(N_MESSAGES):
        column = first + _N_OF_MESSAGE * message
        read[column : column + _N_OF_MESSAGE] = 0.0
        highest = 0.0
        for rank in range(row.N_NEIGHBOURS):
            heard = np.float64(sensed[row.MESSAGES + N_MESSAGES * rank + message])
            if heard > highest:
                highest = heard
                neighbour = row.NEIGHBOURS + row.NEIGHBOUR_WIDTH * rank
                x = sensed[neighbour + row.NEIGHBOUR.x]
                y = sensed[neighbour + row.NEIGHBOUR.y]
                distance = max(np.float64(length_of(x, y)), 1e-9)
                along, aside = to_frame(frame, x, y)
                read[column] = heard
                read[column + 1] = heard * along / distance
                read[column + 2] = heard * aside / distance
                read[column + 3] = heard * max(0.0, 1.0 - distance / _FAR)


@kernel
def speak(answers: NDArray[np.float32], first: int, outputs: NDArray[np.float32]) -> None:
    """Fill messages, from column `first` of `outputs` on, with the last numbers of `answers`.

    Args:
        answers: (N, k) of a network's last layer.
        outputs: (N, first + N_MESSAGES).
    """
    n_before = answers.shape[1] - N_MESSAGES
    for robot in range(answers.shape[0]):
        for message in range(N_MESSAGES):
            number = answers[robot, n_before + message]
            outputs[robot, first + message] = min(max(number, np.float32(0.0)), np.float32(1.0))
