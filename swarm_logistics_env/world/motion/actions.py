"""Actions by number: as commands, and as outputs in the frame of a robot's motion."""

from __future__ import annotations

import math
from collections.abc import Mapping

_HALF = math.sqrt(0.5)

# Forward, left, turn, gripper of each action; one that drives or turns leaves the gripper as it is.
ACTIONS: Mapping[str, tuple[float, float, float, float]] = {
    "stay": (0.0, 0.0, 0.0, 0.0),
    "forward": (1.0, 0.0, 0.0, 0.0),
    "forward_left": (_HALF, _HALF, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0, 0.0),
    "back_left": (-_HALF, _HALF, 0.0, 0.0),
    "back": (-1.0, 0.0, 0.0, 0.0),
    "back_right": (-_HALF, -_HALF, 0.0, 0.0),
    "right": (0.0, -1.0, 0.0, 0.0),
    "forward_right": (_HALF, -_HALF, 0.0, 0.0),
    "turn_left": (0.0, 0.0, 1.0, 0.0),
    "turn_right": (0.0, 0.0, -1.0, 0.0),
    "hold": (0.0, 0.0, 0.0, 1.0),
    "open": (0.0, 0.0, 0.0, -1.0),
}
# Along, aside, gripper: the same but for the turns, as the frame turns with the robot's motion.
MOTION_ACTIONS: Mapping[str, tuple[float, float, float]] = {
    name: (along, aside, gripper)
    for name, (along, aside, turn, gripper) in ACTIONS.items()
    if turn == 0.0
}
