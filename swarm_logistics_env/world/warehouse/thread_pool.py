"""Several warehouses take a step at the same time, shared out among threads.

Waking a thread takes as long as stepping a world, and so does waiting for the interpreter's lock.
So helpers stay inside one compiled call, without the lock, as long as steps follow each other
closely; every thread takes the next world that nobody has taken, from a queue of jobs.

The queue is integers that several threads read and change at the same time, inside kernels.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
import weakref
from collections.abc import Callable, Sequence
from queue import SimpleQueue

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.compiler.addresses import (
    add,
    exchange,
    load_word,
    pointer_at,
    replace,
    unpacked_at,
)
from swarm_logistics_env.compiler.kernels import carray, engine_kernel, inlined_kernel
from swarm_logistics_env.compiler.numba_fence import IS_PLAIN
from swarm_logistics_env.core.errors import ScenarioError
from swarm_logistics_env.world.scenario import CHIPMUNK

from . import stepping
from .commands import not_finite, refused_command
from .one_thread import holding
from .structs import NOBODY, Numbers, Sensed, World
from .warehouse import Warehouse

# Words of the queue. Jobs are taken and given in turn, counted without end, so that a helper who
# comes late finds nothing to take rather than something that is not ready.
TAKEN, GIVEN, ASLEEP, IS_CLOSED, N_JOBS, ROWS, ROW_COLUMNS, FIRST_JOB = range(8)
# Words of a job, one per world, behind them.
WORLD, FIRST_ROW, IS_DONE, IS_EVENTFUL, IS_WATCHED, JOB_LENGTH = range(6)
# How often a thread looks for work before it goes to sleep: 0.3 ms, what ten wakings take.
_PATIENCE = 100_000
_NOT_YET = -1


class WorldThreadPool:
    """Threads that step warehouses together; whoever asks for a step works as well.

    A process that was forked has threads of its own, from its first step on.

    Args:
        worlds: the warehouses, each begun before the first step.
        firsts: of each, the first of its N rows.
        n_helpers: how many threads there are beside the caller's.

    Attributes:
        is_watched: (worlds,) of each, whether a step calls `arrived` even if it is not eventful.
        close: ends the helpers; harmless when called twice. Steps that are asked for afterwards
            the caller takes alone.
    """

    close: Callable[[], object]

    def __init__(self, worlds: Sequence[Warehouse], firsts: Sequence[int], n_helpers: int) -> None:
        self._worlds = worlds
        self._firsts = firsts
        # The interpreter runs one thread at a time.
        self._n_helpers = 0 if IS_PLAIN else n_helpers
        self.is_watched = np.zeros(len(worlds), np.int64)
        self._start()

    def _start(self) -> None:
        self._process = os.getpid()
        n_worlds = len(self._worlds)
        self._queue = queue = np.zeros(FIRST_JOB + n_worlds * JOB_LENGTH, np.int64)
        self._jobs = jobs = queue[FIRST_JOB:].reshape(-1, JOB_LENGTH)
        jobs[:, FIRST_ROW] = self._firsts
        jobs[:, IS_DONE] = 1
        jobs[:, IS_WATCHED], self.is_watched = self.is_watched, jobs[:, IS_WATCHED]
        self._address: int = queue.ctypes.data
        # No semaphore: another thread may hold its lock at a fork or when a finalizer comes.
        self._wake: SimpleQueue[None] = SimpleQueue()
        # Compiled, as there are no jobs yet, before helpers are many and in the way of the caller,
        # and so that no Ctrl-C finds them half compiled.
        submit(self._address, np.zeros((0, 0)), np.zeros((0, 0), np.float32))
        help_out(self._address, 0)
        find_next_done(self._address, 0, 0)
        finish(self._address)
        take_sleepers(self._address)
        queue[N_JOBS] = n_worlds
        self.close = weakref.finalize(self, _close, queue, self._wake, self._n_helpers)
        for _ in range(self._n_helpers):
            threading.Thread(
                target=_help, args=(queue, self._wake), name="swarm-helper", daemon=True
            ).start()

    def step(
        self, commands: NDArray[np.float64], rows: Sensed, arrived: Callable[[int, Sensed], None]
    ) -> None:
        """Take one control period in every world.

        Args:
            commands: (R, C) of all.
            rows: (R, D) for the observations of all.
            arrived: called with the index of each world whose step was eventful or that is
                watched, in their order and in the caller's thread, and with its observations, a
                part of `rows`, while others may be under way.

        Raises:
            CommandError: a robot's command is not finite; all worlds are as they were.
            ScenarioError: an item that came back to a storage found no room.
            SetupError: a world was never reset, or another thread is using it.
        """
        with holding([world.lock for world in self._worlds]):
            if all(world.scenario.bodies == CHIPMUNK for world in self._worlds):
                self._step(commands, rows, arrived)
            else:
                self._step_in_turn(commands, rows, arrived)

    def _step_in_turn(
        self, commands: NDArray[np.float64], rows: Sensed, arrived: Callable[[int, Sensed], None]
    ) -> None:
        """Step worlds of which others move the bodies; they need the interpreter."""
        for index, (world, first) in enumerate(zip(self._worlds, self._firsts, strict=True)):
            last = first + world.scenario.n_robots
            rows[first:last] = world.step(commands[first:last])
            if world.is_eventful or self.is_watched[index]:
                arrived(index, rows[first:last])

    def _step(
        self, commands: NDArray[np.float64], rows: Sensed, arrived: Callable[[int, Sensed], None]
    ) -> None:
        if self._process != os.getpid():
            self._start()
        self._jobs[:, WORLD] = [world.address for world in self._worlds]
        index = 0
        n_worlds = len(self._worlds)
        try:
            # One call for all, and one that ends what is left: Ctrl-C comes between calls.
            refused = submit(self._address, commands, rows)
            if refused != NOBODY:
                index = n_worlds
                raise not_finite(commands, refused)
            for _ in range(take_sleepers(self._address)):
                self._wake.put(None)
            while index < n_worlds:
                next_done = find_next_done(self._address, index, _PATIENCE)
                if next_done == _NOT_YET:
                    time.sleep(0)  # a thread that works may be waiting for this one's core
                    continue
                while index < next_done:
                    index += 1
                    self._take(index - 1, rows)
                if next_done < n_worlds:
                    index += 1
                    arrived(next_done, self._take(next_done, rows))
        finally:
            if index < n_worlds:
                finish(self._address)
            for left in range(index, n_worlds):
                # One is raised already.
                with contextlib.suppress(ScenarioError):
                    self._take(left, rows)

    def _take(self, index: int, rows: Sensed) -> Sensed:
        world = self._worlds[index]
        first = self._firsts[index]
        sensed = rows[first : first + world.scenario.n_robots]
        world.take(sensed, bool(self._jobs[index, IS_EVENTFUL]))
        return sensed


def _help(queue: NDArray[np.int64], wake: SimpleQueue[None]) -> None:
    while not help_out(queue.ctypes.data, _PATIENCE):
        wake.get()


def _close(queue: NDArray[np.int64], wake: SimpleQueue[None], n_helpers: int) -> None:
    queue[IS_CLOSED] = 1
    for _ in range(n_helpers):
        wake.put(None)


@inlined_kernel
def job_at(queue: int, index: int) -> int:
    """Return the address of a job."""
    return queue + 8 * (FIRST_JOB + index * JOB_LENGTH)


@engine_kernel
def submit(queue: int, commands: Numbers, rows: Sensed) -> int:
    """Give out the jobs of a step, but none if a command is refused.

    Args:
        queue: its address.
        commands: (R, C) of all.
        rows: (R, D) for the observations of all.

    Returns:
        The index, row by row, of the first command that is not finite; NOBODY if all are.
    """
    n_jobs = load_word(queue, N_JOBS)
    for index in range(n_jobs):
        job = job_at(queue, index)
        world, first = unpacked_at(World, load_word(job, WORLD)), load_word(job, FIRST_ROW)
        now = world.commands.now
        for robot in range(len(now)):
            for column in range(now.shape[1]):
                now[robot, column] = commands[first + robot, column]
        refused = refused_command(world)
        world.outcome.refused[0] = NOBODY
        if refused != NOBODY:
            return int(first * commands.shape[1] + refused)
    for index in range(n_jobs):
        exchange(job_at(queue, index), IS_DONE, 0)
    exchange(queue, ROWS, rows.ctypes.data)
    exchange(queue, ROW_COLUMNS, rows.shape[1])
    add(queue, GIVEN, n_jobs)
    return NOBODY


@engine_kernel
def take_sleepers(queue: int) -> int:
    """Return how many helpers went to sleep and were not yet called."""
    return exchange(queue, ASLEEP, 0)


@engine_kernel
def run_next_job(queue: int) -> bool:
    """Step the next world, or return that none is left to take."""
    while True:
        taken = load_word(queue, TAKEN)
        if taken >= load_word(queue, GIVEN):
            return False
        if replace(queue, TAKEN, taken, taken + 1):
            break
    job = job_at(queue, taken % load_word(queue, N_JOBS))
    address = load_word(job, WORLD)
    first = load_word(job, FIRST_ROW)
    n_robots = len(unpacked_at(World, address).robots.item)
    n_columns = load_word(queue, ROW_COLUMNS)
    first_row = load_word(queue, ROWS) + 4 * first * n_columns
    rows = carray(pointer_at(first_row), (n_robots, n_columns), np.float32)
    is_eventful = stepping.step(address, rows)
    exchange(job, IS_EVENTFUL, int(is_eventful))
    exchange(job, IS_DONE, 1)
    return True


@engine_kernel
def find_next_done(queue: int, index: int, patience: int) -> int:
    """Step worlds until one, from `index` on, is done that the caller has to be told of.

    Returns its index; the number of worlds if all are done and none is; _NOT_YET if others still
    step it after `patience` looks.
    """
    n_jobs = load_word(queue, N_JOBS)
    looks = 0
    while index < n_jobs:
        job = job_at(queue, index)
        if load_word(job, IS_DONE) != 0:
            if load_word(job, IS_EVENTFUL) != 0 or load_word(job, IS_WATCHED) != 0:
                return index
            index += 1
        elif not run_next_job(queue):
            looks += 1
            if looks > patience:
                return _NOT_YET
    return index


@engine_kernel
def finish(queue: int) -> None:
    """Step all worlds that are left and wait for those that others step."""
    while run_next_job(queue):
        pass
    for index in range(load_word(queue, N_JOBS)):
        while load_word(job_at(queue, index), IS_DONE) == 0:
            pass


@engine_kernel
def help_out(queue: int, patience: int) -> bool:
    """Work until nothing came for `patience` looks; returns whether the pool is closed."""
    looks = 0
    while looks < patience:
        if load_word(queue, IS_CLOSED) != 0:
            return True
        looks = 0 if run_next_job(queue) else looks + 1
    # Asleep first, then one more look: whoever gave before it must be seen, whoever gives
    # after it sees the sleeper.
    add(queue, ASLEEP, 1)
    while run_next_job(queue):
        pass
    return load_word(queue, IS_CLOSED) != 0
