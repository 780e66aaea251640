"""The environment in PettingZoo's house style: `parallel_env`, `env` (AEC), `raw_env`."""

from __future__ import annotations

from typing import Any

from pettingzoo import AECEnv
from pettingzoo.utils import wrappers
from pettingzoo.utils.conversions import parallel_to_aec

from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv

__all__ = ["env", "parallel_env", "raw_env"]

parallel_env = SwarmLogisticsEnv


def raw_env(**arguments: Any) -> AECEnv[str, Any, Any]:
    """Return the AEC form, robot by robot, of `parallel_env` with these arguments."""
    return parallel_to_aec(parallel_env(**arguments))


def env(**arguments: Any) -> AECEnv[str, Any, Any]:
    """Return `raw_env` with the order of calls enforced."""
    return wrappers.OrderEnforcingWrapper(raw_env(**arguments))
