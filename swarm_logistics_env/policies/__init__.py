"""Policies: whatever turns observations into commands.

`load(name)` makes one; a class of one's own needs `reset` and `act` (see `Policy`).
"""

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
