"""Invariants of every step of every world, checked without the kernels that keep them."""

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_logistics_env import Warehouse
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.floor.floor_plan import RACK
from swarm_logistics_env.world.warehouse.commands import IDLE, LIFTING
from swarm_logistics_env.world.warehouse.failure_modes import failure_mode
from swarm_logistics_env.world.warehouse.state import (
    CARRIED,
    DELIVERED,
    NOBODY,
    STORED,
    WarehouseState,
)
from swarm_logistics_env.world.warehouse.structs import ASKED, CAME

SUSTAINED = 0.02  # [m], how far bodies may stand inside each other in a jam
JAM = 1.0  # [s] of overlap without a break make a jam

Flags = NDArray[np.bool_]
Names = Sequence[Sequence[str]]  # of the failure modes of each robot


class BrokenPromiseError(AssertionError):
    """An invariant that does not hold, with the step and what was seen."""


class Watch:
    """Looks at one world, which has been reset, now and after every step.

    `depth` is how deep each robot (row) stands in every robot, obstacle, wall, rack, item [m], in
    this order, -inf: it may not or need not touch it; `deepest` the greatest overlap seen [m].
    """

    def __init__(self, world: Warehouse) -> None:
        self.world, self.deepest = world, 0.0
        # A far corner of the warehouse [m].
        self._far = np.array([world.scenario.warehouse_width, world.scenario.warehouse_height])
        self._dock = world.scenario.dock_capacity
        self._jammed = np.zeros((0, 0))
        self._energy_at_start = self._in_batteries_but_for_use()
        self._covered = np.zeros(len(world.state.item_position), np.bool_)
        self._remember()

    def look(self) -> None:
        """Check everything; one sentence says what does not hold (BrokenPromiseError)."""
        self._items()
        self._deliveries()
        self._orders()
        self._handling()
        self._cover()
        self._bodies()
        self._timers()
        self._exercised()
        self._did()
        self._heard()
        self._energy()
        self._rows()
        self._remember()

    def _remember(self) -> None:
        self._before, self._scenario = copy.deepcopy(self.world.state), self.world.scenario

    def faults_changed(self) -> None:
        """Note that faults were set: what was repaired may come back within the next step.

        A robot that was removed stands above nothing when that step begins.
        """
        now, before = self.world.state, self._before
        before.failure_modes = tuple(map(tuple, _in_both(before, now)))
        before.robot_item[~now.robot_present] = NOBODY

    def _demand(self, holds: ArrayLike, words: str) -> None:
        # Every comparison is written so that NaN fails it.
        if not np.all(holds):
            raise BrokenPromiseError(f"at step {self.world.state.step} {words}")

    def _each(self, where: Flags, holds: Any, words: str) -> None:
        """Demand something of the robots that are marked."""
        for robot in np.flatnonzero(where & ~holds):
            self._demand(False, words.format(robot))

    def _items(self) -> None:
        state, scenario = self.world.state, self.world.scenario
        status = state.item_status
        self._demand(len(status) == scenario.n_items, f"there are {len(status)} items")
        is_known = np.isin(status, (STORED, CARRIED, DELIVERED))
        self._demand(is_known, "an item is neither stored nor carried nor delivered")
        self._demand(np.isfinite(state.item_position), "an item is nowhere")
        carriers = np.flatnonzero(state.robot_item != NOBODY)
        carried = state.robot_item[carriers]
        self._demand(len(np.unique(carried)) == len(carried), "two robots carry one item")
        hands = np.full(len(status), NOBODY)
        hands[carried] = carriers
        self._demand(hands == state.item_carrier, f"items {carried} are not noted as carried")
        is_carried = (status == CARRIED) == (hands != NOBODY)
        self._demand(is_carried, "an item is carried by nobody, or is not and is")
        if state.requested == NOBODY:
            is_all_gone = scenario.has_orders or (status == DELIVERED).all()
            self._demand(is_all_gone, "nothing is asked for")
        else:
            requested = state.open_requests[state.open_requests != NOBODY]
            self._demand((requested >= 0) & (requested < scenario.n_items), f"{requested} is asked")
            is_there = np.isin(status[requested], (STORED, CARRIED))
            self._demand(is_there, "the requested item is delivered")
            first = state.open_requests[: len(requested)]
            self._demand(np.array_equal(first, requested), "there is a gap among the requests")
        gaps = np.diff(np.array(state.delivery_times))
        self._demand(gaps >= 0.0, "delivery times fall")
        if scenario.dock_capacity is not None and scenario.dock_capacity == self._dock:
            self._demand(gaps >= 1.0 / self._dock - 1e-6, "the dock takes too many")
        stored_at = state.item_position[status == STORED]
        self._demand((stored_at > 0.0) & (stored_at < self._far), "an item lies outside")
        self._demand(self.world.floor.is_free(stored_at), "an item lies inside a rack")
        self._demand(np.isfinite(self.world.floor.along(stored_at)), "no way leads to an item")

    def _deliveries(self) -> None:
        state, before = self.world.state, self._before
        news = state.delivered - before.delivered
        self._demand(news >= 0, f"{-news} deliveries were taken back")
        noted = len(state.delivered_by)
        self._demand(noted == state.delivered, f"{noted} noted for {state.delivered} deliveries")
        gone, left = (int((s.item_status == DELIVERED).sum()) for s in (state, before))
        # If `restock` changed during the step, either value may have held.
        restocks = self.world.scenario.restock, self._scenario.restock
        may_be = {left + (0 if restock else news) for restock in restocks}
        self._demand(gone in may_be, f"{gone} items have left for {state.delivered} deliveries")

    def _orders(self) -> None:
        """Check that requests and orders are conserved, and that none waits where it need not."""
        state, scenario = self.world.state, self.world.scenario
        orders, before = state.orders, self._before.orders
        n_open = int((state.open_requests != NOBODY).sum())
        n_gone = _unserved(state) - _unserved(self._before)
        # Where items do not come back, an item leaves with all requests for it.
        may_leave = not (scenario.restock and self._scenario.restock)
        self._demand(n_gone == 0 or (n_gone > 0 and may_leave), "a request is lost")
        asked = orders.open[:n_open, ASKED]
        self._demand(asked <= state.time + 1e-6, "something is asked for before its time")
        self._demand(orders.open[:n_open, CAME] <= asked + 1e-6, "asked for before it came")
        waits = orders.waiting[: orders.n_waiting.item()]
        self._demand(waits[:, CAME] <= state.time + 1e-6, "an order waits before it came")
        is_free = n_open < len(state.open_requests) and len(waits) > 0
        self._demand(not is_free, "an order waits though a request is free")
        if scenario.request_timeout is not None:
            longest = max(scenario.request_timeout, self._scenario.longest_request)
            self._demand(state.time - asked <= longest + 1e-6, "a request is open for too long")
        for name in ("n_asked", "n_put_back", "n_turned_away", "longest_queue", "n_listed"):
            is_less = getattr(orders, name) < getattr(before, name)
            self._demand(~is_less, f"{name} fell")

    def _handling(self) -> None:
        """Check that who handles an item stands, and that nobody else lifts it."""
        state, before = self.world.state, self._before
        kind, item, _ = state.robots.handling.T
        lifted = item[kind == LIFTING]
        self._demand(len(np.unique(lifted)) == len(lifted), "two robots lift one item")
        is_stored = state.item_status[lifted] == STORED
        self._demand(is_stored, "an item is being lifted and is not stored")
        stood = (before.robots.handling[:, 0] != IDLE) & state.robot_present
        is_still = state.robot_heading == before.robot_heading
        self._demand(~stood | is_still, "a robot turns while it handles an item")

    def _cover(self) -> None:
        """Note which items are no obstacles: (I,), by the rule and not by what the world says.

        Those that were put where they are, and those that a robot stood above when it took
        another; until a step begins with no laden robot above.
        """
        state, before = self.world.state, self._before
        self._covered &= self._above(before, before.robot_item != NOBODY)
        # Those too that delivered at once what they took.
        took = self._took() | (self._delivered() & (before.robot_item == NOBODY))
        put = (before.item_status != STORED) | (state.item_position != before.item_position).any(1)
        self._covered |= put | self._above(state, took)
        if (before.robot_present & ~state.robot_present).any():
            # It is no longer known where they were when they took something.
            self._covered |= state.item_covered == 1
        self._covered &= state.item_status == STORED
        self._demand(self._covered == state.item_covered, "an item is covered, or is not")

    def _took(self) -> Any:
        """Return which robots have an item that they had not before the step."""
        item = self.world.state.robot_item
        return (item != self._before.robot_item) & (item != NOBODY)

    def _delivered(self) -> Flags:
        """Return which robots delivered in the step."""
        state = self.world.state
        return np.isin(np.arange(state.n_robots), state.delivered_by[self._before.delivered :])

    def _above(self, state: WarehouseState, laden: Flags) -> Flags:
        """Return which items have a robot that is `laden` above them, (I,)."""
        reach = state.robot_radius[:, None] + self.world.scenario.item_radius
        away = _distances(state.robot_position, state.item_position)
        return np.asarray(np.any(laden[:, None] & (away < reach), axis=0))

    def _bodies(self) -> None:
        scenario, state = self.world.scenario, self.world.state
        present, at, radius = state.robot_present, state.robot_position, state.robot_radius[:, None]
        in_robots = radius + radius.T - _distances(at, at)
        in_robots[~(present[:, None] & present[None]) | np.eye(len(at), dtype=bool)] = -np.inf
        to_obstacles = _distances(at, state.obstacle_position)
        to_walls = np.hstack([at, self._far - at])
        in_items = radius + scenario.item_radius - _distances(at, state.item_position)
        solid = (state.item_status == STORED) & ~self._covered
        in_items[~((state.robot_item != NOBODY)[:, None] & solid)] = -np.inf
        in_obstacles = radius + scenario.obstacle_radius - to_obstacles
        in_racks = radius - self._to_racks(at)
        depths = [in_robots, in_obstacles, radius - to_walls, in_racks, in_items]
        self.depth = depth = np.hstack(depths)
        depth[~present] = -np.inf
        # The speed of the last step is that before or after a change.
        fastest = max(self._scenario.max_speed, scenario.max_speed)
        closing = 2.0 * fastest * scenario.physics_period
        deepest = float(depth.max(initial=-np.inf))
        self._demand(
            deepest <= closing + SUSTAINED,
            f"bodies overlap by {deepest:.4f} m: should be at most {closing:.4f} m, what they "
            "close in one substep, beyond the depth of a jam",
        )
        self._demand(to_walls[present] > 0.0, "a robot is outside the walls")
        self._demand(self.world.floor.is_free(at[present]), "a robot is inside a rack")
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

    def _to_racks(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far each robot's centre is from each solid cell of the plan [m], (N, M)."""
        plan = self.world.scenario.plan
        if plan is None:
            return np.zeros((len(at), 0))
        low = np.argwhere(plan.kind <= RACK)[:, ::-1] * plan.cell_size
        nearest = np.clip(at[:, None], low, low + plan.cell_size)
        return np.asarray(np.linalg.norm(at[:, None] - nearest, axis=2))

    def _timers(self) -> None:
        state, limit = self.world.state, self.world.scenario.timer_limit
        for name in ("robot_timer", "robot_told", "robot_heard"):
            timer = getattr(state, name)
            is_within = np.isnan(timer) | ((timer >= 0.0) & (timer < limit))
            self._demand(is_within, f"{name} leaves [0, {limit:g})")

    def _exercised(self) -> None:
        """Check that nobody has what its modes take."""
        state, scenario, rows = self.world.state, self.world.scenario, self.world.observe()
        present, modes = state.robot_present, state.failure_modes
        self._each(_lack(modes, "present"), ~present, "robot {}, removed, is there")
        self._each(~present, ~rows.any(axis=1), "robot {} is gone and senses")
        self._each(~present, state.robot_item == NOBODY, "robot {} is gone and carries")
        self._each(~present, np.isnan(state.robot_told), "robot {} tells, gone")
        lies = present & _lack(modes, "honest")
        self._each(lies, state.robot_told == 0.0, "robot {} is in FM1, tells no 0")
        if scenario.ranger_noise == 0.0:
            scans = rows[:, : 3 * row.N_BEAMS]
            sees_nothing = (scans == np.float32(scenario.ranger_range)).all(axis=1)
            blind = present & _lack(modes, "rangers") & ~_lack(modes, "rangers_refresh")
            self._each(blind, sees_nothing, "robot {}'s blind rangers see")
        items = rows[:, row.ITEMS : row.NEIGHBOURS : len(row.ITEM_FEATURES)]
        unseeing = present & _lack(modes, "view")
        self._each(unseeing, ~items.any(axis=1), "robot {} sees items without cameras")

    def _did(self) -> None:
        """Check that nobody did what its modes take: those before and after the step."""
        state, before = self.world.state, self._before
        present, modes, delivered = state.robot_present, _in_both(state, before), self._delivered()
        keeps_item = (before.robot_item == NOBODY) | (before.robot_item == state.robot_item)
        is_still = state.robot_heading == before.robot_heading
        self._each(_lack(modes, "lifts"), ~self._took(), "robot {} lifts items, and cannot")
        self._each(_lack(modes, "delivers"), ~delivered, "robot {} delivers, and cannot")
        stayed = present & before.robot_present
        self._each(stayed & _lack(modes, "speed"), is_still, "robot {} turns, and cannot")
        jammed = present & state.robot_in_delivery & _lack(modes, "releases_inside")
        self._each(jammed, keeps_item, "robot {}, jammed inside, lets its item go")
        # What cannot move may be above the delivery area's border when its item is asked for.
        dead = present & _lack(modes, "obeys")
        self._each(dead, keeps_item | delivered, "robot {} is dead and lets its item go")

    def _heard(self) -> None:
        state, timers = self.world.state, self.world.state.robot_told
        tells = state.robot_present & state.sends & ~np.isnan(timers)
        away = _distances(state.robot_position, state.robot_position)
        reached = (away**2 <= self.world.scenario.radio_range**2 * (1 + 1e-12)) & tells[None]
        np.fill_diagonal(reached, False)
        lowest = np.where(reached, timers[None], np.inf).min(axis=1, initial=np.inf)
        heard = np.where(np.isnan(state.robot_heard), np.inf, state.robot_heard)
        deaf = ~(state.hears & state.robot_present)
        self._demand(np.isinf(heard[deaf]), "a robot that does not hear has heard a timer")
        self._demand(heard >= lowest, "a timer was heard that no robot in range broadcasts")

    def _in_batteries_but_for_use(self) -> NDArray[np.float64]:
        """Return what each battery would hold had nothing been used or charged [J]."""
        batteries = self.world.state.batteries
        return batteries.energy + batteries.used - batteries.charged

    def _energy(self) -> None:
        state, before, batteries = self.world.state, self._before, self.world.state.batteries
        self._demand(batteries.energy >= 0.0, "a battery holds less than nothing")
        balance = self._in_batteries_but_for_use() - self._energy_at_start
        largest = 1e-9 * (1.0 + batteries.used + batteries.charged)
        self._demand(np.abs(balance) <= largest, "energy comes from nowhere or goes there")
        was_there = before.robot_present & state.robot_present
        empty = was_there & before.robot_is_empty
        is_still = state.robot_heading == before.robot_heading
        self._each(empty, is_still, "robot {} turns with an empty battery")
        self._each(empty, ~self._took(), "robot {} lifts with an empty battery")

    def _rows(self) -> None:
        rows, scenario = self.world.observe(), self.world.scenario
        low, high = row.bounds(scenario)
        present = self.world.state.robot_present
        fits = (rows[present] >= low) & (rows[present] <= high)
        names = [c.name for c in row.columns(scenario) if not fits[:, c.columns].all()]
        self._demand(not names, f"observations leave their ranges: {', '.join(names)}")
        first_flag = row.ITEMS + row.ITEM_FEATURES.index("requested")
        flags = rows[:, first_flag : row.NEIGHBOURS : len(row.ITEM_FEATURES)]
        self._demand(flags.sum(axis=1) <= scenario.n_open, "a robot sees too many requests")


def _distances(places: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far each is from each other one [m], (N, M)."""
    return np.asarray(np.linalg.norm(places[:, None] - points[None], axis=2))


def _in_both(state: WarehouseState, other: WarehouseState) -> Names:
    """Return the modes of each robot that it has in both states."""
    pairs = zip(state.failure_modes, other.failure_modes)
    return [[name for name in names if name in other_names] for names, other_names in pairs]


def _lack(modes: Names, what: str) -> Flags:
    """Return which robots have a mode that takes something, a field of `FailureMode`, wholly."""
    return np.array(
        [not all(getattr(failure_mode(name), what) for name in names) for names in modes], np.bool_
    )


def _unserved(state: WarehouseState) -> int:
    """Return how many requests are closed that were neither delivered nor put back."""
    n_open = int((state.open_requests != NOBODY).sum())
    return state.orders.n_asked.item() - n_open - state.delivered - state.orders.n_put_back.item()
