from __future__ import annotations

import hashlib
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from swarm_logistics_env import Scenario, Warehouse
from swarm_logistics_env.core.errors import SetupError, TrainingError
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.reward_terms import REWARD_TERMS, STOCK_DISTANCE
from swarm_logistics_env.environment.rewards import RewardTerms
from swarm_logistics_env.policies import load
from swarm_logistics_env.policies.policy import decide, start
from swarm_logistics_env.train import load_training
from swarm_logistics_env.world.warehouse.structs import CARRIED, DELIVERED, DUE, NOBODY, STORED

STORAGE = 8.0  # [m], its width


@pytest.fixture
def world() -> Warehouse:
    """A world of four robots whose state the tests change by hand, as a step would."""
    made = Warehouse(Scenario(n_robots=4, n_items=6))
    made.reset(0)
    made.state.open_requests[0] = 2
    return made


def give(world: Warehouse, robot: int, item: int) -> None:
    world.state.robot_item[robot] = item
    world.state.item_carrier[item], world.state.item_status[item] = robot, CARRIED


def put_down(world: Warehouse, robot: int) -> None:
    item = world.state.robot_item[robot]
    world.state.robot_item[robot] = NOBODY
    world.state.item_carrier[item], world.state.item_status[item] = NOBODY, STORED


def deliver(world: Warehouse, robot: int, next_request: int, due: float = math.inf) -> None:
    put_down(world, robot)
    world.state.item_status[world.state.requested] = DELIVERED
    claims = world._world.claims
    (n_delivered,) = world._world.outcome.n_delivered
    claims.delivered_by[n_delivered] = robot
    claims.delivered[n_delivered, DUE] = due
    world._world.outcome.n_delivered[0] += 1
    world.state.open_requests[0] = next_request


Act = tuple[Any, ...]  # a change of the world by hand, and what it pays
NOTHING = [0.0] * 4


def to(world: Warehouse, robot: int, x: float, y: float) -> None:
    world.state.robot_position[robot] = [x, y]


def lay(world: Warehouse, item: int, x: float, y: float) -> None:
    world.state.item_position[item] = [x, y]


def at_robot(world: Warehouse, item: int, robot: int) -> None:
    world.state.item_position[item] = world.state.robot_position[robot]


def disable(world: Warehouse, robot: int) -> None:
    world.state.delivers[robot] = world.state.lifts[robot] = False


def touch(world: Warehouse, *robots: int) -> None:
    world.state.robot_contact[:] = np.isin(range(4), robots)


