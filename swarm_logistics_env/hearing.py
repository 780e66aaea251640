"""What a central controller can reach: robots that hear."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.warehouse.state import WarehouseState


def as_heard(commands: NDArray[Any], state: WarehouseState) -> NDArray[Any]:
    """Return a central controller's commands (N, 4) as they arrive.

    A robot that does not hear gets no command: it stands still, its gripper stays as it is, and
    it broadcasts nothing new. So FM3 and FM3_hear bite as they would in reality. The controller
    sees from above and reaches every robot that hears, wherever it is: a robot that does not
    send, radio range, loss and sensor noise make no difference to it.
    """
    deaf = state.robot_present & ~state.hears
    if not deaf.any():
        return commands
    try:
        arrived = np.array(commands, dtype=np.float64)
    except (TypeError, ValueError):
        return commands  # the warehouse says what is wrong with them
    if arrived.shape[:1] == deaf.shape:
        arrived[deaf] = 0.0
    return arrived
