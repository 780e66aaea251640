"""A warehouse for robot swarms, and the measure of how they cope.

Scenario -> world -> observation -> policy -> command -> world -> episode -> store -> indicator.
"""

from __future__ import annotations

import importlib
import importlib.metadata
from types import ModuleType
from typing import TYPE_CHECKING

from swarm_logistics_env.environment.registration import register
from swarm_logistics_env.episode import Episode, run_episode
from swarm_logistics_env.scenario import SCENARIO_PRESETS, Scenario
from swarm_logistics_env.warehouse import FAILURE_MODES, Fault, Warehouse

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

# Imported when first asked for, so that a training script does not pay for a study's machinery.
_LAZY = frozenset(
    {"adapters", "policies", "spi", "studies", "swarm_logistics_v0", "testing", "wrappers"}
)

register()


def __getattr__(name: str) -> ModuleType | str:
    if name == "__version__":
        return importlib.metadata.version("swarm-logistics-env")
    if name in _LAZY:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
