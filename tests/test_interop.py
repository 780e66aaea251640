"""Other people's wrappers and learners: `make interop-calls` has them installed."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import pytest

from swarm_logistics_env import Scenario, policies, swarm_logistics_v0
from swarm_logistics_env.adapters import CentralEnv
from swarm_logistics_env.wrappers import FaultInjection, FixedAgents, SwarmSize

N_ROBOTS, STEPS = 5, 20


def plain() -> Any:
    return swarm_logistics_v0.parallel_env(n_robots=N_ROBOTS, max_cycles=STEPS)


def both() -> Any:
    env = SwarmSize(plain(), [3, N_ROBOTS], leave=[(1, 1.0)])
    return FixedAgents(FaultInjection(env, "FM1", robots=2, onset=0.0))


EACH = pytest.mark.parametrize(
    "condition", [lambda: FaultInjection(plain(), "FM1", robots=2, onset=0.0), both]
)
pytestmark = pytest.mark.filterwarnings("default")  # theirs


@EACH
def test_torchrl_gets_what_the_specs_promise(condition: Any) -> None:
    envs = pytest.importorskip("torchrl.envs", reason="needs torchrl")
    utils = pytest.importorskip("torchrl.envs.utils")
    wrapped = envs.PettingZooWrapper(condition(), return_state=True)
    utils.check_env_specs(wrapped, seed=0)
    rollout = wrapped.rollout(5 * STEPS, break_when_any_done=False)
    assert rollout.batch_size == (5 * STEPS,)
    assert rollout["next", "done"].any()


@EACH
def test_supersuit_makes_vectors(condition: Any) -> None:
    supersuit = pytest.importorskip("supersuit", reason="needs supersuit")
    width = plain().observation_space("robot_0").shape[0]
    vector = supersuit.pettingzoo_env_to_vec_env_v1(condition())
    vector.reset(seed=0)
    for _ in range(2 * STEPS):
        rows, *_ = vector.step([vector.action_space.sample()] * vector.num_envs)
        assert rows.shape == (N_ROBOTS, width)


@pytest.mark.parametrize("central", [False, True])
@EACH
def test_rllib_trains(condition: Any, central: bool) -> None:
    ppo = pytest.importorskip("ray.rllib.algorithms.ppo", reason="needs ray[rllib]")
    pettingzoo_env = pytest.importorskip("ray.rllib.env.wrappers.pettingzoo_env")
    registry = pytest.importorskip("ray.tune.registry")

    def make(_: Any) -> Any:
        env = condition()
        return CentralEnv(env, flat=True) if central else pettingzoo_env.ParallelPettingZooEnv(env)

    registry.register_env("swarm", make)
    config = ppo.PPOConfig().environment("swarm").env_runners(num_env_runners=0)
    config = config.training(train_batch_size_per_learner=200, minibatch_size=100, num_epochs=1)
    if not central:
        config = config.multi_agent(policies={"robot"}, policy_mapping_fn=lambda *_, **__: "robot")
    algorithm = config.build_algo()
    assert algorithm.train()["env_runners"]["episode_len_mean"] == STEPS
    algorithm.stop()


def small_world() -> Any:
    pytest.importorskip("torch", reason="needs torch")
    return importlib.import_module("interop.small_world")


@pytest.mark.parametrize("name", ["small", "paper"])
def test_the_worlds_of_the_task_are_those_that_all_learn_in(name: str) -> None:
    yaml, shared = pytest.importorskip("yaml"), small_world()
    path = Path(shared.__file__).parent / "swarm_logistics" / f"{name}.yaml"
    fields = yaml.safe_load(path.read_text("utf-8"))
    assert fields.pop("rewards") == shared.REWARDS
    assert Scenario(**fields) == shared.WORLDS[name]


@pytest.mark.daily
@pytest.mark.parametrize(
    ("library", "module", "learner"),
    [
        ("stable_baselines3", "sb3_ppo", "sb3-ppo"),
        ("torchrl", "torchrl_ppo", "torchrl-ppo"),
        ("benchmarl", "benchmarl_ppo", "benchmarl-ippo"),
        ("benchmarl", "benchmarl_ppo", "benchmarl-mappo"),
    ],
)
def test_each_learner_learns_two_updates_and_writes_a_policy(
    library: str, module: str, learner: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(library)
    shared = small_world()
    monkeypatch.setattr(shared, "RESULTS", tmp_path)
    for name, value in {"SEEDS": range(1), "CURVE_SEEDS": range(1), "POINTS": 1}.items():
        monkeypatch.setattr(shared, name, value)
    points, tell = list[Any](), shared.Learning.tell

    def watched(learning: Any, agent_steps: int, tensors: Any) -> None:
        points.append(tensors())
        tell(learning, agent_steps, tensors)

    monkeypatch.setattr(shared.Learning, "tell", watched)
    learning = shared.Learning(learner, "small", 0, agent_steps=30_720)
    row = learning.end(importlib.import_module(f"interop.{module}").learn(learning))
    assert points[0]["layers.2.bias"].tolist() == pytest.approx([0.8, 0.0, 0.0], abs=1e-6)
    assert points[0]["deviations"].tolist() == pytest.approx([0.5] * 3, abs=1e-3)
    assert all((points[0][name] != points[-1][name]).any() for name in points[0])
    policy: Any = policies.load(str(tmp_path / f"{learner}-small@0.safetensors"))
    assert (policy.card.network.hidden, policy.card.agent_steps) == ((128, 64), 30_720)
    assert (len(row["P"]), list(row["P_F"])) == (1, list(shared.MODES))


def test_worlds_of_torchrl_end_and_begin_each_for_itself() -> None:
    utils = pytest.importorskip("torchrl.envs.utils", reason="needs torchrl")
    worlds = importlib.import_module("interop.torchrl_worlds").TorchRLWorlds
    sizes = iter([20, 30] * 2)

    def make() -> Any:
        env = swarm_logistics_v0.parallel_env(n_robots=3, max_cycles=next(sizes))
        return FaultInjection(env, "removed", robots=1, onset=0.5)

    utils.check_env_specs(worlds(make, [0, 1]))
    done = worlds(make, [0, 1]).rollout(65, break_when_any_done=False)["next", "done"][..., 0]
    assert [where.nonzero().flatten().tolist() for where in done] == [[19, 39, 59], [29, 59]]


def test_one_more_training_stands_beside_its_prediction() -> None:
    small_world()
    table = importlib.import_module("interop.__main__")
    rows = [{"seed": seed, "P": [p, p + 2.0]} for seed, p in enumerate([40.0, 44.0, 42.0, 60.0])]
    assert table.each_training(rows[:3]) == "41.0, 45.0, 43.0"
    assert table.each_training(rows).endswith("; seed 3: 61.0, predicted 43.0 [33.1, 52.9]")
    assert table.is_clear([40.0, 44.0, 42.0] * 4, [20.0, 30.0, 22.0] * 4)
    assert not table.is_clear([22.0, 28.0, 22.0] * 4, [20.0, 30.0, 22.0] * 4)
