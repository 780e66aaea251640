"""A pytest plugin: kernels run by the interpreter, so that coverage sees their lines.

NUMBA_DISABLE_JIT=1 python -m pytest -p verification.interpreted tests/world/warehouse
"""

import os

import pytest

from swarm_logistics_env.world.warehouse import thread_pool


def pytest_configure(config: pytest.Config) -> None:
    """Refuse compiled kernels, and let threads look for work less often, as a look takes longer."""
    if os.environ.get("NUMBA_DISABLE_JIT") != "1":
        raise pytest.UsageError("verification.interpreted needs NUMBA_DISABLE_JIT=1")
    vars(thread_pool).update(_PATIENCE=40)  # a look takes a thousand times as long
    # Streams count modulo 2**64, and kernels divide as IEEE 754 says.
    for what in ("overflow", "divide by zero"):
        config.addinivalue_line("filterwarnings", f"ignore:{what} encountered:RuntimeWarning")
