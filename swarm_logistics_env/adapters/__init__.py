"""Adapters: the environment in the forms that other libraries expect."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from .central_env import CentralEnv
from .vector_env import SwarmRows

if TYPE_CHECKING:
    from .sb3 import SwarmVecEnv
    from .sb3_learning import LogDeliveries, SwarmVecNormalize

__all__ = ["CentralEnv", "LogDeliveries", "SwarmRows", "SwarmVecEnv", "SwarmVecNormalize"]
if not find_spec("stable_baselines3"):  # so that `import *` works without it
    __all__ = ["CentralEnv", "SwarmRows"]


def __getattr__(name: str) -> Any:
    # These load stable-baselines3 and torch, so they are imported when somebody asks for them.
    if name == "SwarmVecEnv":
        return import_module(f"{__name__}.sb3").SwarmVecEnv
    if name in ("LogDeliveries", "SwarmVecNormalize"):
        import_module(f"{__name__}.sb3")  # first, because it says what to install
        return getattr(import_module(f"{__name__}.sb3_learning"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__]
