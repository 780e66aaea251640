"""The fence around numba: whether kernels may rely on parts of it that may change any time.

The fast way replaces parts of numba's compiler (`fast_kernels`), generates LLVM's instructions
(`compiled_addresses`) and steps worlds in threads that share one call
(`world.warehouse.thread_pool`). It was tested with some versions of numba. With any other one,
kernels are compiled in the plain way, by what numba documents alone, those that reach the physics
engine are interpreted, and worlds step one after the other. Both ways give the same bits.

Without numba kernels are the Python functions that they are written as. That is for one robot's
computer (`policies.row_policy.Robot`), which decides the same; worlds are refused.
"""

from __future__ import annotations

import multiprocessing
import os
import re
import warnings
from typing import Any, cast

try:
    import numba as numba  # kernels.py takes it from here
except ImportError:
    numba = None  # type: ignore[assignment]  # a module elsewhere

FIRST_TESTED = (0, 61)  # versions of numba; pyproject.toml has them, too
LAST_TESTED = (0, 68)
WAY = "SWARM_LOGISTICS_KERNELS"  # environment variable: "plain" or "fast", whatever the version
QUIET = "SWARM_LOGISTICS_QUIET"  # environment variable of workers: nobody reads what they say


def is_worker() -> bool:
    """Return whether nobody reads what this process says."""
    return QUIET in os.environ or multiprocessing.parent_process() is not None


def choose_way(version: str, wish: str | None) -> str:
    """Return "fast" or "plain"; a warning tells a person that a version was not tested.

    Args:
        version: numba's.
        wish: of whoever started the process, the value of `WAY`.
    """
    if wish in ("fast", "plain"):
        return wish
    major, minor = re.findall(r"\d+", version)[:2]
    if FIRST_TESTED <= (int(major), int(minor)) <= LAST_TESTED:
        return "fast"
    if not is_worker():
        first, last = (".".join(map(str, tested)) for tested in (FIRST_TESTED, LAST_TESTED))
        warnings.warn(
            f"numba {version}: the fast kernels were tested with {first} to {last}, so the plain "
            "ones are used: the results are the same, but a step takes many times as long",
            stacklevel=2,
        )
    return "plain"


IS_MISSING = numba is None
IS_PLAIN = IS_MISSING or choose_way(numba.__version__, os.environ.get(WAY)) == "plain"
# Nothing is compiled where numba was told so, as tests tell it to see the lines of kernels.
IS_INTERPRETED = IS_PLAIN or bool(cast("Any", numba).config.DISABLE_JIT)
