"""Count the instructions of a control step with callgrind: a figure no busy machine disturbs.

    python -m benchmarks.instructions

Kernels are compiled for a plain processor meanwhile, as valgrind knows no AVX-512; so the figures
compare with each other, not with another machine's times.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

_SHORT, _LONG = 100, 2500  # steps; what differs is nearly free of the start-up, which varies
_ROOT = Path(__file__).parents[1]
_CONTESTANTS = {
    "force floor": "world = ForceFloor(recording); step = lambda index: world.step(index)",
    "Warehouse.step": (
        "world = Warehouse(recording.scenario); world.reset(0)\n"
        "step = lambda index: world.step(recording.commands[index])"
    ),
    "env.step_arrays": (
        "env = SwarmLogisticsEnv(recording.scenario); env.reset_arrays(seed=0)\n"
        "step = lambda index: env.step_arrays(recording.commands[index])"
    ),
}
_SCRIPT = """
import pickle, sys
from benchmarks.floor import ForceFloor
from swarm_logistics_env import Warehouse
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
with open(sys.argv[1], "rb") as file:
    recording = pickle.load(file)
{}
for index in range(int(sys.argv[2])):
    step(index)
"""
_RECORD = """
import pickle, sys
from benchmarks.floor import record
from swarm_logistics_env import Scenario
with open(sys.argv[1], "wb") as file:
    pickle.dump(record(Scenario(restock=True), int(sys.argv[2])), file)
"""


def instructions_of_a_step() -> dict[str, float] | None:
    """Return, by contestant, the instructions of one control step; None without valgrind."""
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        recording = str(Path(folder) / "recording")
        _python([sys.executable, "-c", _RECORD, recording, str(_LONG)], folder)
        counts = {}
        for name, made in _CONTESTANTS.items():
            script = [sys.executable, "-c", _SCRIPT.format(made), recording]
            _python([*script, str(_LONG)], folder)  # compiles, so that nothing below does
            counted = [valgrind, "--tool=callgrind", f"--callgrind-out-file={folder}/out", *script]
            short, long = (_count(_python([*counted, str(n)], folder)) for n in (_SHORT, _LONG))
            counts[name] = (long - short) / (_LONG - _SHORT)
    return counts


def _python(command: list[str], folder: str) -> str:
    environment = {
        **os.environ,
        "NUMBA_CPU_NAME": "generic",
        "NUMBA_CACHE_DIR": str(Path(folder) / "kernels"),
        "PYTHONHASHSEED": "0",
    }
    done = subprocess.run(
        command, cwd=_ROOT, env=environment, capture_output=True, text=True, check=True
    )
    return done.stderr


def _count(said: str) -> int:
    found = re.search(r"I\s+refs:\s+([\d,]+)", said)
    assert found, said
    return int(found[1].replace(",", ""))


def main() -> None:
    """Count and print."""
    counts = instructions_of_a_step()
    if counts is None:
        print("valgrind is not installed: no instructions counted")
        return
    floor = counts["force floor"]
    for name, count in counts.items():
        print(f"{name:20} {count:12,.0f} instructions a step, {count / floor:.2f} x floor")


if __name__ == "__main__":
    main()
