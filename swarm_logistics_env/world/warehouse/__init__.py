"""The world: physics, sensing, logistics and faults, in arrays."""

from .failure_modes import FAILURE_MODES, FailureMode
from .faults import Fault
from .state import WarehouseState
from .warehouse import Warehouse

__all__ = ["FAILURE_MODES", "FailureMode", "Fault", "Warehouse", "WarehouseState"]
