"""Policies: whatever turns observations into commands.

`load(name)` makes one; a class of one's own needs `reset` and `act` (see `Policy`).
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from swarm_logistics_env.policies.catalogue import (
        NAMES,
        SUFFIXES,
        display_name,
        known_policies,
        load,
    )
    from swarm_logistics_env.policies.charging_robots import charging
    from swarm_logistics_env.policies.files import read_card, write_onnx
    from swarm_logistics_env.policies.learned import PolicyCard
    from swarm_logistics_env.policies.models import of, within
    from swarm_logistics_env.policies.policy import Policy, identity
    from swarm_logistics_env.policies.sb3_files import from_sb3
    from swarm_logistics_env.policies.spec import PolicySpec
    from swarm_logistics_env.policies.swarm_dt import SwarmDT, SwarmDTParameters

__all__ = [
    "NAMES",
    "SUFFIXES",
    "Policy",
    "PolicyCard",
    "PolicySpec",
    "SwarmDT",
    "SwarmDTParameters",
    "charging",
    "display_name",
    "from_sb3",
    "identity",
    "known_policies",
    "load",
    "of",
    "read_card",
    "within",
    "write_onnx",
]

# Imported when first asked for: an environment needs no policy.
_HOMES = {
    "catalogue": {"NAMES", "SUFFIXES", "display_name", "known_policies", "load"},
    "charging_robots": {"charging"},
    "files": {"read_card", "write_onnx"},
    "learned": {"PolicyCard"},
    "models": {"of", "within"},
    "policy": {"Policy", "identity"},
    "sb3_files": {"from_sb3"},
    "spec": {"PolicySpec"},
    "swarm_dt": {"SwarmDT", "SwarmDTParameters"},
}


def __getattr__(name: str) -> Any:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
