"""Adapters: the environment in the forms that other libraries expect."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .central_env import CentralEnv
from .vector_env import SwarmRows

if TYPE_CHECKING:
    from .sb3 import LogDeliveries, SwarmVecEnv, SwarmVecNormalize

__all__ = ["CentralEnv", "LogDeliveries", "SwarmRows", "SwarmVecEnv", "SwarmVecNormalize"]


def __getattr__(name: str) -> Any:
    # These load stable-baselines3 and torch, so they are imported when somebody asks for them.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from . import sb3

    return getattr(sb3, name)


def __dir__() -> list[str]:
    return __all__
