"""What a process pays before its first step."""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from swarm_logistics_env.policies import NAMES

_ROOT = Path(__file__).parents[1]
_IMPORT = "import time; t = time.process_time(); {}; print(time.process_time() - t)"
_NEEDED = "import pettingzoo, pymunk, numba"
_FIRST_STEP = """
import time; t = time.perf_counter()
from swarm_logistics_env import swarm_logistics_v0
env = swarm_logistics_v0.parallel_env(); env.reset(seed=0)
env.step({agent: env.action_space(agent).sample() for agent in env.agents})
print(time.perf_counter() - t)
"""
_TEN_STEPS = """
from swarm_logistics_env import swarm_logistics_v0
env = swarm_logistics_v0.parallel_env(); env.reset(seed=0)
for _ in range(10):
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
"""
_DECISION = """
import sys, time
from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.policies.policy import decide, start
scenario = Scenario(); world = Warehouse(scenario); rows = world.reset(seed=0)
t = time.process_time()
policy = policies.load(sys.argv[1])
start(policy, scenario, 0)
decide(policy, rows, world.state)
print(time.process_time() - t)
"""
_RUN = "from swarm_logistics_env.cli import app; app()"


def import_seconds(repeats: int) -> tuple[float, float]:
    """Return the processor time [s] of importing the package, and of what it stands on alone."""
    ours = [_number(_IMPORT.format("import swarm_logistics_env")) for _ in range(repeats)]
    needed = [_number(_IMPORT.format(_NEEDED)) for _ in range(repeats)]
    return statistics.median(ours), statistics.median(needed)


def first_step_seconds(repeats: int) -> float:
    """Return the wall time [s] in which a process with warm caches reaches its first step."""
    _number(_FIRST_STEP)  # warms them
    return statistics.median(_number(_FIRST_STEP) for _ in range(repeats))


def compile_seconds() -> dict[str, float]:
    """Return the processor time [s] of whole processes, with an empty compile cache and then warm.

    Of import, reset and ten steps at N = 25, and of `swarm-logistics run`; and of the first
    decision of each shipped policy beside a world that is compiled.
    """
    found = {}
    for name, arguments in {"ten steps": (_TEN_STEPS,), "run": (_RUN, "run")}.items():
        with tempfile.TemporaryDirectory() as cache:
            found[f"{name}, empty cache"] = _processor_seconds(arguments, cache)
            found[f"{name}, warm"] = _processor_seconds(arguments, cache)
    for policy in NAMES:
        with tempfile.TemporaryDirectory() as cache:
            _processor_seconds((_TEN_STEPS,), cache)
            found[f"first decision of {policy}"] = _number(_DECISION, policy, cache=cache)
    return found


def _processor_seconds(arguments: tuple[str, ...], cache: str) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-c", *arguments],
        cwd=_ROOT, env={**os.environ, "NUMBA_CACHE_DIR": cache}, capture_output=True, check=True,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _number(script: str, *arguments: str, cache: str = "") -> float:
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache} if cache else None
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        cwd=_ROOT, env=environment, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return float(done.stdout.split()[-1])


if __name__ == "__main__":
    for what, seconds in compile_seconds().items():
        print(f"{what}: {seconds:.1f} s of the processor")
