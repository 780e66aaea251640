"""Invariants of every step of every world, checked without the kernels that keep them."""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import NDArray

from swarm_logistics_env import Warehouse
from swarm_logistics_env import observations as row
from swarm_logistics_env.warehouse import FailureMode
from swarm_logistics_env.warehouse.failure_modes import failure_mode
from swarm_logistics_env.warehouse.logistics import IDLE, LIFTING
from swarm_logistics_env.warehouse.state import (
    CARRIED,
    DELIVERED,
    NOBODY,
    STORED,
    WarehouseState,
)

SUSTAINED = 0.02  # [m], how far bodies may stand inside each other in a jam
JAM = 1.0  # [s] of overlap without a break make a jam


class BrokenPromiseError(AssertionError):
    """An invariant that does not hold, with the step and what was seen."""


class Watch:
    """Looks at one world, which has been reset, now and after every step.

    Attributes:
        depth: how deep each robot (row) stands in every robot, obstacle, wall and item now [m], in
            this order; -inf: it may not or need not touch it.
        deepest: the greatest overlap seen between bodies [m].

    Raises:
        BrokenPromiseError: from `look`, with one sentence.
    """

    def __init__(self, world: Warehouse) -> None:
        self.world = world
        self.deepest = 0.0
        self._dock = world.scenario.dock_capacity
        self._jammed = np.zeros((0, 0))
        self._covered = np.zeros(len(world.state.item_position), np.bool_)
        self._remember()

    def look(self) -> None:
        """Check everything."""
        self._items()
        self._handling()
        self._cover()
        self._bodies()
        self._timers()
        self._capabilities()
        self._rows()
        self._remember()

    def _remember(self) -> None:
        self._before, self._scenario = copy.deepcopy(self.world.state), self.world.scenario

    def faults_changed(self) -> None:
        """Note that faults were set: what was repaired may come back within the next step.

        A robot that was removed stands above nothing when that step begins.
        """
        now, before = self.world.state, self._before
        before.failure_modes = tuple(
            tuple(name for name in then if name in after)
            for then, after in zip(before.failure_modes, now.failure_modes)
        )
        before.robot_item[~now.robot_present] = NOBODY

    def _demand(self, holds: bool, words: str) -> None:
        # Every comparison is written so that NaN fails it.
        if not holds:
            raise BrokenPromiseError(f"at step {self.world.state.step} {words}")

    def _items(self) -> None:
        state, scenario = self.world.state, self.world.scenario
        status, carrier = state.item_status, state.item_carrier
        self._demand(len(status) == scenario.n_items, f"there are {len(status)} items")
        known = np.isin(status, (STORED, CARRIED, DELIVERED))
        self._demand(bool(known.all()), "an item is neither stored nor carried nor delivered")
        self._demand(bool(np.isfinite(state.item_position).all()), "an item is nowhere")
        carriers = np.flatnonzero(state.robot_item != NOBODY)
        carried = state.robot_item[carriers]
        self._demand(len(set(carried.tolist())) == len(carried), "two robots carry one item")
        hands = np.full(len(status), NOBODY)
        hands[carried] = carriers
        self._demand(bool((hands == carrier).all()), f"items {carried} are not noted as carried")
        is_carried = (status == CARRIED) == (hands != NOBODY)
        self._demand(bool(is_carried.all()), "an item is carried by nobody, or is not and is")
        self._deliveries()
        if state.requested == NOBODY:
            self._demand(bool((state.item_status == DELIVERED).all()), "nothing is asked for")
        else:
            asked = state.open_requests[state.open_requests != NOBODY]
            is_known = (asked >= 0) & (asked < scenario.n_items)
            self._demand(bool(is_known.all()), f"{asked} is asked")
            is_there = np.isin(state.item_status[asked], (STORED, CARRIED))
            self._demand(bool(is_there.all()), "the requested item is delivered")
            first = state.open_requests[: len(asked)]
            self._demand(np.array_equal(first, asked), "there is a gap among the requests")
        gaps = np.diff(np.array(state.delivery_times))
        self._demand(bool((gaps >= 0.0).all()), "delivery times fall")
        if scenario.dock_capacity is not None and scenario.dock_capacity == self._dock:
            self._demand(bool((gaps >= 1.0 / self._dock - 1e-6).all()), "the dock takes too many")
        far = np.array([scenario.warehouse_width, scenario.warehouse_height])
        here = state.item_position[state.item_status == STORED]
        self._demand(bool(((here > 0.0) & (here < far)).all()), "an item lies outside")

    def _deliveries(self) -> None:
        state, before = self.world.state, self._before
        news = state.delivered - before.delivered
        self._demand(news >= 0, f"{-news} deliveries were taken back")
        noted = len(state.delivered_by)
        self._demand(noted == state.delivered, f"{noted} noted for {state.delivered} deliveries")
        gone, left = (int((s.item_status == DELIVERED).sum()) for s in (state, before))
        # If `restock` changed during the step, either value may have held.
        restocks = self.world.scenario.restock, self._scenario.restock
        self._demand(
            gone in {left + (0 if restock else news) for restock in restocks},
            f"{gone} items have left for {state.delivered} deliveries",
        )

    def _bodies(self) -> None:
        scenario, state = self.world.scenario, self.world.state
        here = state.robot_present
        at, radius = state.robot_position, scenario.robot_radius
        gaps = np.linalg.norm(at[:, None] - at[None], axis=2) - 2.0 * radius
        off = ~(here[:, None] & here[None]) | np.eye(len(at), dtype=bool)
        solids = state.obstacle_position
        to_solids = np.linalg.norm(at[:, None] - solids[None], axis=2)
        to_solids -= radius + scenario.obstacle_radius
        far = np.array([scenario.warehouse_width, scenario.warehouse_height])
        to_walls = np.hstack([at, far - at]) - radius
        to_items = np.linalg.norm(at[:, None] - state.item_position[None], axis=2)
        to_items -= radius + scenario.item_radius
        solid = (state.item_status == STORED) & ~self._covered
        met = (state.robot_item != NOBODY)[:, None] & solid
        depth = np.hstack(
            [
                np.where(off, -np.inf, -gaps),
                -to_solids,
                -to_walls,
                np.where(met, -to_items, -np.inf),
            ]
        )
        depth[~here] = -np.inf
        self.depth = depth
        # The speed of the last step is that before or after a change.
        fastest = max(self._scenario.max_speed, scenario.max_speed)
        closing = 2.0 * fastest * scenario.physics_period
        deepest = float(depth.max(initial=-np.inf))
        self._demand(
            deepest <= closing + SUSTAINED,
            f"bodies overlap by {deepest:.4f} m: should be at most {closing:.4f} m, what they "
            "close in one substep, beyond the depth of a jam",
        )
        inside = np.minimum(at, far - at).min(axis=1)[here]
        self._demand(bool((inside > 0.0).all()), "a robot is outside the walls")
        self.deepest = max(self.deepest, deepest)
        # A crowd presses deeper in where robots drive far between two collision checks.
        allowed = max(SUSTAINED, 0.25 * closing)
        # For how long each pair is deeper than it may be in a jam.
        if self._jammed.shape != depth.shape:
            self._jammed = np.zeros(depth.shape)
        self._jammed = np.where(depth > allowed, self._jammed + scenario.control_period, 0.0)
        lasting = float(depth[self._jammed > JAM].max(initial=0.0))
        self._demand(
            lasting == 0.0,
            f"bodies overlap by more than {allowed:.4f} m for {JAM} s, now by {lasting:.4f} m",
        )

    def _handling(self) -> None:
        """Check that who handles an item stands, and that nobody else lifts it."""
        state = self.world.state
        kind, item, _ = state.robots.handling.T
        lifted = item[kind == LIFTING]
        self._demand(len(set(lifted.tolist())) == len(lifted), "two robots lift one item")
        is_stored = state.item_status[lifted] == STORED
        self._demand(bool(is_stored.all()), "an item is being lifted and is not stored")
        stood = (self._before.robots.handling[:, 0] != IDLE) & state.robot_present
        turned = stood & (state.robot_heading != self._before.robot_heading)
        self._demand(not turned.any(), "a robot turns while it handles an item")

    def _cover(self) -> None:
        """Note which items are no obstacles: (I,), by the rule and not by what the world says.

        Those that were put where they are, and those that a robot stood above when it took
        another; until a step begins with no laden robot above.
        """
        state, before = self.world.state, self._before
        self._covered &= self._above(before, before.robot_item != NOBODY)
        took = (state.robot_item != before.robot_item) & (state.robot_item != NOBODY)
        # Those too that delivered at once what they took.
        for robot in state.delivered_by[before.delivered :]:
            took[robot] |= before.robot_item[robot] == NOBODY
        put = (before.item_status != STORED) | (state.item_position != before.item_position).any(1)
        self._covered |= put | self._above(state, took)
        if (before.robot_present & ~state.robot_present).any():
            # It is no longer known where they were when they took something.
            self._covered |= state.item_covered == 1
        self._covered &= state.item_status == STORED
        self._demand(
            bool((self._covered == state.item_covered).all()), "an item is covered, or is not"
        )

    def _above(self, state: WarehouseState, laden: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which items have a robot that is `laden` above them, (I,)."""
        away = np.linalg.norm(state.robot_position[:, None] - state.item_position[None], axis=2)
        reach = self.world.scenario.robot_radius + self.world.scenario.item_radius
        above: NDArray[np.bool_] = (laden[:, None] & (away < reach)).any(axis=0)
        return above

    def _timers(self) -> None:
        state, limit = self.world.state, self.world.scenario.timer_limit
        for name in ("robot_timer", "robot_told", "robot_heard"):
            timer = getattr(state, name)
            self._demand(
                bool((np.isnan(timer) | ((timer >= 0.0) & (timer < limit))).all()),
                f"{name} leaves [0, {limit:g})",
            )

    def _capabilities(self) -> None:
        state, scenario = self.world.state, self.world.scenario
        for robot, names in enumerate(state.failure_modes):
            modes = [failure_mode(name) for name in names]
            self._exercised(robot, modes)
            # What held before and after a step held throughout it.
            then = self._before.failure_modes[robot]
            self._did(robot, [failure_mode(name) for name in names if name in then])
        tells = state.robot_present & state.sends & ~np.isnan(state.robot_told)
        gaps = state.robot_position[:, None] - state.robot_position[None]
        squares = (gaps**2).sum(axis=2)
        reached = (squares <= scenario.radio_range**2 * (1 + 1e-12)) & tells[None]
        np.fill_diagonal(reached, False)
        lowest = np.where(reached, state.robot_told[None], np.inf).min(axis=1, initial=np.inf)
        heard = np.where(np.isnan(state.robot_heard), np.inf, state.robot_heard)
        deaf = ~(state.hears & state.robot_present)
        self._demand(
            bool(np.isinf(heard[deaf]).all()), "a robot that does not hear has heard a timer"
        )
        self._demand(
            bool((heard >= lowest).all()), "a timer was heard that no robot in range broadcasts"
        )

    def _exercised(self, robot: int, modes: list[FailureMode]) -> None:
        state, scenario = self.world.state, self.world.scenario
        rows = self.world.observe()[robot]
        if not all(mode.present for mode in modes):
            self._demand(not state.robot_present[robot], f"robot {robot}, removed, is there")
        if not state.robot_present[robot]:
            self._demand(not rows.any(), f"robot {robot} is gone and senses")
            self._demand(state.robot_item[robot] == NOBODY, f"robot {robot} is gone and carries")
            self._demand(bool(np.isnan(state.robot_told[robot])), f"robot {robot} tells, gone")
            return
        if not all(mode.honest for mode in modes):
            self._demand(state.robot_told[robot] == 0.0, f"robot {robot} is in FM1, tells no 0")
        is_live = all(mode.rangers_refresh for mode in modes) and scenario.ranger_noise == 0.0
        if not all(mode.rangers for mode in modes) and is_live:
            scans = rows[: 3 * row.N_BEAMS]
            blind = bool((scans == np.float32(scenario.ranger_range)).all())
            self._demand(blind, f"robot {robot}'s blind rangers see")
        if any(mode.view == 0.0 for mode in modes):
            items = rows[row.ITEMS : row.NEIGHBOURS : len(row.ITEM_FEATURES)]
            self._demand(not items.any(), f"robot {robot} sees items without cameras")

    def _did(self, robot: int, modes: list[FailureMode]) -> None:
        state, before = self.world.state, self._before
        took = state.robot_item[robot] not in (before.robot_item[robot], NOBODY)
        if not all(mode.lifts for mode in modes):
            self._demand(not took, f"robot {robot} lifts item {state.robot_item[robot]}")
        news = state.delivered_by[before.delivered :]
        if not all(mode.delivers for mode in modes):
            self._demand(robot not in news, f"robot {robot} delivers in a mode that does not")
        if any(mode.speed == 0.0 for mode in modes):
            turned = state.robot_heading[robot] != before.robot_heading[robot]
            self._demand(not turned or not state.robot_present[robot], f"robot {robot} turns")
        jammed = not all(mode.releases_inside for mode in modes)
        if jammed and state.robot_in_delivery[robot] and state.robot_present[robot]:
            held = before.robot_item[robot]
            kept = held in (NOBODY, state.robot_item[robot])
            self._demand(kept, f"robot {robot}, jammed inside, lets item {held} go")
        if not all(mode.obeys for mode in modes) and state.robot_present[robot]:
            held = before.robot_item[robot]
            lost = held != NOBODY and state.robot_item[robot] != held
            # What cannot move may be above the delivery area's border when its item is asked for.
            self._demand(
                not lost or robot in news, f"robot {robot} is dead and lets item {held} go"
            )

    def _rows(self) -> None:
        rows = self.world.observe()
        low, high = row.bounds(self.world.scenario)
        here = self.world.state.robot_present
        fits = (rows[here] >= low) & (rows[here] <= high)
        names = [c.name for c in row.columns(self.world.scenario) if not fits[:, c.columns].all()]
        self._demand(not names, f"observations leave their ranges: {', '.join(names)}")
        asked = row.ITEMS + row.ITEM_FEATURES.index("requested")
        flags = rows[:, asked : row.NEIGHBOURS : len(row.ITEM_FEATURES)]
        most = self.world.scenario.n_requests
        self._demand(bool((flags.sum(axis=1) <= most).all()), "a robot sees too many requests")
