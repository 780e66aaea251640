"""What leaves the simulator for robots: the contract of a policy, and checks of their logs."""

from swarm_logistics_env.robots.contract import Contract, check_rows, contract_of

__all__ = ["Contract", "check_rows", "contract_of"]
