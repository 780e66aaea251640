"""What a process pays before its first step."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile

_TIMED = "import time; began = time.{0}()\n{1}\nprint(time.{0}() - began)"
_FIRST_STEP = """
from swarm_logistics_env import swarm_logistics_v0
env = swarm_logistics_v0.parallel_env(); env.reset(seed=0)
env.step({agent: env.action_space(agent).sample() for agent in env.agents})
"""


def start_up() -> dict[str, float]:
    """Return in seconds what processes take before they step.

    Returns:
        "import", "import_of_needed": processor time to import the package, and what it stands on
            alone; "first_step, empty cache": processor time to the first step where all has to be
            compiled; "first_step": wall time to it where nothing has to be.
    """
    with tempfile.TemporaryDirectory() as cache:
        compiling = _seconds(_FIRST_STEP, NUMBA_CACHE_DIR=cache)
    _seconds(_FIRST_STEP)  # warms the cache
    return {
        "import": _median("import swarm_logistics_env"),
        "import_of_needed": _median("import pettingzoo, pymunk, numba"),
        "first_step, empty cache": compiling,
        "first_step": _median(_FIRST_STEP, "perf_counter"),
    }


def _median(script: str, clock: str = "process_time") -> float:
    return statistics.median(_seconds(script, clock) for _ in range(5))


def _seconds(script: str, clock: str = "process_time", **environment: str) -> float:
    done = subprocess.run(
        [sys.executable, "-c", _TIMED.format(clock, script)],
        env={**os.environ, **environment}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return float(done.stdout)
