from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
import subprocess
import sys
import threading
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.compiler.numba_fence import QUIET
from swarm_logistics_env.core.errors import CommandError
from swarm_logistics_env.world.observations import N_COLUMNS
from swarm_logistics_env.world.warehouse import thread_pool
from swarm_logistics_env.world.warehouse.thread_pool import WorldThreadPool

pytestmark = pytest.mark.unmeasured

SIZES, FIRSTS = (2, 5, 1, 3), [0, 2, 7, 8]


def worlds() -> list[Warehouse]:
    made = []
    for seed, n_robots in enumerate(SIZES):
        scenario = Scenario(
            n_robots=n_robots, n_items=6, warehouse_width=3.0, warehouse_height=3.0,
            delivery_width=1.5, restock=True,
        )  # fmt: skip
        made.append(Warehouse(scenario))
        made[-1].reset(seed, faults=[Fault("dead", 1, onset=1.0)])
    return made


def commands(step: int) -> NDArray[np.float64]:
    drawn = np.random.default_rng(step).uniform(-1.0, 1.0, (sum(SIZES), 4))
    drawn[:, 3] = 1.0 if step % 20 < 15 else -1.0
    return drawn


def step(
    pool: WorldThreadPool, made: list[Warehouse], actions: NDArray[np.float64]
) -> NDArray[np.float32]:
    rows = np.zeros((sum(SIZES), N_COLUMNS), np.float32)
    reported = []

    def arrived(index: int, sensed: NDArray[np.float32]) -> None:
        reported.append(index)
        assert np.shares_memory(sensed, rows)
        assert sensed is made[index].observe()

    pool.step(actions, rows, arrived)
    assert reported == sorted(reported)
    for index, world in enumerate(made):
        delivered_now = world.state.delivery_times[-1:] == [world.state.time]
        is_told = delivered_now or world.is_eventful or pool.is_watched[index]
        assert (index in reported) == is_told
        assert np.shares_memory(world.observe(), rows)
    return rows


def step_beside(
    pool: WorldThreadPool, made: list[Warehouse], alone: list[Warehouse], numbers: range
) -> None:
    """Step worlds in a pool, and others alone, which should sense the same."""
    for number in numbers:
        actions = commands(number)
        rows = step(pool, made, actions)
        for world, first in zip(alone, FIRSTS):
            robots = slice(first, first + world.state.n_robots)
            np.testing.assert_array_equal(rows[robots], world.step(actions[robots]))


@pytest.mark.parametrize("n_helpers", [0, pytest.param(3, marks=pytest.mark.compiled)])
def test_a_pool_steps_worlds_as_each_steps_itself(n_helpers: int) -> None:
    together, apart = worlds(), worlds()
    pool = WorldThreadPool(together, FIRSTS, n_helpers)
    pool.is_watched[2] = 1
    step_beside(pool, together, apart, range(120))
    for pooled, alone in zip(together, apart):
        assert pooled.state.delivery_times == alone.state.delivery_times
        assert pooled.state.anchoring_seconds == alone.state.anchoring_seconds
        assert pooled.state.contact_measures == alone.state.contact_measures
    pool.close()


@pytest.mark.parametrize("is_closed", [True, False])
def test_helpers_end_with_the_pool(is_closed: bool) -> None:
    before = set(threading.enumerate())
    made = worlds()
    pool = WorldThreadPool(made, FIRSTS, 2)
    step(pool, made, commands(0))
    helpers = [t for t in set(threading.enumerate()) - before if t.name == "swarm-helper"]
    assert len(helpers) == 2
    if is_closed:
        pool.close()
        pool.close()
        step(pool, made, commands(1))  # the caller does it alone
    del pool
    gc.collect()
    for helper in helpers:
        helper.join(600.0)
    assert not any(helper.is_alive() for helper in helpers)


def test_what_is_refused_is_raised_before_any_world_has_moved() -> None:
    made = worlds()
    pool, actions = WorldThreadPool(made, FIRSTS, 1), commands(0)
    actions[3, 1] = np.nan
    with pytest.raises(CommandError, match=r"commands\[3, 1\] = nan"):
        step(pool, made, actions)
    step_beside(pool, made, worlds(), range(1))
    pool.close()


