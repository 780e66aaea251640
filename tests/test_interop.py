"""Other people's wrappers, unchanged, around the environment: `make interop` has them installed.

TorchRL, SuperSuit and RLlib, each with robots that have failed from the start and with swarms whose
size changes between episodes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from swarm_logistics_env import swarm_logistics_v0
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.wrappers import FaultInjection, FixedAgents, SwarmSize

N_ROBOTS, STEPS = 5, 20


def plain() -> Any:
    return swarm_logistics_v0.parallel_env(n_robots=N_ROBOTS, max_cycles=STEPS)


def sizes() -> Any:
    return SwarmSize(plain(), [3, N_ROBOTS], leave=[(1, 1.0)])


CONDITIONS: dict[str, Callable[[], Any]] = {
    "faults": lambda: FaultInjection(plain(), "FM1", robots=2, onset=0.0),
    "sizes": lambda: FixedAgents(sizes()),
    "both": lambda: FixedAgents(FaultInjection(sizes(), "FM1", robots=2, onset=0.0)),
}
EACH = pytest.mark.parametrize("condition", CONDITIONS)
pytestmark = pytest.mark.filterwarnings("default")  # theirs


@EACH
def test_torchrl_gets_what_the_specs_promise(condition: str) -> None:
    envs = pytest.importorskip("torchrl.envs", reason="needs torchrl")
    utils = pytest.importorskip("torchrl.envs.utils")
    wrapped = envs.PettingZooWrapper(CONDITIONS[condition](), return_state=True)
    utils.check_env_specs(wrapped, seed=0)
    rollout = wrapped.rollout(5 * STEPS, break_when_any_done=False)
    assert rollout.batch_size == (5 * STEPS,)
    assert rollout["next", "done"].any()


@EACH
def test_supersuit_stacks_frames_and_makes_vectors(condition: str) -> None:
    supersuit = pytest.importorskip("supersuit", reason="needs supersuit")
    from pettingzoo.test import parallel_api_test

    width = plain().observation_space("robot_0").shape[0]
    stacked = supersuit.frame_stack_v1(plain(), 4)
    observations, _ = stacked.reset(seed=0)
    assert {row.shape for row in observations.values()} == {(4 * width,)}
    parallel_api_test(stacked, num_cycles=2 * STEPS)
    vector = supersuit.pettingzoo_env_to_vec_env_v1(CONDITIONS[condition]())
    vector.reset(seed=0)
    for _ in range(2 * STEPS):
        rows, *_ = vector.step([vector.action_space.sample()] * vector.num_envs)
        assert rows.shape == (N_ROBOTS, width)


@pytest.mark.parametrize("central", [False, True])
@EACH
def test_rllib_trains(condition: str, central: bool) -> None:
    ppo = pytest.importorskip("ray.rllib.algorithms.ppo", reason="needs ray[rllib]")
    pettingzoo_env = pytest.importorskip("ray.rllib.env.wrappers.pettingzoo_env")
    registry = pytest.importorskip("ray.tune.registry")

    def make(_: Any) -> Any:
        env = CONDITIONS[condition]()
        return CentralEnv(env, flat=True) if central else pettingzoo_env.ParallelPettingZooEnv(env)

    registry.register_env("swarm", make)
    config = ppo.PPOConfig().environment("swarm").env_runners(num_env_runners=0)
    config = config.training(train_batch_size_per_learner=200, minibatch_size=100, num_epochs=1)
    if not central:
        config = config.multi_agent(policies={"robot"}, policy_mapping_fn=lambda *_, **__: "robot")
    algorithm = config.build_algo()
    assert algorithm.train()["env_runners"]["episode_len_mean"] == STEPS
    algorithm.stop()
