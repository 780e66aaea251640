"""A slow reference of what faults leave, what is told, what is paid and how episodes end.

In plain Python from what the documentation says, robot by robot and in whole numbers of half
control periods, so that it shares no rounding and no shortcut with the package.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from swarm_logistics_env import Fault, Scenario, Warehouse
from swarm_logistics_env.compiler.kernels import pair_key, uniform
from swarm_logistics_env.core.streams import generator, row_keys
from swarm_logistics_env.world.warehouse.abilities import LOST_AS_A_WHOLE
from swarm_logistics_env.world.warehouse.failure_modes import failure_mode
from swarm_logistics_env.world.warehouse.faults import GRACE, failed_robots
from swarm_logistics_env.world.warehouse.state import NOBODY
from swarm_logistics_env.world.warehouse.state import WarehouseState as State

BLOCK = 32  # so many holds and breaks are of one stream

Able = dict[str, Any]  # what one robot can do


@dataclass
class Planned:
    """A fault in half control periods: it holds at step k if begins <= 2 k < ends."""

    mode: str
    robots: int | tuple[int, ...]
    begins: int
    ends: int | None = None
    factor: float | None = None
    breaks: tuple[float, float] | None = None
    role: str | None = None
    struck: list[int] | None = field(default=None, compare=False)

    def fault(self, period: float) -> Fault:
        """Return it as the package has it; its times are sums, with the rounding of sums."""
        onset = sum([0.5 * period] * self.begins)
        duration = None if self.ends is None else sum([0.5 * period] * self.ends) - onset
        return Fault(self.mode, self.robots, onset, duration, self.factor, self.breaks, self.role)

    def holds(self, step: int) -> bool:
        """Return whether it holds at a step, breaks included."""
        return self.begins <= 2 * step and (self.ends is None or 2 * step < self.ends)


class Faults:
    """What planned faults leave the robots of one world, step by step."""

    def __init__(self, scenario: Scenario, seed: int, planned: Sequence[Planned]) -> None:
        self._scenario, self._seed = scenario, seed
        self.gone = [False] * scenario.n_robots
        self.plan(planned)

    def change(self, scenario: Scenario) -> None:
        """Let these conditions hold from now on."""
        self._scenario = scenario

    def plan(self, planned: Sequence[Planned]) -> None:
        """Let these faults hold from now on; who is gone stays gone."""
        self._planned = list(planned)
        for fault in self._planned:
            fault.struck = None
            if isinstance(fault.robots, tuple):
                fault.struck = sorted(fault.robots)
            elif fault.role is None:  # whatever the mode, the seed chooses the same robots
                like = Fault("FM1", fault.robots)
                fault.struck = failed_robots(like, self._seed, self._scenario).tolist()

    def expected(self, world: Warehouse, before: State) -> list[Able]:
        """Return of each robot what it can do now, its modes and whether it is there."""
        now = world.state
        left = [self._sound(robot) for robot in range(self._scenario.n_robots)]
        for number, fault in enumerate(self._planned):
            if not fault.holds(now.step):
                continue
            if fault.struck is None:
                is_whole = now.robot_present.tolist() == before.robot_present.tolist()
                # All that begins at one moment strikes whom it would by itself.
                views = before.view_range.tolist()
                # Who is removed in this very step no longer stands where it was struck.
                chosen = world._occurrences[number].robots.tolist()
                fault.struck = self._in_role(fault, now, views) if is_whole else chosen
            for robot in fault.struck:
                if fault.breaks is None or self._is_broken(fault, robot, now.step):
                    self._take(fault, left[robot], now.step)
        for robot, able in enumerate(left):
            is_there = able.pop("there")
            returns = able.pop("returns")
            self.gone[robot] |= not (is_there or returns)
            able["present"] = is_there and not self.gone[robot]
        return left

    def _sound(self, robot: int) -> Able:
        s = self._scenario
        speed = s.speed_mix[robot % len(s.speed_mix)]
        sensing = s.sensing_mix[robot % len(s.sensing_mix)]
        body = s.of_robot(robot)
        return {
            "max_speed": body.max_speed * speed,
            "max_turn_rate": body.max_turn_rate * speed,
            "view_range": body.view_range * sensing,
            "ranger_range": body.ranger_range * sensing,
            "ranger_bias": 0.0,
            "radio_delay": 0,
            **dict.fromkeys(LOST_AS_A_WHOLE, True),
            "lifts": bool(s.of_robots("lifts")[robot]),
            "modes": (),
            "there": True,
            "returns": True,
        }

    def _take(self, fault: Planned, able: Able, step: int) -> None:
        """Take from a robot what a fault of its takes; several faults add up."""
        s, lost = self._scenario, failure_mode(fault.mode)
        speed, view = lost.speed, lost.view
        if fault.factor is not None:
            speed, view = (fault.factor, view) if lost.factor == "speed" else (speed, fault.factor)
        if lost.wears:  # linearly, from all at the onset
            begins = 0.5 * fault.begins * s.control_period
            share = (step * s.control_period - begins) / (s.duration - begins)
            speed = 1.0 - (1.0 - speed) * min(share, 1.0)
        able["max_speed"] *= speed
        able["max_turn_rate"] *= speed
        able["view_range"] *= view
        able["ranger_range"] *= 1.0 if lost.rangers else 0.0
        able["ranger_bias"] += lost.ranger_bias
        delay = round(lost.radio_delay / s.control_period)
        able["radio_delay"] = max(able["radio_delay"], delay)
        for name in LOST_AS_A_WHOLE:
            able[name] = able[name] and getattr(lost, name)
        able["modes"] = (*able["modes"], fault.mode)
        able["there"] = able["there"] and lost.present
        able["returns"] = able["returns"] and (lost.present or lost.returns)

    def _is_broken(self, fault: Planned, robot: int, step: int) -> bool:
        """Return whether an intermittent fault holds, by the robot's own stream of both times."""
        assert fault.breaks is not None
        period = self._scenario.control_period
        n_switches = 0
        until = 0.5 * period * fault.begins
        while until <= step * period + GRACE:
            if n_switches % BLOCK == 0:
                block = n_switches // BLOCK
                rng = generator(self._seed, f"intermittent {fault.mode}", robot, block)
            until += rng.exponential(fault.breaks[n_switches % 2])
            n_switches += 1
        return n_switches % 2 == 1

    def _in_role(self, fault: Planned, now: State, views: list[float]) -> list[int]:
        """Return the robots that a fault by role strikes: those in it, then those nearest."""
        items = _asked(now)
        carriers = [now.item_carrier[item] for item in items if now.item_carrier[item] != NOBODY]

        def away(robot: int) -> float:
            position = now.robot_position[robot]
            return min(
                (math.dist(position, now.item_position[item]) for item in items), default=0.0
            )

        def role(robot: int) -> str:
            if robot in carriers:
                return "carrier"
            position = now.robot_position[robot]
            if any(math.dist(position, now.robot_position[c]) <= views[c] for c in carriers):
                return "neighbour"
            if now.robot_in_delivery[robot]:
                return "in_area"
            return "searching" if now.robot_item[robot] == NOBODY else "shuffling"

        ranked = sorted(
            range(now.n_robots),
            key=lambda r: (not now.robot_present[r], role(r) != fault.role, away(r), r),
        )
        assert isinstance(fault.robots, int)
        return sorted(ranked[: fault.robots])


