"""Several warehouses take a step at the same time, shared out among threads.

Waking a thread takes as long as stepping a world, and so does waiting for the interpreter's lock.
So helpers stay inside one compiled call, without the lock, as long as steps follow each other
closely; every thread takes the next world that nobody has taken, from a board they all read.
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

from swarm_logistics_env.errors import CommandError
from swarm_logistics_env.kernels import kernel
from swarm_logistics_env.warehouse import stepping
from swarm_logistics_env.warehouse.atomic import add, exchange, load, replace
from swarm_logistics_env.warehouse.native import pointer_at
from swarm_logistics_env.warehouse.warehouse import Warehouse

carray: Callable[..., NDArray[Any]] = numba.carray  # type: ignore[attr-defined]  # not declared

# Places of the board, 8 bytes each. Worlds are taken and given in turn, counted without end, so
# that a helper who comes late finds nothing to take rather than something that is not ready.
TAKEN, GIVEN, ASLEEP, IS_CLOSED, COMMANDS, COMMAND_COLUMNS, ROWS, ROW_COLUMNS, N_ORDERS = range(9)
_FIRST_ORDER = 9
# Places of an order, one per world, behind them.
FIRST, TABLES, N_TABLES, N_ROBOTS, STEP, REQUESTED, PAUSES, OUTCOME, N_PLACES = range(9)
UNDER_WAY = -3  # an outcome that is none of `stepping`'s
# How often a helper looks for work before it goes to sleep: 0.3 ms, what ten wakings take.
_PATIENCE = 400_000


class Crew:
    """Threads that step warehouses together; whoever asks for a step works as well.

    A process that was forked has a crew of its own, from its first step on.

    Args:
        n_worlds: how many warehouses a step has.
        n_helpers: how many threads there are beside the caller's.

    Attributes:
        close: ends the helpers; harmless when called twice. What a crew is asked for afterwards
            the caller does alone.
    """

    close: Callable[[], object]

    def __init__(self, n_worlds: int, n_helpers: int) -> None:
        self._n_worlds, self._n_helpers = n_worlds, n_helpers
        self._gather()

    def _gather(self) -> None:
        self._process = os.getpid()
        self._board = board = np.zeros(_FIRST_ORDER + self._n_worlds * N_PLACES, np.int64)
        board[N_ORDERS] = self._n_worlds
        self._at: int = board.ctypes.data
        # Not a semaphore, whose lock another thread may hold at a fork or when a finalizer comes.
        self._bell: SimpleQueue[None] = SimpleQueue()
        # Compiled before helpers are many and in the way of the caller, and so that no Ctrl-C
        # finds them half compiled.
        give(self._at, np.zeros((0, 7), np.int64), np.zeros((0, 0)), np.zeros((0, 0), np.float32))
        help_out(self._at, 0)
        exchange_sleepers(self._at)
        finish(self._at)
        self.close = weakref.finalize(self, _close, board, self._bell, self._n_helpers)
        for _ in range(self._n_helpers):
            threading.Thread(
                target=_help, args=(board, self._bell), name="swarm-crew", daemon=True
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
            SetupError: a world was never reset.
        """
        orders = np.array(
            [(first, *world.order()) for world, first in zip(worlds, firsts)], np.int64
        )
        if self._process != os.getpid():
            self._gather()
        place = 0
        try:
            # One call for all, and one that ends what is left: Ctrl-C comes between calls.
            give(self._at, orders, commands, rows)
            for _ in range(exchange_sleepers(self._at)):
                self._bell.put(None)
            while place < len(worlds):
                # Not more than one at a time: what helpers have done meanwhile can be seen to
                # while they go on.
                if not work_once(self._at):
                    self._wait_for(place)
                while place < len(worlds) and result(self._at, place, 1) != UNDER_WAY:
                    place += 1
                    arrived(place - 1, self._arrive(place - 1, worlds, firsts, commands, rows))
        finally:
            if place < len(worlds):
                finish(self._at)
            for left in range(place, len(worlds)):
                with contextlib.suppress(CommandError):  # one is raised already
                    self._arrive(left, worlds, firsts, commands, rows)

    def _arrive(
        self,
        place: int,
        worlds: Sequence[Warehouse],
        firsts: Sequence[int],
        commands: NDArray[np.float64],
        rows: NDArray[np.float32],
    ) -> NDArray[np.float32]:
        world = worlds[place]
        own = slice(firsts[place], firsts[place] + world.state.n_robots)
        return world.arrive(commands[own], rows[own], result(self._at, place, 1))

    def _wait_for(self, place: int) -> None:
        while result(self._at, place, _PATIENCE) == UNDER_WAY:
            time.sleep(0)  # its thread may be waiting for this one's core


