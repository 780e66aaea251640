"""What decisions of policies cost, and how soon `judge` answers."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from benchmarks.results import Contestant
from swarm_logistics_env import Scenario, Warehouse, policies
from swarm_logistics_env.policies.policy import decide, start

NAMES = ("swarm-dt", "homing", "homing-stock", "central", "central-stock", "ppo-robust@1")
_STEPS = 1000
_COMMAND = Path(sys.executable).with_name("swarm-logistics")


def deciders(base: str) -> Iterator[Contestant]:
    """Yield a contestant of each policy, beside the world's step of that name."""
    scenario = Scenario(restock=True)
    for name in NAMES:
        yield Contestant(
            f"policy {name}",
            "a decision of all robots",
            partial(_seconds_of_decisions, name, scenario),
            scenario.n_robots * _STEPS,
            _STEPS,
            base,
        )


def _seconds_of_decisions(name: str, scenario: Scenario) -> float:
    world, policy = Warehouse(scenario), policies.load(name)
    rows = world.reset(seed=0)
    start(policy, scenario, 0)
    seconds = 0.0
    for _ in range(_STEPS):
        begin = time.process_time()
        commands = decide(policy, rows, world.state)
        seconds += time.process_time() - begin
        rows = world.step(commands)
    return seconds


def judge_answers() -> dict[str, float]:
    """Return the wall time until `judge homing` shows P, and its first look at all questions [s].

    In an empty directory, with compiled kernels, on all cores that this process may use.
    """
    seconds: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        command = [str(_COMMAND), "judge", "homing", "--out", str(Path(folder, "judged"))]
        with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL) as judge:
            assert judge.stderr is not None
            for line in judge.stderr:
                if not line.startswith(b"After"):
                    continue
                name = "first look" if b"first look" in line else "P"
                seconds.setdefault(f"judge homing, {name}", time.perf_counter() - begin)
                if name == "first look":
                    judge.terminate()
                    break
    return seconds