class Radio:
    """What each robot broadcasts: its timer, late and untrue as its faults make it; messages."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self._scenario = scenario
        self._keys = row_keys(seed, "sensors", scenario.n_robots)
        self._last_inside: dict[int, int] = {}
        self._own: list[list[float]] = []  # by step and robot, before delays and lies
        self._given = [[[0.0] * scenario.message_size] * scenario.n_robots]

    def told(self, now: State, before: State, able: list[Able]) -> list[float]:
        """Return the timer that each robot tells [s], NaN: none; to be asked once a step."""
        s, timers, own_timers = self._scenario, [], list[float]()
        self._own.append(own_timers)
        limit, period = s.timer_limit - 1e-9, s.control_period
        for robot, can in enumerate(able):
            if can["present"] and not before.robot_present[robot]:
                self._last_inside.pop(robot, None)  # who comes back begins anew
            if now.robot_in_delivery[robot]:
                self._last_inside[robot] = now.step
            timer = math.nan
            if can["present"] and robot in self._last_inside:
                timer = (now.step - self._last_inside[robot]) * period
            passes_on = s.is_gossip and can["present"]
            heard = before.robot_heard[robot] + period if passes_on else math.nan
            own_timers.append(min((t for t in (timer, heard) if t < limit), default=math.nan))
            then = now.step - can["radio_delay"]
            late = self._own[then][robot] if then >= 0 else math.nan
            late = late if late < limit else math.nan
            timers.append((late if can["honest"] else 0.0) if can["present"] else math.nan)
        return timers

    def messages(self, commands: Sequence[Sequence[float]], able: list[Able]) -> list[list[float]]:
        """Return the message of each robot after a step; what it could do as the step began."""
        step = len(self._given)
        self._given.append(
            [
                self._message(robot, step, command, able[robot])
                for robot, command in enumerate(commands)
            ]
        )
        return [
            self._given[max(step - can["radio_delay"], 0)][robot] for robot, can in enumerate(able)
        ]

    def _message(self, robot: int, step: int, command: Sequence[float], can: Able) -> list[float]:
        """Return what a robot hands its channel, which may have failed, before it comes late."""
        size = self._scenario.message_size
        if not (can["present"] and can["obeys"]):
            return [0.0] * size
        if not can["messages_refresh"]:
            return self._given[-1][robot]
        if not can["messages_mean"]:
            key = self._keys[robot]
            n = self._scenario.n_robots
            streams = [np.uint64(pair_key(key, n + part)) for part in range(size)]
            return [2.0 * uniform(stream, step) - 1.0 for stream in streams]
        sign = 1.0 if can["messages_true"] else -1.0
        return [sign * min(max(word, -1.0), 1.0) for word in command[4:]]


def rewards(
    weights: Mapping[str, float], scenario: Scenario, before: State, now: State
) -> list[float]:
    """Return what a step pays each robot that was there as it began."""
    period, edge, total = scenario.control_period, scenario.storage_width, []
    new = now.delivered_by[len(before.delivered_by) :]
    nearest = edge - 1.5  # what is stocked nearer would be in the way
    requested = _asked(before) & _asked(now)  # what a step takes up, brings nearer or lets go of
    for robot in range(now.n_robots):
        x, x_before = (moment.robot_position[robot, 0] for moment in (now, before))
        was, is_ = (moment.robot_item[robot] for moment in (before, now))
        carries_on = is_ in requested and is_ == was
        lifts = is_ in requested and is_ != was
        lies = was in requested and now.item_carrier[was] == NOBODY and new
        # What was delivered and is asked for again lies elsewhere than its carrier stands.
        is_back = lies and list(now.item_position[was]) != list(now.robot_position[robot])
        drops = was in requested and is_ != was and not is_back
        stocked = 0.0
        for item, after in enumerate(now.item_carrier):
            who = before.item_carrier[item] if after == NOBODY else after
            is_delivered = before.item_carrier[item] != NOBODY and before.item_carrier[item] in new
            if who == robot and not is_delivered:
                stocked += min(now.item_position[item, 0], nearest)
                stocked -= min(before.item_position[item, 0], nearest)
        held, was_held = (_held_inside(moment, robot, edge) for moment in (now, before))
        delivers = now.delivers[robot]
        deeper = 2.0 * (max(x, edge) - max(x_before, edge)) if carries_on else 0.0
        nearer = min(x, edge) - min(x_before, edge) if carries_on else 0.0
        terms = {
            "delivery": len(new),
            "own_delivery": new.count(robot),
            "on_time": len(new),  # nothing is due in its worlds
            "lift_requested": (int(lifts) - int(drops)) * delivers,
            "approach": nearer,
            "stocking": stocked,
            "contact": period * now.robot_contact[robot],
            "collision": _closing(scenario, before, now, robot),
            "blocked_request": (period + deeper) * (is_ in _asked(now) and not delivers),
            "held_inside": len(held - was_held - _asked(now))
            - len(was_held - held - _asked(before) - _asked(now)) * (robot not in new),
        }
        paid = sum(weights.get(name, 0.0) * value for name, value in terms.items())
        total.append(paid if before.robot_present[robot] else 0.0)
    return total


def _held_inside(moment: State, robot: int, edge: float) -> set[int]:
    """Return the item that a robot holds in the delivery area, if any."""
    item = moment.robot_item[robot]
    return {item} if item != NOBODY and moment.item_position[item, 0] >= edge else set()


def _closing(scenario: Scenario, before: State, now: State, robot: int) -> float:
    """Return how fast [m/s] a robot ran into others that it touches now and did not before."""
    total = 0.0
    for other in range(now.n_robots):
        if other == robot or not (now.robot_present[robot] and now.robot_present[other]):
            continue
        gap, gap_before = (
            moment.robot_position[other] - moment.robot_position[robot] for moment in (now, before)
        )
        distance, distance_before = math.hypot(*gap), math.hypot(*gap_before)
        apart = scenario.of_robot(robot).robot_radius + scenario.of_robot(other).robot_radius
        if distance < apart <= distance_before:
            rate = before.robot_velocity[other] - before.robot_velocity[robot]
            total += max(0.0, -float(gap_before @ rate) / distance_before)
    return total


def _asked(moment: State) -> set[int]:
    """Return the items that requests are open for."""
    return set(moment.open_requests.tolist()) - {NOBODY}


def ends(before: State, now: State, last_step: int) -> tuple[list[bool], list[bool]]:
    """Return which robots terminate and which are truncated; none does both."""
    is_all, is_late = now.requested == NOBODY, now.step >= last_step
    were, are = before.in_episode.tolist(), now.in_episode.tolist()
    terminated = [was and (is_all or not is_) for was, is_ in zip(were, are)]
    truncated = [is_late and was and not t for was, t in zip(were, terminated)]
    return terminated, truncated
