"""BenchMARL's IPPO or MAPPO: python -m interop.benchmarl_ppo --learner benchmarl-mappo --seed 0."""

from __future__ import annotations

import tempfile
from typing import Any

import torch
from benchmarl.algorithms import IppoConfig, MappoConfig
from benchmarl.experiment import Callback, Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from tensordict.nn import NormalParamExtractor

from interop.benchmarl_task import SwarmLogisticsTask
from interop.small_world import SETTINGS, Learning, Tensors, drive_ahead, main, tensors_of
from swarm_logistics_env.world.motion import OUTPUTS

ALGORITHMS = {"benchmarl-ippo": IppoConfig, "benchmarl-mappo": MappoConfig}
NOISE = f"biased_softplus_{SETTINGS.deviation}"


def learn(learning: Learning) -> Tensors:
    """Train; see `small_world.main`."""
    frames = learning.n_worlds * SETTINGS.n_steps
    config = ExperimentConfig.get_from_yaml()
    config.create_json, config.loggers, config.evaluation = False, [], False
    config.max_n_frames, config.max_n_iters = None, learning.updates
    config.on_policy_collected_frames_per_batch = frames
    config.on_policy_n_envs_per_worker, config.evaluation_episodes = learning.n_worlds, 1
    config.on_policy_n_minibatch_iters = SETTINGS.epochs
    config.on_policy_minibatch_size = frames // SETTINGS.n_minibatches
    config.lr, config.gamma = SETTINGS.learning_rate, SETTINGS.gamma
    config.clip_grad_val = SETTINGS.max_grad_norm
    algorithm, model = ALGORITHMS[learning.learner].get_from_yaml(), MlpConfig.get_from_yaml()
    algorithm.lmbda, algorithm.clip_epsilon = SETTINGS.gae_lambda, SETTINGS.clip
    algorithm.scale_mapping, algorithm.use_tanh_normal = NOISE, False
    model.num_cells = list(SETTINGS.hidden)
    watch = Watch(learning)
    with tempfile.TemporaryDirectory() as folder:
        config.save_folder = folder
        experiment = Experiment(
            task=getattr(SwarmLogisticsTask, learning.world.upper()).get_from_yaml(),
            algorithm_config=algorithm,
            model_config=model,
            critic_model_config=model,
            seed=learning.seed,
            config=config,
            callbacks=[watch],
        )
        for loss in experiment.losses.values():
            loss.normalize_advantage = True  # its YAML cannot say it
        watch.begin(list(experiment.policy.parameters()))
        experiment.run()
    return watch.learned()


class Watch(Callback):  # type: ignore[misc]  # BenchMARL is not in the gate
    """Lowers the learning rate and tells of the training, after every update."""

    def __init__(self, learning: Learning) -> None:
        super().__init__()
        self._learning = learning

    def begin(self, parts: list[torch.nn.Parameter]) -> None:
        """Let the network drive ahead; its last three outputs, the noise, depend on no input."""
        self._parts, n = parts, len(OUTPUTS)
        drive_ahead(parts)
        with torch.no_grad():
            parts[-2][n:] = 0.0
        means = torch.arange(2 * n).unsqueeze(1) < n
        weight: Any = parts[-2]
        weight.register_hook(lambda gradient: gradient * means)
        self._learning.tell(0, self.learned)

    def learned(self) -> Tensors:
        """Return the tensors of a policy file."""
        with torch.no_grad():
            _, deviations = NormalParamExtractor(scale_mapping=NOISE)(self._parts[-1])
        return tensors_of(self._parts, deviations)

    def on_train_end(self, training_td: Any, group: str) -> None:
        """BenchMARL calls it after each update."""
        done = self.experiment.total_frames * len(self.experiment.group_map[group])
        for optimizer in self.experiment.optimizers[group].values():
            for each in optimizer.param_groups:
                each["lr"] = self._learning.left(done) * SETTINGS.learning_rate
        self._learning.tell(done, self.learned)


if __name__ == "__main__":
    main(learn, list(ALGORITHMS))