# Weights; what happens before the episode; and what each change after it pays.
PAYS: dict[str, tuple[dict[str, float] | None, list[Act], list[tuple[list[Act], list[float]]]]] = {
    "nobody without terms": ({}, [(give, 1, 2)], [([(deliver, 1, 3), (touch, 0)], NOTHING)]),
    "everybody for each delivery by default": (None, [(give, 1, 2)], [
        ([], NOTHING), ([(deliver, 1, 3)], [1.0] * 4), ([], NOTHING)]),
    "own_delivery the deliverers, of two in one step": (
        {"own_delivery": 2.0}, [(give, 1, 2), (give, 3, 4)], [
        ([(deliver, 1, 4), (deliver, 3, 0)], [0.0, 2.0, 0.0, 2.0]), ([], NOTHING)]),
    "on_time everybody for each delivery that is not late": ({"on_time": 2.0}, [(give, 1, 2)], [
        ([(deliver, 1, 4, -0.1), (deliver, 3, 0), (deliver, 1, 2, 0.0)], [4.0] * 4),
        ([(deliver, 1, 4, -0.1)], NOTHING)]),
    "lift_requested for taking up, and fines letting go": ({"lift_requested": 1.0}, [], [
        ([(give, 0, 5)], NOTHING), ([(give, 1, 2)], [0.0, 1.0, 0.0, 0.0]), ([], NOTHING),
        ([(put_down, 1)], [0.0, -1.0, 0.0, 0.0])]),
    "lift_requested both when an item changes hands": ({"lift_requested": 1.0}, [(give, 1, 2)], [
        ([(put_down, 1), (give, 3, 2)], [0.0, -1.0, 0.0, 1.0])]),
    "no fine for a delivery": ({"lift_requested": 1.0}, [(give, 1, 2)], [
        ([(deliver, 1, 3)], NOTHING)]),
    "nor when the same item is asked for again": ({"lift_requested": 1.0}, [(give, 1, 2)], [
        ([(deliver, 1, 2)], NOTHING)]),
    "nor for a lift before the request": ({"lift_requested": 1.0}, [(give, 1, 2)], [
        ([(give, 0, 5), (deliver, 1, 5)], NOTHING)]),
    "approach the carrier's metres up to the area": (
        {"approach": 10.0}, [(give, 1, 2), (to, 1, 3.0, 5.0), (to, 0, 1.0, 1.0)], [
        ([(to, 1, 3.2, 1.0), (to, 0, 2.0, 1.0)], [0.0, 2.0, 0.0, 0.0]),
        ([(to, 1, 2.9, 1.0)], [0.0, -3.0, 0.0, 0.0]),
        ([(to, 1, STORAGE + 1.0, 1.0)], [0.0, 51.0, 0.0, 0.0]),
        ([(to, 1, STORAGE + 0.2, 1.0)], NOTHING)]),
    "no way inside of the area": (
        {"approach": 1.0},
        [(give, 1, 2), (to, 1, STORAGE + 0.2, 5.0)], [([(to, 1, STORAGE + 1.5, 5.0)], NOTHING)]),
    "approach nothing for a change of item or carrier": ({"approach": 1.0}, [(give, 1, 2)], [
        ([(put_down, 1), (give, 3, 2)], NOTHING), ([(give, 0, 5), (deliver, 3, 5)], NOTHING)]),
    "no stocking of what comes back after its delivery": ({"stocking": 1.0}, [(give, 1, 2)], [
        ([(deliver, 1, 3), (lay, 2, 0.5, 0.5)], NOTHING)]),
    "blocked_request its seconds while one holds it that cannot deliver": (
        {"blocked_request": -1.0}, [(disable, 1)], [
        ([(give, 1, 3)], NOTHING), ([(put_down, 1), (give, 0, 2)], NOTHING),
        ([(put_down, 0), (give, 1, 2)], [0.0, -0.1, 0.0, 0.0])]),
    "blocked_request 2 s a metre into the area, which the way out gives back": (
        {"blocked_request": -1.0}, [(disable, 1), (give, 1, 2), (to, 1, STORAGE - 1.0, 1.0)], [
        ([(to, 1, STORAGE + 0.5, 1.0)], [0.0, -1.1, 0.0, 0.0]),
        ([(to, 1, STORAGE - 1.0, 1.0)], [0.0, 0.9, 0.0, 0.0])]),
    "held_inside for what nobody asks for, until it leaves or is let go": (
        {"held_inside": 1.0}, [(give, 1, 3), (lay, 3, STORAGE - 0.1, 1.0)], [
        ([(lay, 3, STORAGE + 0.1, 1.0)], [0.0, 1.0, 0.0, 0.0]), ([], NOTHING),
        ([(lay, 3, STORAGE - 0.1, 1.0)], [0.0, -1.0, 0.0, 0.0]),
        ([(lay, 3, STORAGE + 0.1, 1.0)], [0.0, 1.0, 0.0, 0.0]),
        ([(put_down, 1), (give, 2, 3)], [0.0, -1.0, 1.0, 0.0])]),
    "nothing more once that is asked for": (
        {"held_inside": 1.0}, [(give, 1, 3), (lay, 3, STORAGE + 0.1, 1.0)], [
        ([(deliver, 0, 3)], NOTHING), ([(deliver, 1, 4), (lay, 3, 1.0, 1.0)], NOTHING)]),
    "nothing for a lift or its end to one that cannot deliver": (
        {"lift_requested": 1.0}, [(disable, 1)], [
        ([(give, 1, 2)], NOTHING), ([(put_down, 1)], NOTHING)]),
    "contact its seconds": ({"contact": -1.0}, [], [([(touch, 0, 3)], [-0.1, 0.0, 0.0, -0.1])]),
    "the weighed sum of terms": (
        {"delivery": 0.5, "own_delivery": 2.0, "contact": -10.0}, [(give, 1, 2)], [
        ([(touch, 0), (deliver, 1, 3)], [-0.5, 2.5, 0.5, 0.5])]),
    "by every term after the last delivery": (dict.fromkeys(REWARD_TERMS, 1.0), [(give, 1, 2)], [
        ([(touch,), (deliver, 1, NOBODY)], [2.0, 3.0, 2.0, 2.0]), ([], NOTHING)]),
}  # fmt: skip