@pytest.mark.compiled
@pytest.mark.parametrize("n_helpers", [0, 2])
@pytest.mark.parametrize("kernel", ["submit", "take_sleepers", "find_next_done"])
def test_a_pool_goes_on_after_ctrl_c(
    n_helpers: int, kernel: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = getattr(thread_pool, kernel)
    made = worlds()
    pool = WorldThreadPool(made, FIRSTS, n_helpers)
    pool.is_watched[:] = 1
    step(pool, made, commands(0))
    for interrupted in range(3):
        left = [interrupted]

        def interrupting(*arguments: Any, left: list[int] = left) -> Any:
            # The interpreter looks for signals when a call has returned, in the main thread.
            answer = original(*arguments)
            left[0] -= threading.current_thread() is threading.main_thread()
            if left[0] == -1:
                left[0] -= 1
                raise KeyboardInterrupt
            return answer

        monkeypatch.setattr(thread_pool, kernel, interrupting)
        # What calls it, and how often, depends on how fast helpers are.
        while left[0] >= 0:
            with contextlib.suppress(KeyboardInterrupt):
                step(pool, made, commands(1))
        monkeypatch.setattr(thread_pool, kernel, original)
        alone = worlds()
        for seed, world in enumerate([*made, *alone]):
            world.reset(seed % len(made))
        step_beside(pool, made, alone, range(10))
    pool.close()


def play_on(pool: WorldThreadPool, made: list[Warehouse], expected: NDArray[np.float32]) -> None:
    """In a process that was forked: the pool's threads stayed behind."""
    np.testing.assert_array_equal(step(pool, made, commands(1)), expected)
    assert sum(thread.name == "swarm-helper" for thread in threading.enumerate()) == 2
    pool.close()


@pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="the system does not fork"
)
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_a_process_that_was_forked_has_threads_of_its_own() -> None:
    made, expected_worlds = worlds(), worlds()
    pool, alone = WorldThreadPool(made, FIRSTS, 2), WorldThreadPool(expected_worlds, FIRSTS, 0)
    step(pool, made, commands(0))
    step(alone, expected_worlds, commands(0))
    expected = step(alone, expected_worlds, commands(1))
    context = multiprocessing.get_context("fork")
    forked = context.Process(target=play_on, args=(pool, made, expected))
    forked.start()
    forked.join(600.0)
    assert forked.exitcode == 0
    np.testing.assert_array_equal(step(pool, made, commands(1)), expected)
    pool.close()


PROGRAM = """
import numpy as np
from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.world.warehouse.thread_pool import WorldThreadPool
worlds = [Warehouse(Scenario(n_robots=2)) for _ in range(4)]
for world in worlds: world.reset(0)
rows = np.zeros((8, worlds[0].observe().shape[1]), np.float32)
pool = WorldThreadPool(worlds, [0, 2, 4, 6], 3)
for _ in range(20):
    pool.step(np.zeros((8, 4)), rows, lambda *_: None)
print(rows.any())
"""


@pytest.mark.daily
@pytest.mark.compiled
def test_a_program_ends_while_its_pool_is_at_work() -> None:
    command = [sys.executable, "-c", PROGRAM]
    environment = {**os.environ, QUIET: "1"}
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=600, check=False, env=environment
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


@pytest.mark.compiled
def test_a_refused_command_counts_no_delivery_of_the_step_before_again() -> None:
    made = worlds()
    pool = WorldThreadPool(made, FIRSTS, 1)
    number = 0
    while not any(world.state.delivered for world in made):
        step(pool, made, commands(number))
        number += 1
    wrong, counted = commands(number), [world.state.delivered for world in made]
    wrong[:, 1] = np.nan
    for _ in range(2):
        with pytest.raises(CommandError):
            step(pool, made, wrong)
    assert [world.state.delivered for world in made] == counted
    pool.close()


@pytest.mark.parametrize("n_helpers", [0, 2])
def test_every_world_takes_its_step_though_the_caller_fails_in_the_midst(n_helpers: int) -> None:
    made, alone = worlds(), worlds()
    pool = WorldThreadPool(made, FIRSTS, n_helpers)
    pool.is_watched[:] = 1

    def fails(*_: object) -> None:
        raise ValueError("broken")

    rows, actions = np.zeros((sum(SIZES), N_COLUMNS), np.float32), commands(0)
    with pytest.raises(ValueError, match="broken"):
        pool.step(actions, rows, fails)
    for world, other, first in zip(made, alone, FIRSTS):
        robots = slice(first, first + world.state.n_robots)
        np.testing.assert_array_equal(other.step(actions[robots]), rows[robots])
        assert world.state.step == 1
    step_beside(pool, made, alone, range(1, 5))
    pool.close()
