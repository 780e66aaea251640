"""Adapters: the environment in the forms that other libraries ask for."""

from swarm_logistics_env.adapters.central import CentralEnv

__all__ = ["CentralEnv"]
