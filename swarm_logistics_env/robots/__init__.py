"""What leaves the simulator for robots: contracts, C, checks of logs, faults of a study."""

from swarm_logistics_env.robots.c_export import CFiles, write_c
from swarm_logistics_env.robots.contract import Contract, check_rows, contract_of
from swarm_logistics_env.robots.fault_layer import FaultLayer, append_trial

__all__ = [
    "CFiles",
    "Contract",
    "FaultLayer",
    "append_trial",
    "check_rows",
    "contract_of",
    "write_c",
]
