"""A warehouse for robot swarms, and the measure of how they cope.

Scenario -> world -> observation -> policy -> command -> world -> episode -> store -> indicator.
"""

from __future__ import annotations

import importlib
import importlib.metadata
from typing import TYPE_CHECKING

import gymnasium
import pettingzoo

if TYPE_CHECKING:
    from swarm_logistics_env import (
        adapters,
        policies,
        spi,
        studies,
        swarm_logistics_v0,
        testing,
        wrappers,
    )
    from swarm_logistics_env.episode import Episode, run_episode
    from swarm_logistics_env.scenario import SCENARIO_PRESETS, Scenario
    from swarm_logistics_env.warehouse import FAILURE_MODES, Fault, Warehouse

    __version__: str

__all__ = [
    "FAILURE_MODES",
    "SCENARIO_PRESETS",
    "Episode",
    "Fault",
    "Scenario",
    "Warehouse",
    "adapters",
    "policies",
    "run_episode",
    "spi",
    "studies",
    "swarm_logistics_v0",
    "testing",
    "wrappers",
]

GYMNASIUM_ID = "SwarmLogistics-v0"
PETTINGZOO_ID = "swarm_logistics_v0"

# The module of each name, imported when the name is first asked for: the world imports the compiler
# of its kernels, and a training script does not pay for a study's machinery.
_MODULES = dict.fromkeys(("Episode", "run_episode"), "episode") | {
    "FAILURE_MODES": "warehouse",
    "Fault": "warehouse",
    "SCENARIO_PRESETS": "scenario",
    "Scenario": "scenario",
    "Warehouse": "warehouse",
}


def _register() -> None:
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


_register()


def __getattr__(name: str) -> object:
    if name == "__version__":
        return importlib.metadata.version("swarm-logistics-env")
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = importlib.import_module(f"{__name__}.{_MODULES.get(name, name)}")
    return getattr(module, name) if name in _MODULES else module


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
