"""The learner: stable-baselines3's PPO, and its policy in the form that is played without it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO

from swarm_logistics_env.errors import TrainingError
from swarm_logistics_env.train.critic import AsymmetricPolicy
from swarm_logistics_env.train.network_view import NetworkView
from swarm_logistics_env.train.training import Training

ACTIVATIONS: dict[str, type[torch.nn.Module]] = {"tanh": torch.nn.Tanh, "relu": torch.nn.ReLU}

# What an untrained network says whatever it reads: it drives ahead, so that it meets things. One
# that trembles on the spot would learn very slowly that searching pays.
FIRST_OUTPUTS = (0.8, 0.0, 0.0)


def make_learner(
    training: Training, view: NetworkView, device: str, *, goes_on: bool = False
) -> PPO:
    """Return PPO as the training asks for it; seeds the worlds and global generators.

    Args:
        goes_on: whether the worlds are in mid-training: nothing is seeded then.
    """
    ppo, network = training.ppo, training.network
    first, last = ppo.learning_rate, ppo.final_learning_rate
    learner = PPO(
        AsymmetricPolicy,
        view,
        learning_rate=lambda left: last + left * (first - last),
        n_steps=ppo.n_steps,
        batch_size=training.rows * ppo.n_steps // ppo.n_minibatches,
        n_epochs=ppo.epochs,
        gamma=ppo.gamma,
        gae_lambda=ppo.gae_lambda,
        clip_range=ppo.clip,
        ent_coef=ppo.entropy,
        vf_coef=ppo.value_weight,
        max_grad_norm=ppo.max_grad_norm,
        target_kl=ppo.target_kl,
        policy_kwargs={
            "net_arch": {"pi": list(network.hidden), "vf": list(ppo.value_hidden)},
            "activation_fn": ACTIVATIONS[network.activation],
        },
        seed=None if goes_on else training.seed,
        device=device,
    )
    with torch.no_grad():
        learner.policy.log_std.copy_(torch.tensor(ppo.deviations).log())
        learner.policy.action_net.bias.copy_(torch.tensor(FIRST_OUTPUTS))
    return learner


def device_of(asked: str | None) -> str:
    """Return the device to learn on: as asked, else the GPU where there is one.

    Raises:
        TrainingError: there is no such device.
    """
    has_gpu = torch.cuda.is_available()
    if asked not in (None, "cpu", "cuda"):
        raise TrainingError(f"device = {asked!r}: should be 'cpu' or 'cuda'")
    if asked == "cuda" and not has_gpu:
        raise TrainingError(
            "device = 'cuda': torch finds no GPU here; should be 'cpu', or left out"
        )
    return asked or ("cuda" if has_gpu else "cpu")


def tensors_of(policy: Any) -> dict[str, NDArray[np.float32]]:
    """Return the tensors of a policy file (`policies.learned.tensor_shapes`) from PPO's policy."""
    tensors = {
        "deviations": _array(policy.log_std.exp()),
    }
    for layer, linear in enumerate(linears(policy)):
        tensors[f"layers.{layer}.weight"] = _array(linear.weight)
        tensors[f"layers.{layer}.bias"] = _array(linear.bias)
    return tensors


def take_tensors(policy: Any, tensors: Mapping[str, NDArray[np.float32]]) -> None:
    """Give PPO's policy the layers of a policy file; its deviations stay as they are."""
    with torch.no_grad():
        for layer, linear in enumerate(linears(policy)):
            linear.weight.copy_(torch.from_numpy(tensors[f"layers.{layer}.weight"]))
            linear.bias.copy_(torch.from_numpy(tensors[f"layers.{layer}.bias"]))


def linears(policy: Any) -> list[torch.nn.Linear]:
    """Return the layers from inputs to outputs of PPO's policy."""
    hidden = [m for m in policy.mlp_extractor.policy_net if isinstance(m, torch.nn.Linear)]
    return [*hidden, policy.action_net]


def actor_parameters(policy: Any) -> list[torch.nn.Parameter]:
    """Return what there is to learn between inputs and outputs."""
    return [parameter for linear in linears(policy) for parameter in linear.parameters()]


def outputs_of(policy: Any, inputs: torch.Tensor) -> torch.Tensor:
    """Return the most likely outputs (N, outputs) of PPO's policy, with their gradient."""
    outputs: torch.Tensor = policy.action_net(policy.mlp_extractor.forward_actor(inputs))
    return outputs


def _array(tensor: torch.Tensor) -> NDArray[np.float32]:
    return tensor.detach().cpu().numpy().astype(np.float32).copy()
