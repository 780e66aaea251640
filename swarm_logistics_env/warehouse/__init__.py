"""The world: physics, sensing, logistics and faults, in arrays."""

from swarm_logistics_env.warehouse.failure_modes import FAILURE_MODES, FailureMode
from swarm_logistics_env.warehouse.faults import Fault
from swarm_logistics_env.warehouse.state import WarehouseState
from swarm_logistics_env.warehouse.warehouse import Warehouse

__all__ = ["FAILURE_MODES", "FailureMode", "Fault", "Warehouse", "WarehouseState"]
