"""Addresses in kernels: read and called by compiled code, or else by the interpreter."""

from __future__ import annotations

from typing import TYPE_CHECKING

from swarm_logistics_env.compiler.numba_fence import IS_INTERPRETED

if TYPE_CHECKING or not IS_INTERPRETED:
    from .compiled_addresses import (
        add,
        call_at,
        exchange,
        load_word,
        made_at,
        pointer_at,
        replace,
        unpacked_at,
    )
else:
    from .interpreted_addresses import (
        add,
        call_at,
        exchange,
        load_word,
        made_at,
        pointer_at,
        replace,
        unpacked_at,
    )

__all__ = [
    "add",
    "call_at",
    "exchange",
    "load_word",
    "made_at",
    "pointer_at",
    "replace",
    "unpacked_at",
]
