"""What leaves the simulator for robots: contracts, checks of their logs, faults of a study."""

from swarm_logistics_env.robots.contract import Contract, check_rows, contract_of
from swarm_logistics_env.robots.fault_layer import FaultLayer, append_trial

__all__ = ["Contract", "FaultLayer", "append_trial", "check_rows", "contract_of"]
