"""BenchMARL: MAPPO with a central critic, as a task of one's own."""

from __future__ import annotations

import tempfile
from typing import Any

import torch
from benchmarl.algorithms import MappoConfig
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from torchrl.envs import PettingZooWrapper

from interop.conditions import CONDITIONS, MAX_CYCLES, played
from interop.results import passes, runs_with

FRAMES = 200
ITERATIONS = 2


class SwarmTask(PettingZooClass):  # type: ignore[misc]  # BenchMARL is not in the gate
    """The environment in a condition as a task of BenchMARL's, with `state` for the critic.

    Its `config` is {"condition": a name, "made": a list that gets the environments}.
    """

    def get_env_fun(self, num_envs: int, continuous_actions: bool, seed: Any, device: Any) -> Any:
        """Return a maker of the environment."""

        def make() -> PettingZooWrapper:
            env = CONDITIONS[self.config["condition"]]()
            self.config["made"].append(env)
            groups = {"robots": list(env.possible_agents)}
            return PettingZooWrapper(
                env, return_state=True, group_map=groups, seed=seed, device=device
            )

        return make

    def supports_continuous_actions(self) -> bool:
        """Return True."""
        return True

    def supports_discrete_actions(self) -> bool:
        """Return False."""
        return False

    def has_state(self) -> bool:
        """Return True."""
        return True

    def has_render(self, env: Any) -> bool:
        """Return False."""
        return False

    def max_steps(self, env: Any) -> int:
        """Return the length of an episode."""
        return MAX_CYCLES

    @staticmethod
    def env_name() -> str:
        """Return the name."""
        return "swarm_logistics"


def main() -> None:
    """Train in every condition for two iterations, each with an evaluation."""
    runs_with("benchmarl", "torchrl", "tensordict", "torch", "pettingzoo", "gymnasium")
    for name in CONDITIONS:
        with tempfile.TemporaryDirectory() as folder:
            train(name, folder)


def train(name: str, folder: str) -> None:
    """Train in one condition and check that the policy has changed."""
    config = ExperimentConfig.get_from_yaml()
    config.save_folder, config.create_json, config.loggers = folder, False, []
    config.max_n_iters, config.max_n_frames = ITERATIONS, None
    config.on_policy_collected_frames_per_batch = config.evaluation_interval = FRAMES
    config.on_policy_n_envs_per_worker, config.evaluation_episodes = 1, 2
    config.on_policy_n_minibatch_iters, config.on_policy_minibatch_size = 2, 100
    config.render = False
    made: list[Any] = []
    experiment = Experiment(
        task=SwarmTask("swarm_logistics", {"condition": name, "made": made}),
        algorithm_config=MappoConfig.get_from_yaml(),
        model_config=MlpConfig.get_from_yaml(),
        critic_model_config=MlpConfig.get_from_yaml(),
        seed=0,
        config=config,
    )
    before = parameters(experiment.policy)
    experiment.run()
    after = parameters(experiment.policy)
    assert torch.isfinite(after).all()
    assert not torch.equal(after, before)
    assert experiment.total_frames == ITERATIONS * FRAMES, experiment.total_frames
    passes(f"MAPPO, {ITERATIONS * FRAMES} frames, {ITERATIONS} updates, {played(name, *made)}")


def parameters(policy: Any) -> torch.Tensor:
    """Return all parameters of a network as one vector."""
    return torch.nn.utils.parameters_to_vector(policy.parameters()).detach().clone()


if __name__ == "__main__":
    main()