def _help(board: NDArray[np.int64], bell: SimpleQueue[None]) -> None:
    while not help_out(board.ctypes.data, _PATIENCE):
        bell.get()


def _close(board: NDArray[np.int64], bell: SimpleQueue[None], n_helpers: int) -> None:
    board[IS_CLOSED] = 1
    for _ in range(n_helpers):
        bell.put(None)


@kernel
def order_at(board: int, place: int) -> int:
    """Return the address of an order."""
    return board + 8 * (_FIRST_ORDER + place * N_PLACES)


@kernel
def give(
    board: int,
    orders: NDArray[np.int64],
    commands: NDArray[np.float64],
    rows: NDArray[np.float32],
) -> None:
    """Give out the next worlds, all of a step.

    Args:
        board: its address.
        orders: (n, 7): each world's first row, and what `Warehouse.order` says.
        commands: (R, C) of all.
        rows: (R, D) for the observations of all.
    """
    exchange(board + 8 * COMMANDS, commands.ctypes.data)
    exchange(board + 8 * COMMAND_COLUMNS, commands.shape[1])
    exchange(board + 8 * ROWS, rows.ctypes.data)
    exchange(board + 8 * ROW_COLUMNS, rows.shape[1])
    given = load(board + 8 * GIVEN)
    for world in range(len(orders)):
        order = order_at(board, (given + world) % load(board + 8 * N_ORDERS))
        for place in range(OUTCOME):
            exchange(order + 8 * place, orders[world, place])
        exchange(order + 8 * OUTCOME, UNDER_WAY)
        exchange(board + 8 * GIVEN, given + world + 1)


@kernel
def exchange_sleepers(board: int) -> int:
    """Return how many helpers went to sleep and were not yet called."""
    return exchange(board + 8 * ASLEEP, 0)


@kernel
def work(board: int) -> None:
    """Step worlds until none is left to take."""
    while work_once(board):
        pass


@kernel
def work_once(board: int) -> bool:
    """Step the next world, or return that none is left to take."""
    while True:
        taken = load(board + 8 * TAKEN)
        if taken >= load(board + 8 * GIVEN):
            return False
        if replace(board + 8 * TAKEN, taken, taken + 1):
            break
    order = order_at(board, taken % load(board + 8 * N_ORDERS))
    n_robots, first = load(order + 8 * N_ROBOTS), load(order + 8 * FIRST)
    columns, width = load(board + 8 * COMMAND_COLUMNS), load(board + 8 * ROW_COLUMNS)
    commands = load(board + 8 * COMMANDS) + 8 * first * columns
    rows = load(board + 8 * ROWS) + 4 * first * width
    outcome = stepping.step(
        carray(pointer_at(load(order + 8 * TABLES)), (load(order + 8 * N_TABLES), 3), np.int64),
        carray(pointer_at(commands), (n_robots, columns), np.float64),
        load(order + 8 * STEP),
        load(order + 8 * REQUESTED),
        load(order + 8 * PAUSES) != 0,
        carray(pointer_at(rows), (n_robots, width), np.float32),
    )
    exchange(order + 8 * OUTCOME, outcome)
    return True


@kernel
def finish(board: int) -> None:
    """Step all worlds that are left and wait for those that others step."""
    work(board)
    for place in range(load(board + 8 * N_ORDERS)):
        while load(order_at(board, place) + 8 * OUTCOME) == UNDER_WAY:
            pass


@kernel
def result(board: int, place: int, patience: int) -> int:
    """Return the outcome of a world's step, or `UNDER_WAY` if `patience` looks see none."""
    for _ in range(patience):
        outcome = load(order_at(board, place) + 8 * OUTCOME)
        if outcome != UNDER_WAY:
            return outcome
    return UNDER_WAY


@kernel
def help_out(board: int, patience: int) -> bool:
    """Work until nothing came for `patience` looks; returns whether the crew is closed."""
    looks = 0
    while looks < patience:
        if load(board + 8 * IS_CLOSED) != 0:
            return True
        if load(board + 8 * TAKEN) < load(board + 8 * GIVEN):
            work(board)
            looks = 0
        looks += 1
    # Asleep first, then one more look: whoever gave before it must be seen, whoever gives
    # after it sees the sleeper.
    add(board + 8 * ASLEEP, 1)
    work(board)
    return load(board + 8 * IS_CLOSED) != 0
