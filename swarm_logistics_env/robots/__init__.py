"""What leaves the simulator for robots: contracts, C, faults of a study, nodes of ROS 2."""

from swarm_logistics_env.robots.c_export import CFiles, write_c
from swarm_logistics_env.robots.contract import Contract, check_rows, contract_of
from swarm_logistics_env.robots.fault_layer import FaultLayer, append_trial
from swarm_logistics_env.robots.middleware import Middleware, OverMiddleware

__all__ = [
    "CFiles",
    "Contract",
    "FaultLayer",
    "Middleware",
    "OverMiddleware",
    "append_trial",
    "check_rows",
    "contract_of",
    "write_c",
]
