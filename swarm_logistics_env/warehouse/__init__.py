"""The world: physics, sensing, logistics and faults, in arrays."""

from swarm_logistics_env.warehouse.faults import FAILURE_MODES, FailureMode, Fault
from swarm_logistics_env.warehouse.state import WarehouseState
from swarm_logistics_env.warehouse.warehouse import Warehouse

__all__ = ["FAILURE_MODES", "FailureMode", "Fault", "Warehouse", "WarehouseState"]
