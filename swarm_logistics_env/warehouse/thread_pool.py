"""Several warehouses take a step at the same time, shared out among threads.

Waking a thread takes as long as stepping a world, and so does waiting for the interpreter's lock.
So helpers stay inside one compiled call, without the lock, as long as steps follow each other
closely; every thread takes the next world that nobody has taken, from a queue of jobs.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
import weakref
from collections.abc import Callable, Sequence
from queue import SimpleQueue
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env.errors import CommandError, ScenarioError
from swarm_logistics_env.kernels import inlined_kernel, kernel
from swarm_logistics_env.warehouse import stepping
from swarm_logistics_env.warehouse.atomic import add, exchange, load, replace
from swarm_logistics_env.warehouse.native import pointer_at
from swarm_logistics_env.warehouse.stepping import StepResult
from swarm_logistics_env.warehouse.warehouse import Warehouse

carray: Callable[..., NDArray[Any]] = numba.carray  # type: ignore[attr-defined]  # not declared

_WORD = 8  # bytes
# Words of the queue. Jobs are taken and given in turn, counted without end, so that a helper who
# comes late finds nothing to take rather than something that is not ready.
TAKEN, GIVEN, ASLEEP, IS_CLOSED, N_JOBS, FIRST_JOB = range(6)
# Words of a job, one per world, behind them; the result's are the last.
WORLD, N_ROBOTS, COMMANDS, COMMAND_COLUMNS, ROWS, ROW_COLUMNS, IS_DONE, RESULT = range(8)
_JOB_LENGTH = RESULT + len(StepResult._fields)
# How often a helper looks for work before it goes to sleep: 0.3 ms, what ten wakings take.
_PATIENCE = 400_000


class WorldThreadPool:
    """Threads that step warehouses together; whoever asks for a step works as well.

    A process that was forked has threads of its own, from its first step on.

    Args:
        n_worlds: how many warehouses a step has.
        n_helpers: how many threads there are beside the caller's.

    Attributes:
        close: ends the helpers; harmless when called twice. Steps that are asked for afterwards
            the caller takes alone.
    """

    close: Callable[[], object]

    def __init__(self, n_worlds: int, n_helpers: int) -> None:
        self._n_worlds, self._n_helpers = n_worlds, n_helpers
        self._start()

    def _start(self) -> None:
        self._process = os.getpid()
        self._queue = queue = np.zeros(FIRST_JOB + self._n_worlds * _JOB_LENGTH, np.int64)
        queue[N_JOBS] = self._n_worlds
        jobs = queue[FIRST_JOB:].reshape(-1, _JOB_LENGTH)
        jobs[:, IS_DONE], self._results = 1, jobs[:, RESULT:]
        self._address: int = queue.ctypes.data
        # Not a semaphore, whose lock another thread may hold at a fork or when a finalizer comes.
        self._wake: SimpleQueue[None] = SimpleQueue()
        # Compiled before helpers are many and in the way of the caller, and so that no Ctrl-C
        # finds them half compiled.
        nothing = np.zeros((0, 3), np.int64), np.zeros((0, 0)), np.zeros((0, 0), np.float32)
        submit(self._address, *nothing)
        help_out(self._address, 0)
        take_sleepers(self._address)
        finished_from(self._address, 0, 0)
        finish(self._address)
        self.close = weakref.finalize(self, _close, queue, self._wake, self._n_helpers)
        for _ in range(self._n_helpers):
            threading.Thread(
                target=_help, args=(queue, self._wake), name="swarm-helper", daemon=True
            ).start()

    def step(
        self,
        worlds: Sequence[Warehouse],
        firsts: Sequence[int],
        commands: NDArray[np.float64],
        rows: NDArray[np.float32],
        arrived: Callable[[int, NDArray[np.float32]], None],
    ) -> None:
        """Take one control period in every world.

        Args:
            worlds: as many as announced, each begun.
            firsts: of each, the first of its N rows.
            commands: (R, C) of all; the worlds keep them for their pickles.
            rows: (R, D) for the observations of all.
            arrived: called with the place of each world, in their order and in the caller's
                thread, and its observations, a part of `rows`, while others may be under way.

        Raises:
            CommandError: a robot's command is not finite; its world is as it was.
            ScenarioError: an item that came back to a storage found no room.
            SetupError: a world was never reset.
        """
        jobs = [
            (world.address, first, world.state.n_robots) for world, first in zip(worlds, firsts)
        ]
        if self._process != os.getpid():
            self._start()
        place = n_finished = 0
        try:
            # One call for all, and one that ends what is left: Ctrl-C comes between calls.
            submit(self._address, np.array(jobs, np.int64), commands, rows)
            for _ in range(take_sleepers(self._address)):
                self._wake.put(None)
            while place < len(worlds):
                # Not more than one at a time: what helpers have done meanwhile can be seen to
                # while they go on.
                if not run_next_job(self._address):
                    self._wait_for(place)
                n_finished = finished_from(self._address, place, 1)
                while place < n_finished:
                    place += 1
                    arrived(place - 1, self._take(place - 1, worlds, firsts, commands, rows))
        finally:
            if place < len(worlds):
                finish(self._address)
            for left in range(place, len(worlds)):
                # One is raised already.
                with contextlib.suppress(CommandError, ScenarioError):
                    self._take(left, worlds, firsts, commands, rows)

    def _take(
        self,
        place: int,
        worlds: Sequence[Warehouse],
        firsts: Sequence[int],
        commands: NDArray[np.float64],
        rows: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        world, result = worlds[place], StepResult(*self._results[place].tolist())
        own = slice(firsts[place], firsts[place] + world.state.n_robots)
        sensed = rows[own]
        world.take(commands[own], sensed, result)
        return sensed

    def _wait_for(self, place: int) -> None:
        while finished_from(self._address, place, _PATIENCE) == place:
            time.sleep(0)  # its thread may be waiting for this one's core


def _help(queue: NDArray[np.int64], wake: SimpleQueue[None]) -> None:
    while not help_out(queue.ctypes.data, _PATIENCE):
        wake.get()


def _close(queue: NDArray[np.int64], wake: SimpleQueue[None], n_helpers: int) -> None:
    queue[IS_CLOSED] = 1
    for _ in range(n_helpers):
        wake.put(None)


@inlined_kernel
def job_at(queue: int, place: int) -> int:
    """Return the address of a job."""
    return queue + _WORD * (FIRST_JOB + place * _JOB_LENGTH)


@kernel
def submit(
    queue: int, jobs: NDArray[np.int64], commands: NDArray[np.float64], rows: NDArray[np.float32]
) -> None:
    """Give out the next jobs, all of a step.

    Args:
        queue: its address.
        jobs: (n, 3): each world's address, first row and number of robots.
        commands: (R, C) of all.
        rows: (R, D) for the observations of all.
    """
    n_columns, width = commands.shape[1], rows.shape[1]
    given = load(queue + _WORD * GIVEN)
    for place in range(len(jobs)):
        job = job_at(queue, (given + place) % load(queue + _WORD * N_JOBS))
        first = jobs[place, 1]
        exchange(job + _WORD * WORLD, jobs[place, 0])
        exchange(job + _WORD * N_ROBOTS, jobs[place, 2])
        exchange(job + _WORD * COMMANDS, commands.ctypes.data + _WORD * first * n_columns)
        exchange(job + _WORD * COMMAND_COLUMNS, n_columns)
        exchange(job + _WORD * ROWS, rows.ctypes.data + 4 * first * width)
        exchange(job + _WORD * ROW_COLUMNS, width)
        exchange(job + _WORD * IS_DONE, 0)
        exchange(queue + _WORD * GIVEN, given + place + 1)


@kernel
def take_sleepers(queue: int) -> int:
    """Return how many helpers went to sleep and were not yet called."""
    return exchange(queue + _WORD * ASLEEP, 0)


@kernel
def run_jobs(queue: int) -> None:
    """Step worlds until none is left to take."""
    while run_next_job(queue):
        pass


@kernel
def run_next_job(queue: int) -> bool:
    """Step the next world, or return that none is left to take."""
    while True:
        taken = load(queue + _WORD * TAKEN)
        if taken >= load(queue + _WORD * GIVEN):
            return False
        if replace(queue + _WORD * TAKEN, taken, taken + 1):
            break
    job = job_at(queue, taken % load(queue + _WORD * N_JOBS))
    n_robots, n_columns = load(job + _WORD * N_ROBOTS), load(job + _WORD * COMMAND_COLUMNS)
    shape = (n_robots, load(job + _WORD * ROW_COLUMNS))
    commands = carray(pointer_at(load(job + _WORD * COMMANDS)), (n_robots, n_columns), np.float64)
    rows = carray(pointer_at(load(job + _WORD * ROWS)), shape, np.float32)
    result = stepping.step(load(job + _WORD * WORLD), commands, rows)
    exchange(job + _WORD * RESULT, result.refused)
    exchange(job + _WORD * (RESULT + 1), result.n_delivered)
    exchange(job + _WORD * (RESULT + 2), int(result.is_paused))
    exchange(job + _WORD * (RESULT + 3), int(result.is_room))
    exchange(job + _WORD * IS_DONE, 1)
    return True


@kernel
def finish(queue: int) -> None:
    """Step all worlds that are left and wait for those that others step."""
    run_jobs(queue)
    for place in range(load(queue + _WORD * N_JOBS)):
        while load(job_at(queue, place) + _WORD * IS_DONE) == 0:
            pass


@kernel
def finished_from(queue: int, place: int, patience: int) -> int:
    """Return where the next job that is not done stands, from `place` on.

    If that is `place` itself, it looks `patience` times.
    """
    n_jobs, first = load(queue + _WORD * N_JOBS), place
    for _ in range(patience):
        while place < n_jobs and load(job_at(queue, place) + _WORD * IS_DONE) != 0:
            place += 1
        if place > first:
            break
    return place


@kernel
def help_out(queue: int, patience: int) -> bool:
    """Work until nothing came for `patience` looks; returns whether the pool is closed."""
    looks = 0
    while looks < patience:
        if load(queue + _WORD * IS_CLOSED) != 0:
            return True
        if load(queue + _WORD * TAKEN) < load(queue + _WORD * GIVEN):
            run_jobs(queue)
            looks = 0
        looks += 1
    # Asleep first, then one more look: whoever gave before it must be seen, whoever gives
    # after it sees the sleeper.
    add(queue + _WORD * ASLEEP, 1)
    run_jobs(queue)
    return load(queue + _WORD * IS_CLOSED) != 0
