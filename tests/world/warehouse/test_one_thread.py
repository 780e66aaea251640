"""Two threads never use one world at once: the second is refused, the first goes on."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse, swarm_logistics_v0
from swarm_logistics_env.compiler.numba_fence import QUIET
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.world.warehouse.thread_pool import WorldThreadPool

STAY = np.zeros((2, 4))


def step_in_a_pool(world: Warehouse) -> None:
    pool = WorldThreadPool([Warehouse(world.scenario), world], [0, 2], 0)
    pool._worlds[0].reset(0)
    rows = np.zeros((4, world.state.n_robots), np.float32)
    try:
        pool.step(np.zeros((4, 4)), rows, lambda *_: None)
    finally:
        assert pool._worlds[0].state.step == 0
        pool._worlds[0].step(STAY)  # nobody holds it any more


@pytest.mark.parametrize(
    "use",
    [
        lambda env: env.warehouse.step(STAY),
        lambda env: env.warehouse.reset(1),
        lambda env: env.warehouse.change(view_range=0.5),
        lambda env: env.warehouse.set_faults(["FM1"]),
        lambda env: env.warehouse.observe(),
        lambda env: pickle.dumps(env),
        lambda env: copy.copy(env.warehouse),
        lambda env: copy.deepcopy(env),
        lambda env: step_in_a_pool(env.warehouse),
        lambda env: env.step_arrays(STAY),
        lambda env: env.reset(seed=1),
        lambda env: env.state(),
        lambda env: env.render(),
    ],
)
@pytest.mark.parametrize("is_begun", [True, False])
def test_a_world_that_another_thread_uses_is_refused_and_stays_as_it_is(
    use: Callable[[Any], object], is_begun: bool
) -> None:
    env: Any = swarm_logistics_v0.parallel_env(n_robots=2, render_mode="rgb_array")
    undisturbed = copy.deepcopy(env)
    if is_begun:
        assert (env.reset_arrays(0) == undisturbed.reset_arrays(0)).all()
    is_held, is_over = threading.Event(), threading.Event()

    def hold() -> None:
        with env.lock:
            is_held.set()
            is_over.wait(600.0)

    other = threading.Thread(target=hold)
    other.start()
    is_held.wait(600.0)
    try:
        with pytest.raises(SetupError, match="another thread is using this world"):
            use(env)
    finally:
        is_over.set()
        other.join()
    if not is_begun:
        assert (env.reset_arrays(0) == undisturbed.reset_arrays(0)).all()
    assert env.warehouse.state.step == 0
    assert (env.step_arrays(STAY)[0] == undisturbed.step_arrays(STAY)[0]).all()


PROGRAM = """
import sys, threading
import numpy as np
from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.core.errors import SetupError
from swarm_logistics_env.compiler.numba_fence import QUIET
world = Warehouse(Scenario(n_robots=30, duration=1000.0, restock=True))
world.reset(0)
commands, n_steps = np.full((30, 4), 0.5), [0, 0]
def use(number):
    try:
        if number and sys.argv[1] == "reset":
            world.reset(1)
        else:
            world.step(commands)
            n_steps[number] += 1
    except SetupError:
        pass
def use_often():
    for _ in range(1000):
        use(0)
def use_beside():
    while first.is_alive():
        use(1)
first, second = threading.Thread(target=use_often), threading.Thread(target=use_beside)
first.start(), second.start()
first.join(), second.join()
print(sys.argv[1] == "reset" or sum(n_steps) == world.state.step)
"""


@pytest.mark.daily
@pytest.mark.parametrize("call", ["step", "reset"])
def test_two_threads_at_one_world_do_not_end_the_process(call: str) -> None:
    command = [sys.executable, "-c", PROGRAM, call]
    environment = {**os.environ, QUIET: "1"}
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=600, check=False, env=environment
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


def test_threads_that_wait_for_the_lock_share_a_world() -> None:
    world = Warehouse(Scenario(n_robots=2))
    world.reset(0)

    def use() -> None:
        for _ in range(50):
            with world.lock:
                world.step(STAY)

    threads = [threading.Thread(target=use) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert world.state.step == 150
