"""Policies: whatever turns observations into commands.

`load(name)` makes one; a class of one's own needs `reset` and `act` (see `Policy`).
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from swarm_logistics_env.policies.card import PolicyCard
    from swarm_logistics_env.policies.code_identity import identity
    from swarm_logistics_env.policies.files import read_card
    from swarm_logistics_env.policies.loading import NAMES, SUFFIXES, called, known_policies, load
    from swarm_logistics_env.policies.onnx_export import write_onnx
    from swarm_logistics_env.policies.policy import Policy
    from swarm_logistics_env.policies.swarm_dt import SwarmDT, SwarmDTParameters

__all__ = [
    "NAMES",
    "SUFFIXES",
    "Policy",
    "PolicyCard",
    "SwarmDT",
    "SwarmDTParameters",
    "called",
    "identity",
    "known_policies",
    "load",
    "read_card",
    "write_onnx",
]

# Imported when first asked for: an environment needs no policy.
_HOMES = {
    "PolicyCard": "card",
    "identity": "code_identity",
    "read_card": "files",
    "NAMES": "loading",
    "SUFFIXES": "loading",
    "called": "loading",
    "known_policies": "loading",
    "load": "loading",
    "write_onnx": "onnx_export",
    "Policy": "policy",
    "SwarmDT": "swarm_dt",
    "SwarmDTParameters": "swarm_dt",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