@pytest.mark.parametrize("case", PAYS)
def test_it_pays(world: Warehouse, case: str) -> None:
    weights, before, changes = PAYS[case]
    for act, *arguments in before:
        act(world, *arguments)
    terms = RewardTerms(weights)
    terms.begin(world)
    for acts, paid in changes:
        world._world.outcome.n_delivered[0] = 0
        for act, *arguments in acts:
            act(world, *arguments)
        assert terms.pay(world).tolist() == pytest.approx(paid)


def test_stocking_pays_the_way_of_every_item_so_that_no_circle_earns() -> None:
    """Eight robots that drive at random take up items again and again."""
    world = Warehouse(Scenario(n_robots=8, n_items=12, warehouse_width=5.5, warehouse_height=3.0))
    world.reset(0)
    terms, state = RewardTerms({"stocking": 1.0}), world.state
    nearest = world.scenario.storage_width - STOCK_DISTANCE
    terms.begin(world)
    rng = np.random.default_rng(1)
    begun, total = state.item_position[:, 0].copy(), np.zeros(8)
    for _ in range(400):
        world.step(rng.uniform(-1.0, 1.0, (8, 4)))
        total += terms.pay(world)
    assert state.delivered == 0
    assert (total != 0.0).sum() > 4
    nearer = np.minimum(state.item_position[:, 0], nearest) - np.minimum(begun, nearest)
    assert total.sum() == pytest.approx(nearer.sum())


# With requests for the items 2 and 4: the weights, what was before, and what each change pays.
ALL_REQUESTS: dict[str, tuple[dict[str, float], list[Act], list[tuple[list[Act], list[float]]]]] = {
    "each lift and each end of it": ({"lift_requested": 1.0}, [(give, 0, 2)], [
        ([(give, 1, 4)], [0.0, 1.0, 0.0, 0.0]),
        ([(put_down, 0), (give, 2, 2), (put_down, 1)], [-1.0, -1.0, 1.0, 0.0])]),
    "a lift beside a delivery, which costs nothing": ({"lift_requested": 1.0}, [(give, 0, 2)], [
        ([(deliver, 0, 5), (give, 1, 4)], [0.0, 1.0, 0.0, 0.0])]),
    "the end of a lift beside a delivery": ({"lift_requested": 1.0}, [(give, 0, 2), (give, 1, 4)], [
        ([(deliver, 0, 5), (put_down, 1), (at_robot, 4, 1)], [0.0, -1.0, 0.0, 0.0])]),
    "nothing for what is delivered and asked for again": (
        {"lift_requested": 1.0}, [(give, 0, 2), (give, 1, 4)], [([(deliver, 0, 2)], NOTHING)]),
    "the way of every carrier": (
        {"approach": 1.0}, [(give, 0, 2), (give, 1, 4), (to, 0, 3.0, 1.0), (to, 1, 4.0, 1.0)], [
        ([(to, 0, 3.5, 1.0), (to, 1, 3.0, 1.0)], [0.5, -1.0, 0.0, 0.0]),
        ([(deliver, 0, 5), (to, 1, 3.2, 1.0)], [0.0, 0.2, 0.0, 0.0])]),
    "no way that was driven before the item was asked for": (
        {"approach": 1.0}, [(give, 0, 2), (give, 1, 5), (to, 1, 4.0, 1.0)], [
        ([(deliver, 0, 5), (to, 1, 4.5, 1.0)], NOTHING),
        ([(to, 1, 5.0, 1.0)], [0.0, 0.5, 0.0, 0.0])]),
    "for every request that is blocked": ({"blocked_request": -1.0}, [(disable, 3), (disable, 1)], [
        ([(give, 3, 4), (give, 1, 2)], [0.0, -0.1, 0.0, -0.1])]),
}  # fmt: skip


@pytest.mark.parametrize("case", ALL_REQUESTS)
def test_with_several_requests_it_pays(case: str) -> None:
    world = Warehouse(Scenario(n_robots=4, n_items=6, n_requests=2))
    world.reset(0)
    world.state.open_requests[:] = 2, 4
    weights, before, changes = ALL_REQUESTS[case]
    for act, *arguments in before:
        act(world, *arguments)
    terms = RewardTerms(weights)
    terms.begin(world)
    for acts, paid in changes:
        world._world.outcome.n_delivered[0] = 0
        for act, *arguments in acts:
            act(world, *arguments)
        assert terms.pay(world).tolist() == pytest.approx(paid)


