"""Adapters: the environment in the forms that other libraries ask for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarm_logistics_env.adapters.central_env import CentralEnv

if TYPE_CHECKING:
    from swarm_logistics_env.adapters.normalize import SwarmVecNormalize
    from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

__all__ = ["CentralEnv", "SwarmVecEnv", "SwarmVecNormalize"]


def __getattr__(name: str) -> type[SwarmVecEnv | SwarmVecNormalize]:
    # These load stable-baselines3 and torch, so they are imported when somebody asks for them.
    if name == "SwarmVecEnv":
        from swarm_logistics_env.adapters.sb3 import SwarmVecEnv

        return SwarmVecEnv
    if name == "SwarmVecNormalize":
        from swarm_logistics_env.adapters.normalize import SwarmVecNormalize

        return SwarmVecNormalize
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
