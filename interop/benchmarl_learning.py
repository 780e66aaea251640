"""BenchMARL goes on from the shipped network, and is judged beside Swarm D-T on the same seeds.

python -m interop.benchmarl_learning

The warehouse of the paper, with 10 robots that read and command in the frame of their motion. It
shows that BenchMARL plays and trains the network, not that BenchMARL learned to win from nothing.
"""

from __future__ import annotations

import tempfile
import time
from typing import Any

import numpy as np
import torch
from benchmarl.algorithms import IppoConfig
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from torchrl.envs.utils import ExplorationType, set_exploration_type

from interop.torchrl_worlds import TorchRLWorlds
from swarm_logistics_env import Scenario, policies, run_episode, swarm_logistics_v0
from swarm_logistics_env.motion import INPUTS
from swarm_logistics_env.wrappers import MotionFrame

SCENARIO = Scenario(n_robots=10, restock=True, duration=200.0)
START: Any = policies.load("ppo-delivery")
READ = [INPUTS.index(name) for name in START.card.network.inputs]
REWARDS = {"own_delivery": 1.0, "lift_requested": 0.5, "approach": 0.1, "contact": -0.05}
WORLDS, STEPS, ITERATIONS = 8, 125, 4
SEEDS = range(10_000, 10_010)  # nothing was learned on them


class WorldsTask(PettingZooClass):  # type: ignore[misc]  # BenchMARL is not in the gate
    """The warehouse as a batch of worlds, as BenchMARL has it of vectorised simulators."""

    def get_env_fun(self, num_envs: int, continuous_actions: bool, seed: Any, device: Any) -> Any:
        """Return a maker of that many worlds."""
        return lambda: TorchRLWorlds(make, range(seed, seed + num_envs))

    def supports_continuous_actions(self) -> bool:
        """Return True."""
        return True

    def supports_discrete_actions(self) -> bool:
        """Return False."""
        return False

    def has_state(self) -> bool:
        """Return False."""
        return False

    def has_render(self, env: Any) -> bool:
        """Return False."""
        return False

    def max_steps(self, env: Any) -> int:
        """Return the length of an episode."""
        return SCENARIO.n_steps

    @staticmethod
    def env_name() -> str:
        """Return the name."""
        return "swarm_logistics"

    def observation_spec(self, env: TorchRLWorlds) -> Any:
        """Return the observations of one world."""
        return env.full_observation_spec_unbatched

    def action_spec(self, env: TorchRLWorlds) -> Any:
        """Return the actions of one world."""
        return env.full_action_spec_unbatched

    def info_spec(self, env: TorchRLWorlds) -> None:
        """Return None: there is no more to tell."""

    def state_spec(self, env: TorchRLWorlds) -> None:
        """Return None, as above."""

    def action_mask_spec(self, env: TorchRLWorlds) -> None:
        """Return None: a robot may do everything at any time."""


def main() -> None:
    """Learn for a few iterations, then play ten seeds with both."""
    torch.set_num_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        experiment = prepared(folder)
        began = time.perf_counter()
        experiment.run()
        minutes = (time.perf_counter() - began) / 60
    learned = played(experiment.policy)
    swarm_dt = policies.load("swarm-dt")
    scripted = [run_episode(SCENARIO, swarm_dt, seed).delivered for seed in SEEDS]
    differences = np.subtract(learned, scripted)
    error = differences.std(ddof=1) / len(SEEDS) ** 0.5
    assert differences.mean() > 2.262 * error, (learned, scripted)  # the 95 % interval, 9 d.o.f.
    print(
        f"IPPO goes on from ppo-delivery, 10 robots, {experiment.total_frames * 10:,} agent-steps, "
        f"{minutes:.1f} minutes, P on {len(SEEDS)} new seeds {np.mean(learned):.1f}, of Swarm D-T "
        f"{np.mean(scripted):.1f}, difference {differences.mean():.1f} +- {2.262 * error:.1f}"
    )


def make() -> MotionFrame:
    """Return the environment to learn in."""
    return MotionFrame(swarm_logistics_v0.parallel_env(SCENARIO, rewards=REWARDS))


def prepared(folder: str) -> Experiment:
    """Return the experiment: independent PPO with one network for all robots."""
    config = ExperimentConfig.get_from_yaml()
    config.save_folder, config.create_json, config.loggers = folder, False, []
    config.max_n_frames, config.max_n_iters = None, ITERATIONS
    config.on_policy_collected_frames_per_batch = WORLDS * STEPS
    config.on_policy_n_envs_per_worker = WORLDS
    config.on_policy_n_minibatch_iters, config.on_policy_minibatch_size = 4, 50
    config.lr, config.clip_grad_val, config.evaluation = 1e-5, 0.5, False
    config.evaluation_episodes = 1
    algorithm, model = IppoConfig.get_from_yaml(), MlpConfig.get_from_yaml()
    algorithm.scale_mapping, algorithm.lmbda = "exp", 0.95
    algorithm.use_tanh_normal = False
    model.num_cells = list(START.card.network.hidden)
    experiment = Experiment(
        task=WorldsTask("swarm_logistics", {}),
        algorithm_config=algorithm,
        model_config=model,
        critic_model_config=model,
        seed=0,
        config=config,
    )
    for loss in experiment.losses.values():
        loss.normalize_advantage = True
    # TorchRL keeps the parameters beside the layers: weight and bias of each, one after another.
    parts = list(experiment.policy.parameters())
    weights, biases = parts[::2], parts[1::2]
    with torch.no_grad():
        for number, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
            shipped = torch.from_numpy(START.tensors[f"layers.{number}.weight"])
            weight.zero_()
            weight[: len(shipped), READ if number == 0 else slice(None)] = shipped
            bias[: len(shipped)] = torch.from_numpy(START.tensors[f"layers.{number}.bias"])
        # The last layer tells the noise as well: of each output the logarithm of its deviation.
        biases[-1][len(shipped) :] = torch.from_numpy(START.tensors["deviations"]).log()
    return experiment


def played(policy: Any) -> list[int]:
    """Return how many items a swarm delivers with what was learned, for each of the seeds."""
    env = TorchRLWorlds(make, SEEDS)
    with torch.no_grad(), set_exploration_type(ExplorationType.RANDOM):
        env.rollout(SCENARIO.n_steps, policy)
    return env.delivered


if __name__ == "__main__":
    main()
