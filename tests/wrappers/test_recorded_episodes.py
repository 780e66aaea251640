"""What an episode pays, tells and shows in each form of the environment, as recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from gymnasium.spaces import Discrete
from numpy.typing import NDArray

from swarm_logistics_env import Scenario, policies
from swarm_logistics_env.adapters.central_env import CentralEnv
from swarm_logistics_env.adapters.vector_env import SwarmRows
from swarm_logistics_env.environment.parallel_env import SwarmLogisticsEnv
from swarm_logistics_env.environment.reward_terms import REWARD_TERMS
from swarm_logistics_env.policies.policy import start
from swarm_logistics_env.wrappers import (
    DiscreteActions,
    FaultInjection,
    FixedAgents,
    IndicatorReward,
    MotionFrame,
    ParameterChange,
    RunningMeans,
    SwarmSize,
    Wrapper,
)
from swarm_logistics_env.wrappers.wrapper import Condition
from tests.conftest import Check

HALL = Scenario(
    n_robots=8, n_items=10, duration=40.0, warehouse_width=4, warehouse_height=4, restock=True
)
YARD = Scenario.preset("realistic").replace(
    n_robots=8, n_items=12, duration=40.0, warehouse_width=5, warehouse_height=5, restock=True
)
ORDERS = Scenario.preset("orders").replace(
    n_robots=8, n_items=12, duration=60.0, warehouse_width=5, warehouse_height=5, view_range=2.0
)
WEIGHTS = {term: 0.5**number for number, term in enumerate(REWARD_TERMS)}
Env = SwarmLogisticsEnv | Wrapper


def _plain(scenario: Scenario = HALL, **arguments: Any) -> SwarmLogisticsEnv:
    return SwarmLogisticsEnv(scenario, **arguments)


def _shrinking() -> Env:
    return FixedAgents(SwarmSize(_plain(), [8, 10], leave=[(2, 10.0), (1, 20.0)]))


def _slower() -> Env:
    env = ParameterChange(_plain(), "max_speed", [0.3, 0.4], at=[10.0, 15.0])
    return FaultInjection(env, "motor_slow", robots=2, onset=[5.0, 8.0], duration=9.0, factor=0.5)


def _paid(credit: Any, references: Any = None) -> Env:
    env = FaultInjection(_plain(), "dead", robots=2, onset=12.0)
    references = references or {Condition(8): 8.0, Condition(8, n_removed=2): 6.0}
    weights = {"FT": 2.0, "R": 3.0, "P": 0.1}
    return IndicatorReward(env, weights, references=references, credit=credit, own_reward=0.5)


FORMS: dict[str, Callable[[], Env]] = {
    **{term: lambda term=term: _plain(rewards={term: 1.0}) for term in REWARD_TERMS},  # type: ignore[misc]
    "all terms, realistic": lambda: _plain(YARD, rewards=WEIGHTS),
    "all terms, orders, FM4": lambda: _plain(ORDERS, rewards=WEIGHTS, faults=["FM4:3@5"]),
    "who leaves": _shrinking,
    "slower": _slower,
    "indicators for the team": lambda: _paid("team"),
    "indicators for who delivers": lambda: _paid("deliverer"),
    "more robots": lambda: IndicatorReward(SwarmSize(_plain(), 10), "S", references=8.0),
    "narrower": lambda: IndicatorReward(
        ParameterChange(_plain(), "delivery_width", 1.0, at=9.0), "A", references=8.0
    ),
    "motion": lambda: MotionFrame(_plain(YARD)),
    "numbers": lambda: DiscreteActions(_plain()),
    "motion by numbers": lambda: DiscreteActions(MotionFrame(_plain(YARD))),
}


def numbers(values: Any) -> str:
    return " ".join(f"{value:.5g}" for value in np.atleast_1d(values).astype(float).ravel() + 0.0)


def commands_for(env: Env) -> Callable[[NDArray[np.float32]], NDArray[Any]]:
    """Return `homing-stock` where rows are those of the sensors; else commands that are drawn."""
    space = env.action_space(env.possible_agents[0])
    row_width = SwarmLogisticsEnv(env.unwrapped.scenario).observation_space("robot_0").shape
    if env.observation_space(env.possible_agents[0]).shape == row_width and space.shape == (4,):
        policy = policies.load("homing-stock")
        start(policy, env.unwrapped.scenario, 3)
        policy.reset(len(env.possible_agents), 3)
        return lambda rows: policy.act(rows)
    generator = np.random.default_rng(3)
    if isinstance(space, Discrete):
        return lambda rows: generator.integers(space.n, size=len(rows))
    return lambda rows: generator.uniform(-1.0, 1.0, (len(rows), *(space.shape or ())))


def lines_of(env: Env) -> Iterator[str]:
    """Yield what two episodes pay in all and show in the mean, and what infos say at the end."""
    for seed in (1, 2):
        rows = env.reset_arrays(seed)
        decide = commands_for(env)
        sizes = np.zeros(rows.shape[1])
        payments = np.zeros(len(rows))
        n_steps = 0
        while env.agents:
            rows, rewards, *_ = env.step_arrays(decide(rows))
            payments = payments + rewards
            sizes += np.abs(rows).mean(axis=0)
            n_steps += 1
        yield f"{n_steps} steps, paid {numbers(payments)}"
        yield f"shown {numbers(sizes / n_steps)}"
        for name, value in sorted(env.robot_info.items()):
            yield f"{name} {numbers(value)}"


def lines_of_central() -> Iterator[str]:
    env = CentralEnv(SwarmSize(_plain(), 8, leave=[(2, 10.0)]))
    rows, _ = env.reset(seed=1)
    policy = policies.load("homing")
    start(policy, HALL, 3)
    payment = 0.0
    is_over = False
    while not is_over:
        rows, reward, is_done, is_late, info = env.step(policy.act(rows))
        payment += float(reward)
        is_over = is_done or is_late
    yield f"done {is_done}, late {is_late}, paid {numbers(payment)}, shown {numbers(np.abs(rows))}"
    yield from (f"{name} {numbers(value)}" for name, value in sorted(info.items()))


def lines_of_rows() -> Iterator[str]:
    """Yield what rows of worlds of two sizes are paid, over an end and a beginning."""
    for mode in ("NEXT_STEP", "SAME_STEP"):
        env = SwarmRows(3, HALL.replace(duration=20.0), n_robots=[4, 8], autoreset_mode=mode)
        rows, _ = env.reset(seed=1)
        generator = np.random.default_rng(2)
        total = np.zeros(len(rows))
        for _ in range(230):
            rows, rewards, ends, lates, infos = env.step(
                generator.uniform(-1.0, 1.0, (len(rows), 4))
            )
            total += rewards + 10 * ends + 100 * lates
        yield f"{mode}, paid, ends, lates {numbers(total)}, shown {numbers(np.abs(rows).mean(0))}"
        yield from (f"{name} {numbers(value)}" for name, value in sorted(infos.items()))


def test_episodes_are_as_recorded(check_recorded: Check) -> None:
    lines = [f"{form}: {line}" for form, make in FORMS.items() for line in lines_of(make())]
    learning = _paid("team", RunningMeans(window=3))
    lines += [f"running means: {line}" for _ in range(2) for line in lines_of(learning)]
    lines += [f"central: {line}" for line in lines_of_central()]
    lines += [f"rows: {line}" for line in lines_of_rows()]
    check_recorded("episodes.txt", lines)
