"""The environment under its names in the registries of PettingZoo and Gymnasium."""

from __future__ import annotations

import gymnasium
import pettingzoo

GYMNASIUM_ID = "SwarmLogistics-v0"
PETTINGZOO_ID = "swarm_logistics_v0"


def register() -> None:
    """Register the names; modules are imported when an environment is made."""
    if GYMNASIUM_ID not in gymnasium.registry:
        gymnasium.register(GYMNASIUM_ID, "swarm_logistics_env.adapters.central_env:CentralEnv")
    if not hasattr(pettingzoo, "register"):
        return  # PettingZoo has a registry since 1.27
    module = "swarm_logistics_env.swarm_logistics_v0"
    for form, registry, maker in (
        ("aec", pettingzoo.aec_registry, "env"),
        ("parallel", pettingzoo.parallel_registry, "parallel_env"),
    ):
        if PETTINGZOO_ID.replace("_v", "-v") not in registry:
            pettingzoo.register(form, PETTINGZOO_ID, entry_point=f"{module}:{maker}")
