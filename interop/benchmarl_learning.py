"""BenchMARL goes on from the shipped network, and is judged beside Swarm D-T on the same seeds.

python -m interop.benchmarl_learning

The warehouse of the paper, with 10 robots that read and command in the frame of their motion. It
shows that BenchMARL plays and trains the network, not that BenchMARL learned to win from nothing.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from benchmarl.algorithms import IppoConfig
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from tensordict import TensorDict, TensorDictBase
from torchrl.data import Binary, Bounded, Composite, Unbounded
from torchrl.envs import EnvBase
from torchrl.envs.utils import ExplorationType, set_exploration_type

from swarm_logistics_env import Scenario, policies, run_episode, swarm_logistics_v0
from swarm_logistics_env.adapters.worlds import World, Worlds
from swarm_logistics_env.motion import INPUTS
from swarm_logistics_env.wrappers import MotionFrame

SCENARIO = Scenario(n_robots=10, restock=True, duration=200.0)
START: Any = policies.load("ppo-delivery")
READ = [INPUTS.index(name) for name in START.card.network.inputs]
REWARDS = {"own_delivery": 1.0, "lift_requested": 0.5, "approach": 0.1, "contact": -0.05}
WORLDS, STEPS, ITERATIONS = 8, 125, 4
SEEDS = range(10_000, 10_010)  # nothing was learned on them


GROUP = "robots"


class TorchRLWorlds(EnvBase):  # type: ignore[misc]  # TorchRL is not in the gate
    """Worlds of N robots each, as a batch (W,) of one group, "robots", with rows (W, N, D).

    Every world plays its whole time, so all of them end together; give them `restock=True`.

    Args:
        make: makes one world.
        seeds: of the first episode of each world; later ones follow from them.
    """

    def __init__(self, make: Callable[[], World], seeds: Sequence[int]) -> None:
        self.worlds = Worlds(lambda _: make(), len(seeds), threads=1)
        self.group_map = {GROUP: self.worlds.envs[0].possible_agents}
        self._seeds: list[int | None] = list(seeds)
        each = (len(seeds), len(self.group_map[GROUP]))
        super().__init__(batch_size=each[:1])
        seen, command = self.worlds.observation_space.shape, self.worlds.command_space

        def grouped(**specs: Any) -> Composite:
            return Composite({GROUP: Composite(specs, shape=each)}, shape=each[:1])

        self.observation_spec = grouped(observation=Unbounded((*each, *seen)))
        low, high = (torch.from_numpy(end).expand(*each, -1) for end in (command.low, command.high))
        self.action_spec = grouped(action=Bounded(low, high, dtype=torch.float32))
        self.reward_spec = grouped(reward=Unbounded((*each, 1)))
        ends = {name: Binary(1, (*each[:1], 1), dtype=torch.bool) for name in ENDS}
        self.done_spec = Composite(ends, shape=each[:1])

    @property
    def delivered(self) -> list[int]:
        """Items delivered so far in each world's episode."""
        return [env.warehouse.state.delivered for env in self.worlds.envs]

    def _reset(self, tensordict: TensorDictBase | None = None, **_: Any) -> TensorDictBase:
        observations = self.worlds.blank()
        for world, seed in enumerate(self._seeds):
            self.worlds.begin(world, observations, seed)
        self._seeds = [None] * len(self._seeds)
        return self._told(observations)

    def _step(self, tensordict: TensorDictBase) -> TensorDictBase:
        self.worlds.give(tensordict[GROUP, "action"].flatten(0, 1).numpy())
        step = self.worlds.step()
        told = self._told(step.observations)
        told[GROUP, "reward"] = self._shaped(step.rewards).unsqueeze(-1)
        told["terminated"] = self._shaped(step.terminated).all(1, keepdim=True)
        told["truncated"] = self._shaped(step.truncated).all(1, keepdim=True)
        told["done"] = told["terminated"] | told["truncated"]
        return told

    def _set_seed(self, seed: int | None) -> None:
        """The seeds are given when it is made."""

    def _told(self, observations: np.ndarray[Any, Any]) -> TensorDict:
        told = TensorDict({}, self.batch_size)
        told[GROUP] = TensorDict({"observation": self._shaped(observations)}, self._each)
        return told

    def _shaped(self, rows: np.ndarray[Any, Any]) -> torch.Tensor:
        return torch.from_numpy(rows).view(*self._each, *rows.shape[1:])

    @property
    def _each(self) -> tuple[int, int]:
        return len(self._seeds), len(self.group_map[GROUP])


ENDS = ("done", "terminated", "truncated")


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
