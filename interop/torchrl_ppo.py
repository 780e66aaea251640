"""TorchRL's collector and PPO loss on a batch of worlds: python -m interop.torchrl_ppo --seed 0."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import torch
from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.modules import IndependentNormal, ProbabilisticActor
from torchrl.objectives import ClipPPOLoss, ValueEstimators

from interop.small_world import SETTINGS, Learning, Tensors, drive_ahead, main, make_env, tensors_of
from interop.torchrl_worlds import GROUP, TorchRLWorlds
from swarm_logistics_env.core.streams import key
from swarm_logistics_env.world.motion import INPUTS, OUTPUTS


def learn(learning: Learning) -> Tensors:
    """Train; see `small_world.main`."""
    layers, noise = network(len(OUTPUTS)), AddStateIndependentNormalScale(
        len(OUTPUTS), scale_mapping=f"biased_softplus_{SETTINGS.deviation}"
    )  # fmt: skip
    parts, seen = list(layers.parameters()), [(GROUP, "observation")]
    drive_ahead(parts)
    output_keys = [(GROUP, "loc"), (GROUP, "scale")]
    actor = ProbabilisticActor(
        TensorDictModule(nn.Sequential(layers, noise), seen, output_keys),
        in_keys=output_keys,
        out_keys=[(GROUP, "action")],
        distribution_class=IndependentNormal,
        return_log_prob=True,
        log_prob_key=(GROUP, "log_prob"),
    )
    critic = TensorDictModule(network(1), seen, [(GROUP, "state_value")])
    loss = ClipPPOLoss(
        actor, critic, clip_epsilon=SETTINGS.clip, entropy_bonus=False, critic_coeff=0.5,
        loss_critic_type="l2", normalize_advantage=True,
    )  # fmt: skip
    loss.set_keys(
        reward=(GROUP, "reward"), action=(GROUP, "action"), value=(GROUP, "state_value"),
        done=(GROUP, "done"), terminated=(GROUP, "terminated"),
        sample_log_prob=(GROUP, "log_prob"),
    )  # fmt: skip
    loss.make_value_estimator(ValueEstimators.GAE, gamma=SETTINGS.gamma, lmbda=SETTINGS.gae_lambda)

    def learned() -> Tensors:
        return tensors_of(parts, noise(torch.zeros(len(OUTPUTS)))[1])

    optimizer = torch.optim.Adam(loss.parameters(), SETTINGS.learning_rate)
    seeds = [key(learning.seed, "world", world) >> 1 for world in range(learning.n_worlds)]
    worlds = TorchRLWorlds(lambda: make_env(learning.scenario), seeds)
    frames = learning.n_worlds * SETTINGS.n_steps
    total, done = learning.updates * frames, 0
    collector = Collector(worlds, actor, frames_per_batch=frames, total_frames=total)
    learning.tell(done, learned)
    for batch in collector:
        update(loss, optimizer, batch)
        done += learning.rows * SETTINGS.n_steps
        for group in optimizer.param_groups:
            group["lr"] = learning.left(done) * SETTINGS.learning_rate
        learning.tell(done, learned)
    collector.shutdown()
    return learned()


def update(loss: Any, optimizer: Any, batch: Any) -> None:
    """Learn from a batch (W, T), of which every robot's steps are rows."""
    for end in ("done", "terminated"):  # a robot's, as its world's
        shape = batch["next", GROUP, "reward"].shape
        batch["next", GROUP, end] = batch["next", end].unsqueeze(-2).expand(shape)
    with torch.no_grad():
        loss.value_estimator(batch)
    rows = batch.reshape(-1)
    for _ in range(SETTINGS.epochs):
        for some in torch.randperm(len(rows)).chunk(SETTINGS.n_minibatches):
            losses = loss(rows[some])
            optimizer.zero_grad()
            (losses["loss_objective"] + losses["loss_critic"]).backward()
            nn.utils.clip_grad_norm_(loss.parameters(), SETTINGS.max_grad_norm)
            optimizer.step()


def network(n_outputs: int) -> nn.Sequential:
    """Return the layers from a robot's inputs to so many outputs."""
    layers: list[nn.Module] = []
    for n_in, n_out in pairwise((len(INPUTS), *SETTINGS.hidden)):
        layers += [nn.Linear(n_in, n_out), nn.Tanh()]
    return nn.Sequential(*layers, nn.Linear(SETTINGS.hidden[-1], n_outputs))


if __name__ == "__main__":
    main(learn, ["torchrl-ppo"])
