"""What is sensed, against a slow and plain computation of the same."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from swarm_logistics_env import Fault, Scenario, Warehouse, policies
from swarm_logistics_env.world import observations as row
from swarm_logistics_env.world.warehouse.state import NOBODY, STORED

TOLERANCE = 2e-5  # [m]: rows are of single precision
BEAMS = np.exp(2j * np.pi * np.arange(row.N_BEAMS) / row.N_BEAMS)

FAULTS = (
    Fault("FM1", 2), Fault("FM3", (3,)), Fault("FM3_send", (4,)), Fault("FM3_hear", (5,)),
    Fault("view_reduced", (6, 7), factor=0.3), Fault("rangers_blind", (8,)), Fault("dead", (9,)),
    Fault("removed", (10,)), Fault("rangers_biased", (11,)),
)  # fmt: skip
WORLDS = {
    "tall": Scenario(
        n_robots=15, n_items=12, warehouse_width=2.2, warehouse_height=13.7, delivery_width=1.1,
        view_range=2.5, ranger_range=1.3,
    ),
    "wide": Scenario(
        n_robots=15, n_items=25, warehouse_width=17.3, warehouse_height=1.3, delivery_width=9.0,
        radio_range=2.1, n_obstacles=3, obstacle_radius=0.2,
    ),
    "crowded": Scenario(
        n_robots=40, n_items=40, warehouse_width=4.6, warehouse_height=3.4, delivery_width=1.0,
        n_obstacles=2, relay="gossip", timer_limit=3.0, memory_size=3, view_range=0.6,
    ),
    "of three sizes": Scenario(
        n_robots=30, n_items=25, warehouse_width=6.5, warehouse_height=4.0, delivery_width=1.0,
        n_obstacles=2, robot_radius=0.25,
    ).replace(
        robot_kinds="large, small:2 robot_radius=0.09, middling robot_radius=0.15 robot_mass=9.0",
    ),
    "short-sighted": Scenario(
        n_robots=20, n_items=20, warehouse_width=4, warehouse_height=3, ranger_range=0.05,
        view_range=0.1, radio_range=0.1, delivery_width=1.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WORLDS)
def test_rows_agree_with_a_plain_computation(name: str) -> None:
    scenario = WORLDS[name]
    world, policy = Warehouse(scenario), policies.load("swarm-dt")
    policy.reset(scenario.n_robots, 1)
    rng = np.random.default_rng(3)
    rows = world.reset(4, FAULTS)
    for step in range(48):
        commands = policy.act(rows)
        # All ways at once: turned, and crowding into the delivery area and its walls.
        commands[:, 2] = rng.uniform(-1.0, 1.0, scenario.n_robots)
        if step > 24:
            heading = world.state.robot_heading
            commands[:, 0], commands[:, 1] = np.cos(heading), -np.sin(heading)
        heading_before = world.state.robot_heading.copy()
        rows = world.step(commands)
        if step % 12 == 11:
            for me in range(scenario.n_robots):
                plain = Plain(world, me, heading_before[me]).row()
                np.testing.assert_allclose(rows[me], plain, atol=TOLERANCE, err_msg=str(me))


class Plain:
    """What a robot senses, with places in its own frame as complex numbers: forward + 1j left."""

    def __init__(self, world: Warehouse, me: int, heading_before: float) -> None:
        self.heading_before = heading_before
        self.state, self.scenario, self.me = world.state, world.scenario, me
        self.modes = [set(modes) for modes in world.state.failure_modes]
        is_other = world.state.robot_present.copy()
        is_other[me] = False
        self.others = np.flatnonzero(is_other)
        self.items = np.flatnonzero(world.state.item_status == STORED)

    def row(self) -> NDArray[np.float64]:
        if not self.state.robot_present[self.me]:
            return np.zeros(row.N_COLUMNS)
        blocks = (self.scans(), self.items_in_view(), self.robots_near(), self.itself())
        return np.concatenate([np.ravel(block) for block in blocks])

    def seen(self, positions: NDArray[np.float64]) -> NDArray[np.complex128]:
        away = (positions - self.state.robot_position[self.me]) @ np.array([1.0, 1j])
        return np.asarray(away * np.exp(-1j * self.state.robot_heading[self.me]))

    @property
    def view(self) -> float:
        share = 0.3 if "view_reduced" in self.modes[self.me] else 1.0
        return 0.0 if "dead" in self.modes[self.me] else self.scenario.view_range * share

    def scans(self) -> list[NDArray[np.float64]]:
        s, state = self.scenario, self.state
        to_obstacles = to_discs(self.seen(state.obstacle_position), s.obstacle_radius)
        scans = [
            to_discs(self.seen(state.robot_position[self.others]), state.robot_radius[self.others]),
            np.minimum(self.to_walls(), to_obstacles),
            to_discs(self.seen(state.item_position[self.items]), s.item_radius),
        ]
        modes = self.modes[self.me]
        shift = 99.0 * bool({"rangers_blind", "dead"} & modes) + 0.2 * ("rangers_biased" in modes)
        return [np.minimum(scan + shift, s.ranger_range) for scan in scans]

    def to_walls(self) -> NDArray[np.float64]:
        """Return how far each beam goes until it leaves the arena."""
        directions = BEAMS * np.exp(1j * self.state.robot_heading[self.me])
        nearest = np.full(row.N_BEAMS, np.inf)
        sides = (self.scenario.warehouse_width, self.scenario.warehouse_height)
        for at, along, side in zip(
            self.state.robot_position[self.me],
            (directions.real, directions.imag),
            sides,
            strict=True,
        ):
            far = np.where(along > 0.0, side, 0.0) - at
            nearest = np.minimum(nearest, np.where(np.abs(along) > 1e-12, far / along, np.inf))
        return np.asarray(np.maximum(nearest, 0.0))

    def items_in_view(self) -> NDArray[np.float64]:
        block, rank = np.zeros((row.N_ITEMS_IN_VIEW, 5)), 0
        away = self.seen(self.state.item_position[self.items])
        for index in np.argsort(abs(away))[: row.N_ITEMS_IN_VIEW]:
            if abs(away[index]) <= self.view:
                item = self.items[index]
                is_known = item in self.state.robot_memory[self.me]
                is_requested = item == self.state.requested
                block[rank] = 1, away[index].real, away[index].imag, is_requested, is_known
                rank += 1
        return block

    def robots_near(self) -> NDArray[np.float64]:
        """Return the neighbours, nearest first, and the teller of the lowest timer heard."""
        deaf, mute = {"FM3", "FM3_hear", "dead"}, {"FM3", "FM3_send", "dead"}
        block, rank, tellers = np.zeros((row.N_NEIGHBOURS, 5)), 0, []
        away = self.seen(self.state.robot_position[self.others])
        for index in np.argsort(abs(away)):
            other, x, y = self.others[index], away[index].real, away[index].imag
            is_mute = deaf & self.modes[self.me] or mute & self.modes[other]
            is_heard = abs(away[index]) <= self.scenario.radio_range and not is_mute
            timer = self.state.robot_told[other]
            tells = is_heard and not math.isnan(timer)
            if tells:
                tellers.append((timer, abs(away[index]), x, y))
            if (is_heard or abs(away[index]) <= self.view) and rank < row.N_NEIGHBOURS:
                block[rank] = 1, x, y, tells, timer if tells else self.scenario.timer_limit
                rank += 1
        timer, _, x, y = min(tellers, default=(0.0, 0.0, 0.0, 0.0))
        return np.array([*block.ravel(), bool(tellers), x, y, timer])

    def itself(self) -> list[float]:
        s, state, me = self.scenario, self.state, self.me
        item, timer, (x, _) = state.robot_item[me], state.robot_timer[me], state.robot_position[me]
        velocity = self.seen(state.robot_position[me] + state.robot_velocity[[me]])[0]
        limited = np.clip([velocity.real, velocity.imag], -s.max_speed, s.max_speed)
        runs, gap = not math.isnan(timer), self.gap()
        touches = state.robot_contact[me] if 0.001 < gap < 0.02 else gap < 0.01
        assert state.robot_contact[me] == touches
        turned = math.remainder(state.robot_heading[me] - self.heading_before, math.tau)
        turn_rate = turned / s.control_period - state.robot_heading_drift[me]
        return [
            item != NOBODY, item != NOBODY and item == state.requested, x >= s.storage_width, runs,
            timer if runs else s.timer_limit, *limited, touches,
            np.clip(turn_rate, -s.max_turn_rate, s.max_turn_rate),
        ]  # fmt: skip

    def gap(self) -> float:
        """Return the gap [m] to what is nearest of all that is solid to the robot."""
        s, state = self.scenario, self.state
        at = state.robot_position[self.me]
        gaps = [*at, *(np.array([s.warehouse_width, s.warehouse_height]) - at)]
        solid = self.items[state.item_covered[self.items] == 0]
        things: list[tuple[NDArray[np.float64], float | NDArray[np.float64]]] = [
            (state.robot_position[self.others], state.robot_radius[self.others]),
            (state.obstacle_position, s.obstacle_radius),
            (state.item_position[solid[: len(solid) * (state.robot_item[self.me] != NOBODY)]],
             s.item_radius),
        ]  # fmt: skip
        for positions, radius in things:
            gaps += (abs(self.seen(positions)) - radius).tolist()
        return float(min(gaps)) - float(state.robot_radius[self.me])


def to_discs(
    centres: NDArray[np.complex128], radius: float | NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how far each beam from the origin goes until it meets a disc: the quadratic's root."""
    along = (centres[:, None] * BEAMS.conj()).real
    root = along**2 - (abs(centres) ** 2 - radius**2)[:, None]
    met = np.where((root > 0.0) & (along > 0.0), along - np.sqrt(np.maximum(root, 0.0)), np.inf)
    met[abs(centres) <= radius] = 0.0
    return np.asarray(met.min(axis=0, initial=np.inf))
