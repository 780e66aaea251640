"""A warehouse for robot swarms, and the measure of how they cope.

Scenario -> world -> observation -> policy -> command -> world -> episode -> store -> indicator.
"""

from __future__ import annotations

import importlib
import importlib.metadata
from typing import TYPE_CHECKING

import gymnasium
import pettingzoo

from swarm_logistics_env.core import moved_names

if TYPE_CHECKING:
    from swarm_logistics_env import adapters, policies, spi, study, wrappers
    from swarm_logistics_env.adapters import swarm_logistics_v0
    from swarm_logistics_env.policies.demonstrations import record
    from swarm_logistics_env.policies.episode import Episode, run_episode
    from swarm_logistics_env.study.trial_study import judge
    from swarm_logistics_env.views.watch.embedded import film
    from swarm_logistics_env.world.scenario import SCENARIO_PRESETS, Scenario
    from swarm_logistics_env.world.warehouse import FAILURE_MODES, Fault, Warehouse

    __version__: str

__all__ = [
    "FAILURE_MODES",
    "SCENARIO_PRESETS",
    "Episode",
    "Fault",
    "Scenario",
    "Warehouse",
    "adapters",
    "film",
    "judge",
    "policies",
    "record",
    "run_episode",
    "spi",
    "study",
    "swarm_logistics_v0",
    "wrappers",
]

# The module of each name, imported when the name is first asked for: the world imports the compiler
# of its kernels, and a training script does not pay for a study's machinery.
_MODULES = {
    "Episode": "policies.episode",
    "FAILURE_MODES": "world.warehouse",
    "Fault": "world.warehouse",
    "SCENARIO_PRESETS": "world.scenario",
    "Scenario": "world.scenario",
    "Warehouse": "world.warehouse",
    "film": "views.watch.embedded",
    "judge": "study.trial_study",
    "record": "policies.demonstrations",
    "run_episode": "policies.episode",
    "swarm_logistics_v0": "adapters.swarm_logistics_v0",
}

moved_names.install()

# Modules are imported when an environment is made.
gymnasium.register("SwarmLogistics-v0", f"{__name__}.adapters.central_env:CentralEnv")
gymnasium.register(
    "SwarmLogisticsRows-v0", vector_entry_point=f"{__name__}.adapters.vector_env:SwarmRows"
)
if hasattr(pettingzoo, "register"):  # since 1.27
    _house = f"{__name__}.adapters.swarm_logistics_v0"
    pettingzoo.register("aec", "swarm_logistics_v0", entry_point=f"{_house}:env")
    pettingzoo.register("parallel", "swarm_logistics_v0", entry_point=f"{_house}:parallel_env")


def __getattr__(name: str) -> object:
    if name == "__version__":
        return importlib.metadata.version("swarm-logistics-env")
    if name not in __all__:
        return moved_names.moved_attribute(__name__, name)
    module = importlib.import_module(f"{__name__}.{_MODULES.get(name, name)}")
    return getattr(module, name, module)  # or the module itself


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
