"""Adapters: the environment in the forms that other libraries expect."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarm_logistics_env.adapters.central_env import CentralEnv

if TYPE_CHECKING:
    from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

__all__ = ["CentralEnv", "SwarmVecEnv"]


def __getattr__(name: str) -> type[SwarmVecEnv]:
    # It loads stable-baselines3 and torch, so it is imported when somebody asks for it.
    if name == "SwarmVecEnv":
        from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

        return SwarmVecEnv
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