def test_a_reward_of_ones_own_is_a_term_by_its_name(tmp_path: Path) -> None:
    file = tmp_path / "terms.py"
    file.write_text(
        "def moved(world, before, after):\n    return world.state.robot_velocity[:, 0]\n"
    )
    env = SwarmLogisticsEnv(n_robots=3, rewards={f"{file}:moved": 2.0, "delivery": 1.0})
    env.reset_arrays(0)
    _, rewards, *_ = env.step_arrays(np.tile([1.0, 0.0, 0.0, 0.0], (3, 1)))
    np.testing.assert_allclose(rewards, 2.0 * env.warehouse.state.robot_velocity[:, 0])
    again = pickle.loads(pickle.dumps(env))
    np.testing.assert_equal(again.step_arrays(np.ones((3, 4))), env.step_arrays(np.ones((3, 4))))
    for name, message in ((f"{file}:moves", "moves"), ("none.py:term", "cannot be imported")):
        with pytest.raises(SetupError, match=message):
            RewardTerms({name: 1.0})
    training = tmp_path / "training.toml"
    training.write_text(f"rewards = {{ '{file}:moved' = 1.0 }}\n")
    with pytest.raises(TrainingError, match=r"is code, which runs .* allowed by --t"):
        load_training(str(training))
    assert load_training(str(training), trust_code=True).rewards == {f"{file}:moved": 1.0}


# What each term paid in two played worlds when terms were written in numpy: digests of every bit.
AS_IN_NUMPY = {
    "delivery": "5a3788ecde94b3ee", "own_delivery": "78a65dcd6f31f5d4",
    "on_time": "3e07b377de94b3ee", "lift_requested": "6917a09046765144",
    "approach": "7c9a11b917969e3a", "stocking": "f6596a7128d8857c",
    "contact": "f3f2492c746aab5d", "collision": "c1451041662cc8ae",
    "blocked_request": "c2d56fa08699cfd7", "held_inside": "6ee653addd7c647b",
}  # fmt: skip


def test_other_rewards_are_paid_from_the_next_step_on_and_wrong_ones_change_nothing() -> None:
    size: Any = {"n_robots": 8, "warehouse_width": 3.0, "warehouse_height": 2.0, "n_items": 1}
    env, contact = (
        SwarmLogisticsEnv(**size, rewards=weights) for weights in (None, {"contact": -1.0})
    )
    for world in (env, contact):
        world.reset_arrays(0)
    commands = np.tile([1.0, 0.0, 0.1, 0.0], (8, 1))
    for step in range(30):
        paid, expected = (world.step_arrays(commands)[1] for world in (env, contact))
        assert paid.tolist() == (expected if step >= 10 else np.zeros(8)).tolist()
        if step == 9:
            env.change_rewards({"contact": -1.0})
            with pytest.raises(SetupError, match=r"rewards\['contact'\] = nan"):
                env.change_rewards({"contact": math.nan})
    assert expected.any()


def test_the_compiled_terms_pay_to_the_bit_what_they_paid_in_numpy() -> None:
    """With several requests, orders in time and late, docks that are named, and failures."""
    small = Scenario(
        n_robots=8, n_items=8, warehouse_width=6.0, warehouse_height=5.0, delivery_width=1.5,
        n_requests=3, restock=True, orders="poisson", order_rate=0.2, order_due=8.0,
    )  # fmt: skip
    docks = Scenario(n_robots=16, floor="two_docks", request_docks="random", n_requests=3)
    digests = dict.fromkeys(REWARD_TERMS, "")
    for scenario in (small, docks):
        world = Warehouse(scenario)
        observations = world.reset(0, ["FM4:2", "removed:1@20"])
        policy = load("swarm-dt-2026")
        start(policy, scenario, 0)
        rng = np.random.default_rng(0)
        terms = {name: RewardTerms({name: 1.0}) for name in REWARD_TERMS}
        paid = {name: hashlib.blake2b(digest_size=4) for name in REWARD_TERMS}
        for term in terms.values():
            term.begin(world)
        for _ in range(500):
            commands = decide(policy, observations, world.state)
            is_random = rng.random((scenario.n_robots, 1)) < 0.2
            drawn = rng.uniform(-1.0, 1.0, commands.shape)
            observations = world.step(np.where(is_random, drawn, commands))
            for name, term in terms.items():
                paid[name].update((term.pay(world) + 0.0).tobytes())
        for name in REWARD_TERMS:
            digests[name] += paid[name].hexdigest()
    assert digests == AS_IN_NUMPY
